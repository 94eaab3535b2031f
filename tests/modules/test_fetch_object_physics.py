"""Something is fetched: found in pictures, grasped by friction, delivered by driving."""

from __future__ import annotations

from contextlib import closing
from math import dist

import pytest

from aeros.sim.physics import PhysicsPlant, make_plant
from tests.modules.robot import Robot
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.ground_truth import is_done

pytestmark = pytest.mark.physics

RULES = (
    ("robot_at_target", "navigate"),
    ("object_detected", "detect"),
    ("object_grasped", "grasp"),
    ("object_delivered", "deliver"),
)
"""Unless the first holds, do the second."""


def room(seed: int) -> tuple[Robot, PhysicsPlant]:
    plant = make_plant(shipped_scene("fetch"), seed)
    return Robot("fetch_object", plant), plant


@pytest.mark.parametrize("seed", [0, pytest.param(3, marks=pytest.mark.deep)])
def test_each_step_makes_its_own_predicate_true_and_the_last_one_the_goal(seed: int) -> None:
    robot, plant = room(seed)
    with closing(plant):
        for predicate, skill in RULES:
            assert robot.observed().get(predicate) is not True
            assert not is_done(plant)
            assert robot.run(skill) is None
            assert robot.observed()[predicate]
        assert is_done(plant)


@pytest.mark.deep
def test_rules_finish_a_delivery_that_was_interrupted_on_the_way() -> None:
    robot, plant = room(2)
    with closing(plant):
        for _, skill in RULES[:3]:
            assert robot.run(skill) is None
        assert robot.run("deliver", actions=5) is None
        # The picture by which the can was grasped is over by then.
        robot.do("wait", duration=31.0)
        done = []
        for predicate, skill in RULES:
            if not robot.observed().get(predicate):
                done.append(skill)
                assert robot.run(skill) is None
        assert done == ["navigate", "deliver"]
        assert robot.observed()["object_delivered"]


def test_nothing_is_known_of_the_object_before_a_look() -> None:
    robot, plant = room(0)
    with closing(plant):
        before = robot.observed()
        assert not before["object_detected"]
        assert "object_position" not in before


def test_the_mast_camera_locates_the_can_and_its_picture_expires() -> None:
    robot, plant = room(5)
    with closing(plant):
        for skill in ("navigate", "detect"):
            assert robot.run(skill) is None
        after = robot.observed()
        station = after["station_position"]
        assert dist(after["object_position"][:2], (station[0] + 0.58, station[1])) < 0.15
        assert after["object_detected"]
        robot.do("wait", duration=31.0)
        assert not robot.observed()["object_detected"]


def test_an_arm_in_the_way_hides_the_can() -> None:
    robot, plant = room(0)
    with closing(plant):
        robot.do("look", camera="mast")
        assert not robot.observed()["object_detected"]


def test_a_grasp_halted_on_the_way_down_is_recovered() -> None:
    robot, plant = room(1)
    with closing(plant):
        for skill in ("navigate", "detect"):
            assert robot.run(skill) is None
        assert robot.run("grasp", actions=6) is None
        assert not robot.observed()["object_grasped"]
        assert robot.run("recover") is None
        assert robot.observed()["object_detected"]
        assert robot.run("grasp") is None
        assert robot.observed()["object_grasped"]


def test_a_camera_that_is_not_there_is_refused() -> None:
    robot, plant = room(0)
    with closing(plant):
        assert robot.do("look", camera="ceiling").reason == "unknown camera: `ceiling`"


def test_a_picture_no_longer_counts_once_the_can_was_held() -> None:
    robot, plant = room(0)
    with closing(plant):
        for skill in ("navigate", "detect"):
            assert robot.run(skill) is None
        x, y, z = robot.observed()["object_position"]
        robot.do("grip", width=0.08, force=10.0)
        robot.do("move_tool", target=(x, y, z + 0.15), yaw=0.0, speed=0.3)
        robot.do("move_tool", target=(x, y, z + 0.01), yaw=0.0, speed=0.1)
        robot.do("grip", width=0.03, force=10.0)
        assert robot.observed()["object_grasped"]
        robot.do("move_tool", target=(x, y, z + 0.05), yaw=0.0, speed=0.1)
        robot.do("grip", width=0.08, force=10.0)
        after = robot.observed()
        assert (after["object_grasped"], after["object_detected"]) == (False, False)
