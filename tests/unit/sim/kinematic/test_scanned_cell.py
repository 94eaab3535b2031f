"""Sections of a scene without physics, and the readings that scanners make of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from aeros.sim.geometry import UPRIGHT, Pose
from aeros.sim.kinematic.plant import KinematicPlant, make_plant
from aeros.sim.kinematic.scanned_cell import KinematicCell
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.skill import act
from aeros.spec.model.scene import BodyPart
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import execute
from tests.unit.sim.scanners.cells import inside, reference_scanners


@pytest.fixture
def plant() -> Iterator[KinematicPlant]:
    made = make_plant(shipped_scene("fetch"), 4, scanners=reference_scanners())
    yield made
    made.close()


def scene_of(plant: KinematicPlant) -> DeclaredScene:
    assert isinstance(plant._scene, DeclaredScene)
    return plant._scene


def readings(plant: KinematicPlant) -> list[Any]:
    """The distance of people at each tick of half a second."""
    found: list[Any] = []

    def monitor(now: float, values: Any) -> None:
        found.append((now, values["human_distance"]))

    execute(plant, act("wait", duration=0.5), monitor, 9.0)
    return found


def test_the_plane_meets_the_stands_and_nothing_on_them(plant: KinematicPlant) -> None:
    cell = KinematicCell(scene_of(plant), plant._arm, -0.1)
    stands = [scene_of(plant).pose_of(BodyPart(name)).position[:2] for name in ("stand", "delivery_stand")]
    assert len(cell.furniture()) == 2
    for one, place in zip(cell.furniture(), stands, strict=True):
        assert inside(one, np.array([place])).all()
    assert cell.furniture() is cell.furniture()
    assert cell.people() == ()


def test_a_thing_that_has_moved_is_cut_where_it_is(plant: KinematicPlant) -> None:
    before = scene_of(plant).sections(-0.1)
    scene_of(plant)._objects["can"].pose = Pose((-0.5, 1.5, -0.1), UPRIGHT)
    after = scene_of(plant).sections(-0.1)
    assert len(after) == len(before) + 1
    assert any(inside(one, np.array([(-0.5, 1.5)])).all() for one in after)


def test_readings_have_the_time_of_their_scan(plant: KinematicPlant) -> None:
    found = readings(plant)
    assert {reading.value for _, reading in found} == {SCANNER_RANGE}
    ages = [now - reading.time for now, reading in found]
    assert 0.0 < min(ages) < max(ages) < 0.1
    assert plant.observe()["human_distance"].time < plant.now()


def test_a_thing_that_stands_in_the_aisle_is_an_intruder(plant: KinematicPlant) -> None:
    scene_of(plant)._objects["can"].pose = Pose((-0.5, 1.5, -0.1), UPRIGHT)
    assert readings(plant)[-1][1].value < 1.3


def test_without_scanners_nobody_is_there() -> None:
    plant = make_plant(shipped_scene("fetch"), 4)
    assert plant.observe()["human_distance"].value == SCANNER_RANGE
    plant.close()
