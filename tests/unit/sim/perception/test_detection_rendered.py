"""Cans are found in rendered pictures, with room for a hand or a way to push them."""

from __future__ import annotations

from math import copysign, cos, dist, pi, sin

import numpy as np
import pytest

from aeros.sim.bullet.renderer import Image
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import UPRIGHT, Camera
from aeros.sim.layouts.fetch import (
    CAN_SIZE,
)
from aeros.sim.perception.detection import detect_red_cylinder

pytestmark = pytest.mark.physics


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


def test_a_few_red_pixels_are_not_an_object() -> None:
    camera = Camera((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), up=(1.0, 0.0, 0.0))
    rgb = np.full((camera.height, camera.width, 3), 128, dtype=np.uint8)
    rgb[100:104, 100:106] = (200, 10, 10)
    picture = Image(rgb, np.ones((camera.height, camera.width)))
    assert detect_red_cylinder(picture, camera, CAN_SIZE) is None
    rgb[100:110, 100:110] = (200, 10, 10)
    assert detect_red_cylinder(picture, camera, CAN_SIZE) is not None
