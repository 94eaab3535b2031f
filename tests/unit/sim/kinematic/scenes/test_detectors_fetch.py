"""The room without physics: a camera sees the can where it is in the picture."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any

import pytest

from aeros.runtime.ports import Plant
from aeros.sim.geometry import Pose, yaw_orientation
from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.kinematic.plant import make_plant
from aeros.sim.kinematic.scenes.declared_scene import DeclaredScene
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotState
from aeros.skill import act
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.start_layouts import RoomLayout, room_layout

RunSkill = Callable[..., str | None]


def observed(plant: Plant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def test_a_camera_sees_the_can_where_it_is_in_the_picture_and_only_there(run_skill: RunSkill) -> None:
    plant = make_plant(shipped_scene("fetch"), 0)
    execute(plant, act("look", camera="mast"), allow, inf)
    assert "object_position" not in observed(plant)
    assert not observed(plant)["object_detected"]
    assert run_skill(plant, "fetch_object", "navigate") is None
    execute(plant, act("look", camera="mast"), allow, inf)
    assert observed(plant)["object_detected"]
    assert execute(plant, act("look", camera="roof"), allow, inf).reason == "unknown camera: `roof`"


SEED = 3


def _room() -> tuple[DeclaredScene, ObjectSet, RoomLayout]:
    scene = DeclaredScene(shipped_scene("fetch"))
    return scene, scene.build(RandomSource(SEED)), room_layout(SEED)


def _robot(
    base: tuple[float, float, float], tool: tuple[float, float, float] = (9.0, 9.0, 9.0)
) -> RobotState:
    still = (0.0,) * 7
    return RobotState(still, still, still, tool, 0.0, 0.08, 0.0, base, (0.0, 0.0, 0.0))


def test_can_and_decoy_stand_on_their_stand_and_are_as_wide_as_they_are() -> None:
    _, things, laid = _room()
    for place, yaw, width in ((laid.can, 0.0, 0.044), (laid.can, 0.7, 0.044), (laid.decoy, 0.0, 0.04)):
        assert things.width_between(Pose(place, yaw_orientation(yaw))) == pytest.approx(width)
    x, y, z = laid.can
    # The can's middle is 40 mm over the stand, and the pads reach 9 mm further than its top at 80 mm.
    assert things.width_between(Pose((x, y, z + 0.047), yaw_orientation(0.0))) is not None
    assert things.width_between(Pose((x, y, z + 0.050), yaw_orientation(0.0))) is None
    dx, dy, dz = laid.decoy
    assert things.width_between(Pose((dx, dy, dz + 0.032), yaw_orientation(0.0))) is not None
    assert things.width_between(Pose((dx, dy, dz + 0.035), yaw_orientation(0.0))) is None
    assert things.width_between(Pose((dx + 0.019, dy + 0.019, dz), yaw_orientation(0.0))) is not None
    assert things.width_between(Pose((dx + 0.021, dy, dz), yaw_orientation(0.0))) is None


def test_hands_press_on_the_stands_and_on_the_floor() -> None:
    _, things, laid = _room()
    for x, y, top in (
        (*laid.stands[0][:2], 0.4),
        (*laid.stands[1][:2], 0.4),
        (3.0, 2.0, 0.0),
        (-1.5, -2.5, 0.0),
    ):
        things.tick(Pose((x, y, top + 0.008), yaw_orientation(0.0)), 0.0)
        assert things.load == pytest.approx(10.0)
        things.tick(Pose((x, y, top + 0.010), yaw_orientation(0.0)), 0.0)
        assert things.load == 0.0


def test_the_can_is_grasped_once_it_is_lifted() -> None:
    scene, things, laid = _room()
    base = (0.0, 0.0, 0.3)
    assert scene.measure(_robot(base), 0.0)["object_grasped"] is False
    things.grip(Pose(laid.can, yaw_orientation(0.0)))
    assert scene.measure(_robot(base), 0.0)["object_grasped"] is False
    x, y, z = laid.can
    things.tick(Pose((x, y, z + 0.1), yaw_orientation(0.0)), 0.044)
    measured = scene.measure(_robot(base), 0.0)
    assert (measured["object_grasped"], measured["robot_at_target"]) == (True, False)
    assert scene.measure(_robot(laid.station), 0.0)["robot_at_target"] is True


def test_a_decoy_in_the_hand_is_no_can() -> None:
    scene, things, laid = _room()
    x, y, z = laid.decoy
    things.grip(Pose(laid.decoy, yaw_orientation(0.0)))
    things.tick(Pose((x, y, z + 0.1), yaw_orientation(0.0)), 0.04)
    assert scene.measure(_robot((0.0, 0.0, 0.3)), 0.0)["object_grasped"] is False


def test_a_look_from_the_station_finds_the_can_until_it_is_held() -> None:
    scene, things, laid = _room()
    seen = scene.detect("mast", _robot(laid.station), 0.0, 5.0)
    assert seen["object_position"] == pytest.approx((laid.can[0], laid.can[1], 0.44))
    assert (seen["object_free"], seen["object_lying"], seen["object_delivered"]) == (True, False, False)
    scene.tick(_robot(laid.station))
    assert scene.measure(_robot(laid.station), 35.0)["object_detected"] is True
    assert scene.measure(_robot(laid.station), 35.1)["object_detected"] is False
    things.grip(Pose(laid.can, yaw_orientation(0.0)))
    scene.tick(_robot(laid.station))
    assert scene.measure(_robot(laid.station), 6.0)["object_detected"] is False


def test_a_look_elsewhere_removes_the_earlier_detection() -> None:
    scene, _, laid = _room()
    scene.detect("mast", _robot(laid.station), 0.0, 5.0)
    x, y, z = laid.station
    assert scene.detect("mast", _robot((x - 5.0, y, z)), 0.0, 6.0) == {"object_delivered": False}
    assert scene.measure(_robot(laid.station), 6.0)["object_detected"] is False


def test_a_can_is_seen_by_the_middle_of_its_top() -> None:
    scene, _, laid = _room()
    x, y, z = laid.can
    # The picture of the hand, 70 degrees high, reaches tan(35 deg) = 0.70 of its distance up and down along
    # x: 70 mm from 100 mm over the top. The camera is 70 mm before the tool and 60 mm over it.
    for off, is_seen in ((0.065, True), (0.075, False), (-0.065, True), (-0.075, False)):
        hand = _robot((0.0, 0.0, 0.3), (x + off - 0.07, y, 0.48 + 0.1 - 0.06))
        assert bool(scene.detect("hand", hand, 0.0, 0.0)) is is_seen, off
    assert z == pytest.approx(0.441)
