from __future__ import annotations

from dataclasses import replace
from math import dist, hypot
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from aeros.runtime.ports import CameraPicture, CameraView
from aeros.sim.engine.people import Person, Waypoint
from aeros.sim.faults.degradation import NO_DEGRADATION, Degradation
from aeros.sim.faults.effects import physical_effect, picture_effect
from aeros.sim.faults.model import (
    PersonEntersFault,
    PhysicalFault,
)
from aeros.sim.physics import PlantParts
from aeros.sim.sensor_model import SensorModel
from aeros.spec.declared.faults import (
    CommandDelayFault,
    CoveredScannerFault,
    GripForceFault,
    ImpulseFault,
    MisplacedPictureFault,
    MissedPictureFault,
    PadFrictionFault,
    SensorFault,
    SilentScannerFault,
    TorqueFault,
)


def picture(camera: str = "mast") -> CameraPicture:
    """A grey picture of 2 x 2 pixels, 1 m deep."""
    depth = np.full(4, 1.0, np.float32).tobytes()
    return CameraPicture(camera, 0.0, 2, 2, b"\x80" * 12, depth, VIEW)


VIEW = CameraView((1.0, 2.0, 3.0), (1.0, 2.0, 0.0), (1.0, 0.0, 0.0), 50.0)


def test_a_displacement_moves_the_place_of_the_camera_level() -> None:
    effect = picture_effect(MisplacedPictureFault(0.06, None), np.random.default_rng(1))
    moved = effect(picture())
    assert dist(moved.view.eye, VIEW.eye) == pytest.approx(0.06)
    assert moved.view.eye[2] == VIEW.eye[2]
    shift = [a - b for a, b in zip(moved.view.eye, VIEW.eye, strict=True)]
    assert [a - b for a, b in zip(moved.view.target, VIEW.target, strict=True)] == pytest.approx(shift)
    assert (moved.rgb, moved.depth) == (picture().rgb, picture().depth)


def parts(**more: Any) -> PlantParts:
    return cast("PlantParts", SimpleNamespace(**more))


def ticks(kind: PhysicalFault, **more: Any) -> list[Degradation]:
    return list(physical_effect(kind, np.random.default_rng(1), "it 1", parts(**more)))


@pytest.mark.parametrize(
    ("kind", "each"),
    [
        (PadFrictionFault(0.25, 3), Degradation(friction=0.25)),
        (GripForceFault(5.0, 3), Degradation(force=5.0)),
        (TorqueFault(0.5, 3), Degradation(torque_share=0.5)),
        (CommandDelayFault(7, 3), Degradation(lag_ticks=7)),
        (
            SensorFault("gap", 3, noise=0.5, latency=0.25, dropout=0.125),
            Degradation(sensors={"gap": SensorModel(0.5, 0.0, 0.25, 0.125)}),
        ),
        (CoveredScannerFault("west", 3, 0.25), Degradation(covered={"west": 0.25})),
        (SilentScannerFault("west", 3), Degradation(silent=frozenset(("west",)))),
    ],
)
def test_a_degradation_lasts_as_many_ticks_as_declared(kind: PhysicalFault, each: Degradation) -> None:
    assert ticks(kind) == [each] * 3


class World:
    """Notes each push."""

    def __init__(self) -> None:
        self.pushes: list[tuple[int, tuple[float, float, float]]] = []

    def push(self, body: int, force: tuple[float, float, float]) -> None:
        self.pushes.append((body, force))


def bumped(direction: tuple[float, float, float] | None) -> list[tuple[int, tuple[float, float, float]]]:
    world = World()
    scene = SimpleNamespace(body={"cube": 7}.__getitem__)
    kind = ImpulseFault("cube", 0.5, 12, direction)
    assert ticks(kind, world=world, scene=scene) == [NO_DEGRADATION] * 12
    return world.pushes


def test_a_bump_spreads_its_impulse_evenly() -> None:
    # 0.5 N·s over 12 ticks of 1/240 s are 10 N.
    ((body, force), *others) = bumped((0.6, 0.0, -0.8))
    assert (body, len(others)) == (7, 11)
    assert force == pytest.approx((6.0, 0.0, -8.0))
    assert set(others) == {(body, force)}


def test_a_bump_without_a_direction_has_one_horizontal_direction() -> None:
    (force,) = {force for _, force in bumped(None)}
    assert hypot(force[0], force[1]) == pytest.approx(10.0)
    assert force[2] == 0.0


def test_a_person_enters_at_once_under_the_occurrences_name() -> None:
    entered: list[Person] = []
    person = Person("guest", (Waypoint((1.0, 2.0)),))
    people = SimpleNamespace(add_person=entered.append)
    assert ticks(PersonEntersFault(person), people=people) == []
    assert entered == [replace(person, name="it 1")]


def test_a_dazzled_camera_sees_white_and_nothing_near() -> None:
    missed = picture_effect(MissedPictureFault(), np.random.default_rng(1))
    seen = missed(picture())
    assert seen.rgb == b"\xff" * 12
    assert np.frombuffer(seen.depth or b"", np.float32).tolist() == [5.0] * 4
    assert missed(replace(picture(), depth=None)).depth is None


def test_a_declared_displacement_keeps_its_direction() -> None:
    away = picture_effect(MisplacedPictureFault(0.5, (0.0, 0.6, 0.8)), np.random.default_rng(1))
    assert away(picture()).view.eye == pytest.approx((1.0, 2.3, 3.4))
