"""Truth changes behind the sensors' backs, and nothing that they read changes; only a referee sees it.

Two plants of the same seed stand still. In one of them bodies are put elsewhere, seals close, dirt goes and
wheels slip, without a picture. Readings of both stay alike, and so do pictures, which nobody took anew. A
perceiver gets these two and nothing else, so no predicate can change either.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.engine.engine import Engine
from aeros.sim.engine.people import Person, Waypoint
from aeros.sim.engine.robot import PhysicalRobot
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.skill import act
from aeros.spec.model.scene import BodyPart
from aeros.spec.model.sensor_errors import OdometryErrors, SurveyErrors
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.bare_scene import BareScene
from tests.unit.sim.bullet.bullet_parts import as_bullet, as_panda
from tests.unit.sim.scanners.cells import reference_scanners

pytestmark = pytest.mark.physics


def scene_of(plant: PhysicsPlant) -> PhysicsScene:
    assert isinstance(plant._scene, PhysicsScene)
    return plant._scene


def put(plant: PhysicsPlant, body: str, place: tuple[float, float, float]) -> None:
    bullet.resetBasePositionAndOrientation(
        scene_of(plant).body(body),
        place,
        (0.0, 0.0, 0.0, 1.0),
        physicsClientId=as_bullet(plant._world).client,
    )


def deliver_the_can(plant: PhysicsPlant) -> None:
    x, y, z = scene_of(plant)._poses["delivery_position"].position
    put(plant, "can", (x, y, z + 0.001))


def tidy_and_wipe(plant: PhysicsPlant) -> None:
    x, y, _ = scene_of(plant)._poses["bin"].position
    put(plant, "cube", (x - 0.04, y, 0.027))
    put(plant, "can", (x + 0.04, y, 0.032))
    scene_of(plant)._coatings["dirt"].wiped[:] = True


def wrap(plant: PhysicsPlant) -> None:
    """Fold the wrapper round the filling where it lies, and seal it."""
    scene, client = scene_of(plant), as_bullet(plant._world).client
    wrapper = scene._bodies["wrapper"]
    x, y, z = scene.pose_of(BodyPart("wrapper")).position
    put(plant, "filling", (x, y, z + 0.0115))
    bullet.resetJointState(wrapper.number, wrapper.joints["fold"], pi, physicsClientId=client)
    scene.state.sealed["dough"] = True
    scene.seal(BodyPart("wrapper", "fold"), 0.5)


@dataclass(frozen=True)
class Change:
    """A change of the truth, and the state variable that a referee then judges otherwise."""

    scene: str
    change: Callable[[PhysicsPlant], None]
    judged: str


CHANGES = (
    Change("fetch", deliver_the_can, "fetch_object.object_delivered(object = red_can, to = middle)"),
    Change("table", tidy_and_wipe, "clean_table.table_wiped(region = whole)"),
    Change("table", tidy_and_wipe, "clean_table.table_organized(region = whole)"),
    Change("dumpling_bench", wrap, "make_dumplings.dumpling_wrapped"),
)


def make_scanned(people: tuple[Person, ...] = ()) -> PhysicsPlant:
    """The room with the reference cell's scanners, less noise, and a wall that hides what is behind it."""
    two = [one for one in reference_scanners().scanners if one.name in ("fence_west", "fence_south_west")]
    scanners = reference_scanners()._replace(scanners=tuple(two), noise=0.0, dropout=0.0)
    return PhysicsPlant(Walled(), 3, people=people, scanners=scanners)


class Walled(BareScene):
    """The bare table, and a wall beside it from the floor up."""

    def build(self, engine: Engine, robot: PhysicalRobot, chance: RandomSource) -> None:
        super().build(engine, robot, chance)
        as_bullet(engine.world).bodies.add_box((0.1, 6.0, 2.0), (1.5, 0.6, 0.7))


def make(scene: str) -> PhysicsPlant:
    survey, odometry = SurveyErrors(0.002, 0.001, 0.0005), OdometryErrors(0.01, 0.005)
    return make_plant(shipped_scene(scene), 3, survey, odometry=odometry)


@pytest.fixture(params=CHANGES, ids=lambda one: one.judged)
def pair(request: pytest.FixtureRequest) -> Iterator[tuple[Change, PhysicsPlant, PhysicsPlant]]:
    one: Change = request.param
    plain, changed = make(one.scene), make(one.scene)
    yield one, plain, changed
    plain.close()
    changed.close()


