"""Truth changes behind the back of each sensor of the reference site, and no predicate does.

Of two plants of the same seed one is changed in what a sensor cannot measure. Cameras take new pictures, and
the perceivers of the scene's module judge them: all that either robot reads, believes or sees is alike.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import pytest

from aeros.sim.engine.people import Person, Waypoint
from aeros.sim.geometry import Vector3
from aeros.sim.physics import PhysicsPlant
from aeros.skill import act
from aeros.spec.model.scene import BodyPart
from tests.modules.robot import Robot
from tests.shipped_scenes import CAMERAS
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.bullet.bullet_parts import as_bullet
from tests.unit.sim.safety.test_hidden_truth import make, make_scanned, put, scene_of, slip_wheels, wrap
from tests.unit.sim.scanners.cells import reference_site

pytestmark = pytest.mark.physics

MODULES = {"fetch": "fetch_object", "table": "clean_table", "dumpling_bench": "make_dumplings"}
"""The module whose perceivers see a scene."""

UNDERGROUND = -1.5
"""Height under the floor that hides what is there from every camera, m."""


@dataclass(frozen=True)
class Case:
    """A change that a sensor cannot measure.

    Attributes:
        sensor: by its name in the site file.
        scene: name of the scene; `walled` is a room with scanners and a wall.
        change: makes it.
        judge: what is true then and was not before, for a referee.
        camera: that takes a new picture; None for none.
        wait: time until the readings are compared, s.
    """

    sensor: str
    scene: str
    change: Callable[[PhysicsPlant], None]
    judge: Callable[[PhysicsPlant], Any]
    camera: str | None = None
    wait: float = 0.1


def load_the_carriage(plant: PhysicsPlant) -> None:
    """Lay 5 kg on the carriage: they press straight down, which no joint feels."""
    base = plant._simulated.true_points()[0]
    place = (base[0] - 0.2, base[1], base[2] + 0.031)
    as_bullet(plant._world).bodies.add_box((0.06, 0.06, 0.06), place, mass=5.0)


def hang_the_block_between_the_fingers(plant: PhysicsPlant) -> None:
    """Put the block between open fingers, which are 2 cm off it on either side, for an instant."""
    put(plant, "decoy", plant._simulated.true_points()[1])


def move_the_stand(plant: PhysicsPlant) -> None:
    """Move a fixture after the cell was surveyed."""
    x, y, z = scene_of(plant).pose_of(BodyPart("delivery_stand")).position
    put(plant, "delivery_stand", (x + 0.1, y, z))


def bury(thing: str) -> Callable[[PhysicsPlant], None]:
    """Move a thing that is under the floor 40 cm farther."""

    def change(plant: PhysicsPlant) -> None:
        x, y, _ = scene_of(plant).pose_of(BodyPart(thing)).position
        put(plant, thing, (x + 0.4, y, UNDERGROUND))

    return change


def level(place: Vector3) -> tuple[float, float]:
    """Round x and y of a place to 10 cm."""
    return round(place[0], 1), round(place[1], 1)


def place_of(thing: str) -> Callable[[PhysicsPlant], Any]:
    """Judge where a thing is, to 10 cm."""
    return lambda plant: level(scene_of(plant).pose_of(BodyPart(thing)).position)


def person(plant: PhysicsPlant) -> float:
    """Judge how far a person is, to 10 cm."""
    return round(plant._true_distance(), 1)


def nothing(plant: PhysicsPlant) -> None:
    """Change nothing: somebody stands behind the wall from the beginning."""


BURIED = {"fetch": "decoy", "table": "cube", "dumpling_bench": "filling_2"}
"""A thing of each scene that lies under the floor while pictures are taken."""

CASES = (
    Case("area_scanner", "walled", nothing, person),
    Case("safety_controller", "walled", nothing, person),
    Case("joint_encoders", "fetch", slip_wheels, lambda plant: level(plant._simulated.true_points()[1])),
    Case("wheel_odometry", "fetch", slip_wheels, lambda plant: level(plant._simulated.true_points()[0])),
    Case(
        "joint_torques", "fetch", load_the_carriage, lambda plant: plant._simulated.net_contact_force() > 40.0
    ),
    Case("gripper", "fetch", hang_the_block_between_the_fingers, place_of("decoy"), wait=0.01),
    Case("cell_survey", "fetch", move_the_stand, place_of("delivery_stand")),
    Case("press", "dumpling_bench", wrap, lambda plant: plant.truth()["make_dumplings.dumpling_wrapped"]),
    *(
        Case(f"{camera}_camera", scene, bury(BURIED[scene]), place_of(BURIED[scene]), camera)
        for camera, scene in (
            ("hand", "fetch"),
            ("mast", "fetch"),
            ("aisle_top", "fetch"),
            ("table_top", "table"),
            ("table_side", "table"),
            ("overhead", "dumpling_bench"),
            ("side", "dumpling_bench"),
        )
    ),
)


def test_each_sensor_of_the_reference_site_has_a_case() -> None:
    assert {one.sensor for one in CASES} == set(reference_site().sensor_names)


def build(case: Case, *, is_changed: bool) -> PhysicsPlant:
    if case.scene == "walled":
        people = (Person("behind", (Waypoint((2.0, 0.5)),)),) if is_changed else ()
        return make_scanned(people)
    plant = make(case.scene)
    if case.camera is not None:
        thing = BURIED[case.scene]
        x, y, _ = scene_of(plant).pose_of(BodyPart(thing)).position
        put(plant, thing, (x, y, UNDERGROUND))
    return plant


def known(case: Case, plant: PhysicsPlant) -> dict[str, Any]:
    """All that a robot reads and perceives, after a picture if the case has a camera."""
    if case.scene == "walled":
        execute(plant, act("wait", duration=case.wait), allow, 9.0)
        return {name: reading.value for name, reading in plant.observe().items()}
    robot = Robot(MODULES[case.scene], plant)
    execute(robot.plant, act("wait", duration=case.wait), allow, 9.0)
    if case.camera is not None:
        names = {site: own for own, site in CAMERAS.get(MODULES[case.scene], {}).items()}
        assert robot.do("look", camera=names.get(case.camera, case.camera)).completed
    values = {name: reading.value for name, reading in robot.plant.observe().items()}
    assert not robot.failures
    return values


OFTEN = ("mast", "overhead")
"""Cameras whose cases `make test` runs; those of the others are left to `make deep`."""


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(one, marks=() if one.camera in (None, *OFTEN) else pytest.mark.deep, id=one.sensor)
        for one in CASES
    ],
)
def test_a_change_behind_a_sensor_changes_no_predicate(case: Case) -> None:
    with ExitStack() as closing:
        plain, changed = (build(case, is_changed=one) for one in (False, True))
        for plant in (plain, changed):
            closing.callback(plant.close)
        if case.scene != "walled":
            assert case.judge(plain) == case.judge(changed)
        case.change(changed)
        before, after = known(case, plain), known(case, changed)
        assert case.judge(plain) != case.judge(changed)
        assert before.keys() == after.keys()
        for name, value in before.items():
            expected = value if isinstance(value, (bool, str)) else pytest.approx(value, abs=5e-3)
            assert after[name] == expected, name
        if case.camera is not None:
            first, second = (plant.pictures()[case.camera] for plant in (plain, changed))
            assert (first.rgb, first.depth) == (second.rgb, second.depth)
