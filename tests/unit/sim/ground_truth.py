"""Ground truth of a task: bodies and joints in the simulator, which no acting code sees."""

from __future__ import annotations

from math import dist

from aeros.sim.layouts import dumpling_bench, fetch, table
from aeros.sim.physics import PhysicsPlant
from aeros.sim.scenes.dumpling_bench import DumplingBenchScene
from aeros.sim.scenes.fetch import FetchScene
from aeros.sim.scenes.table import TableScene


def is_done(plant: PhysicsPlant) -> bool:
    """Return True if the task of the plant's scene is done."""
    scene, world = plant._scene, plant._world
    if isinstance(scene, DumplingBenchScene):
        dumpling = scene._dumpling()
        return dumpling.is_closed and all(
            dumpling_bench._is_in_pot(place) for place in (dumpling.plate.position, dumpling.filling)
        )
    if isinstance(scene, TableScene):
        pieces = [world.pose(scene.body(name)).position for name in ("cube", "can")]
        sponge = world.pose(scene.body("sponge")).position
        is_wiped = scene._dirt.wiped_fraction >= table.WIPED_THRESHOLD
        return (
            is_wiped and all(map(table._in_bin, pieces)) and dist(sponge, scene._rest) < table.REST_TOLERANCE
        )
    assert isinstance(scene, FetchScene)
    can, delivery = world.pose(scene.body("can")).position, scene._laid.delivery
    return (
        dist(can[:2], delivery[:2]) < fetch.DELIVERY_TOLERANCE
        and abs(can[2] - delivery[2]) < fetch.CAN_SIZE[1] / 2
    )