def numbers(plant: PhysicsPlant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def assert_alike(plain: PhysicsPlant, changed: PhysicsPlant) -> None:
    before, after = numbers(plain), numbers(changed)
    assert before.keys() == after.keys()
    for name, value in before.items():
        assert after[name] == pytest.approx(value, abs=1e-3), name
    assert plain.pictures() == changed.pictures()


def test_an_unseen_change_changes_no_reading(pair: tuple[Change, PhysicsPlant, PhysicsPlant]) -> None:
    one, plain, changed = pair
    assert plain.truth()[one.judged] is changed.truth()[one.judged] is False
    one.change(changed)
    for plant in (plain, changed):
        execute(plant, act("wait", duration=0.1), allow, 9.0)
    assert changed.truth()[one.judged] is True
    assert plain.truth()[one.judged] is False
    assert_alike(plain, changed)


def slip_wheels(plant: PhysicsPlant) -> None:
    """Let the carriage slip by 20 cm along x and 10 cm along y while its wheels stand."""
    robot, slip = as_panda(plant._simulated), (0.2, -0.1)
    world = as_bullet(plant._world)
    x, y = robot.odometry.drift
    robot.odometry.drift = (x + slip[0], y + slip[1])
    for joint, off in zip(robot._drive, slip, strict=True):
        at = world.joint_position(robot.body, joint)
        bullet.resetJointState(robot.body, joint, at - off, physicsClientId=world.client)
    robot._driven = (robot._driven[0] - slip[0], robot._driven[1] - slip[1])
    robot.hold_base()
    world._joint_states.clear()


def test_a_slipping_wheel_is_not_felt() -> None:
    plain, changed = make("fetch"), make("fetch")
    slip_wheels(changed)
    for plant in (plain, changed):
        execute(plant, act("wait", duration=0.1), allow, 9.0)
    moved = np.subtract(changed._simulated.true_points()[0], plain._simulated.true_points()[0])
    assert moved == pytest.approx((-0.2, 0.1, 0.0), abs=2e-3)
    before, after = numbers(plain), numbers(changed)
    for name in ("base_position", "tool_position", "joint_position", "base_speed"):
        assert after[name] == pytest.approx(before[name], abs=2e-3), name
    plain.close()
    changed.close()


def test_a_place_is_never_measured_exactly() -> None:
    plant = make("fetch")
    true = {name: pose.position for name, pose in scene_of(plant)._poses.items()}
    for name in ("station_survey", "delivery_position"):
        measured = plant.observe()[f"fetch_object.{name}"].value
        assert measured != true[name]
        assert measured == pytest.approx(true[name], abs=0.012)
    plant.close()


def distances(plant: PhysicsPlant) -> list[tuple[float, float]]:
    """Distance by the scanners and true distance, over half a second."""
    found: list[tuple[float, float]] = []

    def monitor(now: float, values: Any) -> None:
        found.append((values["human_distance"].value, plant._true_distance()))

    execute(plant, act("wait", duration=0.5), monitor, 9.0)
    plant.close()
    return found


def test_a_person_whom_no_ray_meets_changes_nothing() -> None:
    nobody = distances(make_scanned())
    hidden = distances(make_scanned((Person("behind", (Waypoint((2.0, 0.5)),)),)))
    assert [seen for seen, _ in hidden] == [seen for seen, _ in nobody] == [SCANNER_RANGE] * len(nobody)
    assert max(true for _, true in hidden) < 1.6


def test_a_person_whom_rays_meet_is_noticed() -> None:
    found = distances(make_scanned((Person("before", (Waypoint((-1.0, -1.0)),)),)))
    assert all(0.0 < true - seen < 0.2 for seen, true in found)


def test_a_box_that_is_no_person_is_an_intruder() -> None:
    plant = make_scanned()
    as_bullet(plant._world).bodies.add_box((0.3, 0.3, 0.6), (-1.0, -1.0, 0.0))
    found = distances(plant)
    assert found[0][0] == SCANNER_RANGE
    assert found[-1][0] < 1.2
    assert {true for _, true in found} == {SCANNER_RANGE}
