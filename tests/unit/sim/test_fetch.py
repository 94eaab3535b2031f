"""Something is fetched: found in pictures, grasped by friction, delivered by driving."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign, cos, dist, pi, sin
from typing import Any

import numpy as np
import pytest

from aeros.sim.bullet.renderer import Image
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.detected_object import DetectedObject, Push
from aeros.sim.geometry import UPRIGHT, Camera
from aeros.sim.layouts.fetch import (
    CAN_SIZE,
    MAX_DETECTION_AGE,
    STATION_TO_STAND,
    LastDetection,
    camera_measurements,
    station_for,
)
from aeros.sim.perception.detection import detect_red_cylinder
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.scenes.fetch import FetchScene
from aeros.skill import act
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.ground_truth import is_done

pytestmark = pytest.mark.physics

RunSkill = Callable[..., str | None]

RULES = (
    ("robot_at_target", "navigate"),
    ("object_detected", "detect"),
    ("object_grasped", "grasp"),
    ("object_delivered", "deliver"),
)
"""Unless the first holds, do the second."""


def observed(plant: PhysicsPlant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


@pytest.mark.parametrize("seed", [0, 3])
def test_each_step_makes_its_own_predicate_true_and_the_last_one_the_goal(
    seed: int, run_skill: RunSkill
) -> None:
    plant = make_plant("fetch", seed)
    for predicate, skill in RULES:
        assert not observed(plant)[predicate]
        assert not is_done(plant)
        assert run_skill(plant, "fetch_object", skill) is None
        assert observed(plant)[predicate]
    assert is_done(plant)


def test_rules_finish_a_delivery_that_was_interrupted_on_the_way(run_skill: RunSkill) -> None:
    plant = make_plant("fetch", 2)
    for _, skill in RULES[:3]:
        assert run_skill(plant, "fetch_object", skill) is None
    assert run_skill(plant, "fetch_object", "deliver", actions=3) is None
    execute(plant, act("wait", duration=MAX_DETECTION_AGE), allow, 1e9)
    done = []
    for predicate, skill in RULES:
        if not observed(plant)[predicate]:
            done.append(skill)
            assert run_skill(plant, "fetch_object", skill) is None
    assert done == ["navigate", "deliver"]
    assert observed(plant)["object_delivered"]


def test_nothing_is_known_of_the_object_before_a_look() -> None:
    before = observed(make_plant("fetch", 0))
    assert not before["object_detected"]
    assert "object_position" not in before


def test_the_mast_camera_locates_the_can_and_its_detection_expires(run_skill: RunSkill) -> None:
    scene = FetchScene()
    plant = PhysicsPlant(scene, 5)
    assert run_skill(plant, "fetch_object", "navigate") is None
    assert run_skill(plant, "fetch_object", "detect") is None
    after = observed(plant)
    station = after["station_position"]
    assert dist(after["object_position"][:2], (station[0] + 0.58, station[1])) < 0.15
    execute(plant, act("wait", duration=MAX_DETECTION_AGE), allow, 1e9)
    assert not observed(plant)["object_detected"]


def test_an_arm_in_the_way_hides_the_can(run_skill: RunSkill) -> None:
    plant = make_plant("fetch", 0)
    execute(plant, act("look", camera="mast"), allow, 1e9)
    assert not observed(plant)["object_detected"]


def test_a_grasp_halted_on_the_way_down_is_recovered(run_skill: RunSkill) -> None:
    plant = make_plant("fetch", 1)
    for skill in ("navigate", "detect"):
        assert run_skill(plant, "fetch_object", skill) is None
    assert run_skill(plant, "fetch_object", "grasp", actions=6) is None
    assert not observed(plant)["object_grasped"]
    assert run_skill(plant, "fetch_object", "recover") is None
    assert observed(plant)["object_detected"]
    assert run_skill(plant, "fetch_object", "grasp") is None
    assert observed(plant)["object_grasped"]


def test_a_camera_that_is_not_there_is_refused() -> None:
    ended = execute(make_plant("fetch", 0), act("look", camera="ceiling"), allow, 1e9)
    assert ended.reason == "unknown camera: `ceiling`"


CAMERA = Camera((0.0, 0.2, 0.8), (0.6, 0.0, 0.0))
RED, BLUE = (0.80, 0.10, 0.08, 1.0), (0.15, 0.30, 0.75, 1.0)


@pytest.mark.parametrize("place", [(0.6, 0.0), (0.5, 0.15), (0.7, -0.1)])
@pytest.mark.parametrize("axis", [None, 0.0, 0.8, -1.3])
def test_a_red_can_is_found_within_5_mm_however_it_lies_and_a_blue_box_is_not(
    place: tuple[float, float], axis: float | None
) -> None:
    radius, height = CAN_SIZE
    world = PhysicsWorld()
    x, y = place
    world.bodies.add_box((0.04, 0.04, 0.05), (x, y - 0.15, 0.025), colour=BLUE)
    assert detect_red_cylinder(world.renderer.render(CAMERA), CAMERA, CAN_SIZE) is None
    middle = (x, y, height / 2 if axis is None else radius)
    half = ((axis or 0.0) / 2, pi / 4)
    lying = (-sin(half[0]) * sin(half[1]), cos(half[0]) * sin(half[1]), sin(half[0]) * cos(half[1]),
             cos(half[0]) * cos(half[1]))  # fmt: skip
    world.bodies.add_cylinder(radius, height, middle, UPRIGHT if axis is None else lying, colour=RED)
    found = detect_red_cylinder(world.renderer.render(CAMERA), CAMERA, CAN_SIZE)
    world.close()
    assert found is not None
    assert dist(found.position, middle) < 0.005
    assert found.axis == (None if axis is None else pytest.approx(axis, abs=0.12))
    assert found.grip_yaw == pytest.approx(axis or 0.0, abs=0.12)


@pytest.mark.parametrize(("gap", "grip"), [(0.03, None), (0.10, 0.0)])
def test_a_hand_has_no_room_at_a_wall(gap: float, grip: float | None) -> None:
    world = PhysicsWorld()
    world.bodies.add_box((0.2, 0.6, 0.3), (0.6 + CAN_SIZE[0] + gap + 0.1, 0.0, 0.15))
    world.bodies.add_cylinder(*CAN_SIZE, (0.6, 0.0, CAN_SIZE[1] / 2), colour=RED)
    found = detect_red_cylinder(world.renderer.render(CAMERA), CAMERA, CAN_SIZE)
    world.close()
    assert found is not None
    assert found.grip_yaw == grip


def lying_at_a_wall(
    wall: float, at: float, gap: float = 0.008, turned: float = 0.0
) -> tuple[DetectedObject, tuple[float, float]]:
    """A can along y at x = 0.6, `gap` before a wall of that length with its middle at y = 0.06."""
    world = PhysicsWorld()
    world.bodies.add_box((0.2, wall, 0.4), (0.6 + CAN_SIZE[0] + gap + 0.1, 0.06, 0.2))
    half = (pi / 2 + turned) / 2
    lying = (
        -sin(half) * sin(pi / 4),
        cos(half) * sin(pi / 4),
        sin(half) * cos(pi / 4),
        cos(half) * cos(pi / 4),
    )
    world.bodies.add_cylinder(*CAN_SIZE, (0.6, at, CAN_SIZE[0]), lying, colour=RED)
    found = detect_red_cylinder(world.renderer.render(CAMERA), CAMERA, CAN_SIZE)
    world.close()
    assert found is not None
    return found, (0.6, at)


@pytest.mark.parametrize(("at", "way"), [(0.0, -0.16), (0.15, 0.12)])
def test_a_can_lying_at_a_wall_is_pushed_along_it_past_its_nearer_end(at: float, way: float) -> None:
    found, (x, y) = lying_at_a_wall(0.3, at)
    assert found.grip_yaw is None
    assert found.push is not None
    start, pushed = found.push
    assert dist(pushed, (0.0, way, 0.0)) < 0.03
    # From behind, and off the wall.
    assert start[1] == pytest.approx(y - copysign(0.08, way), abs=0.01)
    assert x - 0.03 < start[0] < x - 0.01


def test_a_can_a_little_off_a_wall_is_pushed_nearer_to_its_axis() -> None:
    near, far = (lying_at_a_wall(0.3, 0.0, gap)[0].push for gap in (0.008, 0.024))
    assert near is not None
    assert far is not None
    assert far.start[0] > near.start[0] + 0.01


@pytest.mark.parametrize("turned", [0.5, -0.5])
def test_a_can_at_an_angle_is_pushed_by_its_end_away_from_the_wall(turned: float) -> None:
    push = lying_at_a_wall(0.3, 0.0, 0.028, turned)[0].push
    assert push is not None
    assert push.start[0] < 0.57


@pytest.mark.parametrize(("wall", "at"), [(0.3, -0.24), (1.2, 0.0)])
def test_nothing_is_pushed_without_need_or_to_a_place_without_room(wall: float, at: float) -> None:
    assert lying_at_a_wall(wall, at)[0].push is None


def test_a_picture_without_a_possible_push_removes_the_earlier_push() -> None:
    shown = camera_measurements("mast", DetectedObject((0.0, 0.0, 0.0), 1.5, None, None), (0.0, 0.0, 0.0))
    assert shown["object_push_start"] is shown["object_push_way"] is None
    push = Push((0.0, -0.08, 0.0), (0.0, 0.2, 0.0))
    shown = camera_measurements("mast", DetectedObject((0.0, 0.0, 0.0), 1.5, None, push), (0.0, 0.0, 0.0))
    assert (shown["object_push_start"], shown["object_push_way"]) == push
    assert "object_push_way" not in camera_measurements(
        "hand", DetectedObject((0.0, 0.0, 0.0)), (0.0, 0.0, 0.0)
    )


@pytest.mark.parametrize(
    ("place", "before_it"),
    [
        ((1.75, 0.30, 0.0), False),
        ((1.75, 0.36, 0.0), True),
        ((1.60, 0.20, 0.0), True),
        ((1.96, 0.20, 0.0), True),
    ],
)
def test_the_station_moves_to_a_can_seen_out_of_reach_or_far_to_the_side(
    place: tuple[float, float, float], before_it: bool
) -> None:
    station = (1.17, 0.20, 0.3)
    wanted = station_for(station, LastDetection(place, 0.0))
    assert wanted == (pytest.approx((place[0] - STATION_TO_STAND, place[1], 0.3)) if before_it else station)


def test_a_few_red_pixels_are_not_an_object() -> None:
    camera = Camera((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), up=(1.0, 0.0, 0.0))
    rgb = np.full((camera.height, camera.width, 3), 128, dtype=np.uint8)
    rgb[100:104, 100:106] = (200, 10, 10)
    picture = Image(rgb, np.ones((camera.height, camera.width)))
    assert detect_red_cylinder(picture, camera, CAN_SIZE) is None
    rgb[100:110, 100:110] = (200, 10, 10)
    assert detect_red_cylinder(picture, camera, CAN_SIZE) is not None


@pytest.mark.parametrize("asks", [True, False])
def test_a_detection_is_dropped_once_the_can_was_held_even_if_not_observed(
    asks: bool, run_skill: RunSkill
) -> None:
    plant = make_plant("fetch", 0)
    for skill in ("navigate", "detect"):
        assert run_skill(plant, "fetch_object", skill) is None
    x, y, z = observed(plant)["object_position"]
    for action in (
        act("grip", width=0.08, force=10.0),
        act("move_tool", target=(x, y, z + 0.15), yaw=0.0, speed=0.3),
        act("move_tool", target=(x, y, z + 0.01), yaw=0.0, speed=0.1),
        act("grip", width=0.03, force=10.0),
        act("move_tool", target=(x, y, z + 0.05), yaw=0.0, speed=0.1),
        act("grip", width=0.08, force=10.0),
    ):
        execute(plant, action, allow, 1e9)
        if asks:
            observed(plant)
    after = observed(plant)
    assert not after["object_grasped"]
    assert not after["object_detected"]
