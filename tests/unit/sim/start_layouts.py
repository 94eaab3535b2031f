"""Where the things of the shipped modules' scenes are at the start of a seed."""

from __future__ import annotations

from typing import NamedTuple

from aeros.sim.geometry import Pose, Vector3
from aeros.sim.layouts.placement import place_things
from aeros.sim.randomness import RandomSource
from tests.shipped_scenes import shipped_scene


class RoomLayout(NamedTuple):
    """Places of `fetch`, in W."""

    station: Vector3
    can: Vector3
    decoy: Vector3
    delivery: Vector3
    stands: tuple[Vector3, Vector3]


class TableLayout(NamedTuple):
    """Poses of `table`, in W."""

    rest: Vector3
    sponge: Pose
    cube: Pose
    can: Pose


class BenchLayout(NamedTuple):
    """Poses of `dumpling_bench`, in W."""

    tray: Pose
    stand: Pose
    wrapper: Pose
    filling: Pose


def room_layout(seed: int) -> RoomLayout:
    poses = place_things(shipped_scene("fetch"), RandomSource(seed))
    names = "station_survey", "can", "decoy", "delivery_position"
    station, can, decoy, delivery = (poses[name].position for name in names)
    return RoomLayout(
        station, can, decoy, delivery, (poses["stand"].position, poses["delivery_stand"].position)
    )


def table_layout(seed: int) -> TableLayout:
    poses = place_things(shipped_scene("table"), RandomSource(seed))
    return TableLayout(poses["sponge_rest_position"].position, poses["sponge"], poses["cube"], poses["can"])


def bench_layout(seed: int) -> BenchLayout:
    poses = place_things(shipped_scene("dumpling_bench"), RandomSource(seed))
    return BenchLayout(poses["tray"], poses["stand"], poses["wrapper"], poses["filling"])
