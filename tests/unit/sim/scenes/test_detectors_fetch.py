"""The room with physics, before and without any motion of the robot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import Contact
from aeros.sim.detected_object import DetectedObject
from aeros.sim.layouts.fetch import LastDetection
from aeros.sim.physics import PhysicsPlant
from aeros.sim.scenes.physics_scene import PhysicsScene
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.start_layouts import room_layout

pytestmark = pytest.mark.physics

SEED = 3


@pytest.fixture(scope="module")
def plant() -> Iterator[PhysicsPlant]:
    """One for all tests: none of them moves anything."""
    made = PhysicsPlant(PhysicsScene(shipped_scene("fetch")), SEED)
    yield made
    made.close()


@pytest.fixture
def scene(plant: PhysicsPlant) -> PhysicsScene:
    assert isinstance(plant._scene, PhysicsScene)
    plant._scene._detectors[0].seen = None  # type: ignore[attr-defined]
    return plant._scene


def test_can_and_decoy_stand_where_they_were_drawn(plant: PhysicsPlant, scene: PhysicsScene) -> None:
    laid = room_layout(SEED)
    for name, place, mass in (("can", laid.can, 0.15), ("decoy", laid.decoy, 0.1)):
        dynamics = bullet.getDynamicsInfo(scene.body(name), -1, physicsClientId=plant._world.client)
        assert dynamics[0] == mass
        assert plant._world.pose(scene.body(name)).position == pytest.approx(place, abs=0.003)
    with pytest.raises(KeyError, match="shelf"):
        scene.body("shelf")
    measured = scene.measure()
    assert measured["station_position"] == laid.station
    assert (measured["robot_at_target"], measured["object_grasped"]) == (False, False)


def _finding(found: DetectedObject | None) -> Any:
    return lambda _: found


def test_an_object_found_by_a_look_is_known_from_then_on(plant: PhysicsPlant, scene: PhysicsScene) -> None:
    can = room_layout(SEED).can
    seen = scene.detect("mast", _finding(DetectedObject(can)))
    assert (seen["object_position"], seen["object_delivered"]) == (can, False)
    assert scene.measure()["object_detected"] is True
    assert scene._detectors[0].seen == LastDetection(can, plant._world.time)  # type: ignore[attr-defined]
    assert scene.detect("mast", _finding(None)) == {"object_delivered": False}
    assert scene.measure()["object_detected"] is False


def test_a_camera_that_does_not_exist_takes_no_picture(scene: PhysicsScene) -> None:
    with pytest.raises(KeyError, match="roof"):
        scene.detect("roof")


def test_a_detection_is_kept_while_nothing_is_held(scene: PhysicsScene) -> None:
    scene.detect("mast", _finding(DetectedObject((1.0, 0.0, 0.4))))
    scene.tick()
    assert scene.measure()["object_detected"] is True


@pytest.mark.parametrize(
    ("is_holding", "others", "fingers", "forgets"),
    [
        (True, 0, 2, True),
        (True, 1, 2, False),
        (True, 0, 1, False),
        (False, 0, 2, False),
    ],
)
def test_a_detection_is_forgotten_once_both_fingers_alone_touch_the_can(
    plant: PhysicsPlant,
    scene: PhysicsScene,
    monkeypatch: pytest.MonkeyPatch,
    is_holding: bool,
    others: int,
    fingers: int,
    forgets: bool,
) -> None:
    robot: Any = plant._robot
    can = scene.body("can")
    assert len(robot.fingers) == 2

    def touch(body: int, link: int) -> Contact:
        return Contact(-1, link, body, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0)

    touching = [touch(robot.body, link) for link in list(robot.fingers)[:fingers]] + [touch(robot.body, 0)]
    touching += [touch(scene.body("decoy"), -1)] * others

    def contacts(body: int, other: int | None = None) -> list[Contact]:
        assert body == can
        return [one for one in touching if other in (None, one.body_b)]

    scene.detect("mast", _finding(DetectedObject((1.0, 0.0, 0.4))))
    with monkeypatch.context() as patched:
        patched.setattr(plant._world, "contacts", contacts)
        patched.setattr(robot, "is_holding", lambda: is_holding)
        scene.tick()
        assert scene.measure()["object_grasped"] is (others == 0 and fingers == 2)
    assert scene.measure()["object_detected"] is not forgets
