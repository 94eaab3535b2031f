"""A red cylinder in drawn pictures: where it is, how it lies, and where a hand has room."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera
from aeros.sim.perception.detection import camera_points, detect_red_cylinder, is_yellow
from tests.unit.sim.perception.drawn import GREY, Top, draw

CAMERA = Camera(eye=(0.5, 0.1, 1.5), target=(0.5, 0.1, 0.0), up=(1.0, 0.0, 0.0), field_of_view=40.0)
"""Its picture is 1.09 m high (x) and 1.46 m wide (y), 4.5 mm a pixel."""

SIZE = (0.033, 0.12)
"""Radius and height of the can, m."""

RED = (200, 30, 40)
STANDING = Top(0.6, 0.2, 0.12, (0.033, 0.0), RED, is_round=True)


def lying(heading: float) -> Top:
    """The upper side of a can on its side: a strip as long as it."""
    return Top(0.6, 0.2, 0.066, (0.06, 0.011), RED, heading)


def seen(*tops: Top) -> DetectedObject:
    found = detect_red_cylinder(draw(CAMERA, tops), CAMERA, SIZE)
    assert found is not None
    return found


def wall(u: float, v: float, heading: float, half: tuple[float, float] = (0.01, 0.3)) -> Top:
    """A high wall at (u, v) along and across a heading from the can's middle."""
    x = 0.6 + u * cos(heading) - v * sin(heading)
    y = 0.2 + u * sin(heading) + v * cos(heading)
    return Top(x, y, 0.3, half, GREY, heading)


def test_the_points_of_a_picture_are_where_the_rays_end() -> None:
    camera = Camera(
        (1.0, 2.0, 3.0), (1.0, 2.0, 0.0), up=(1.0, 0.0, 0.0), field_of_view=90.0, width=4, height=2
    )
    points = camera_points(np.full((2, 4), 2.0), camera)
    # 2 m deep: 4 m high and 8 m wide, sampled at lower left corners; right in the picture is -y.
    assert points[0, 0] == pytest.approx((1.0, 6.0, 1.0))
    assert points[0, 3] == pytest.approx((1.0, 0.0, 1.0))
    assert points[1, 2] == pytest.approx((-1.0, 2.0, 1.0))
    assert points.shape == (2, 4, 3)


def test_the_points_of_an_oblique_picture_are_along_its_rays() -> None:
    camera = Camera((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), field_of_view=90.0, width=2, height=2)
    points = camera_points(np.full((2, 2), 1.0), camera)
    # Its middle ray, of the lower left corner of pixel (0, 1), goes down at 45 degrees.
    assert points[0, 1] == pytest.approx((0.7071067811865, 0.0, 1.0 - 0.7071067811865))


def test_a_standing_can_is_a_disc_and_can_be_gripped_at_any_heading() -> None:
    found = seen(STANDING)
    assert found.position == pytest.approx((0.6, 0.2, 0.06), abs=0.004)
    assert (found.axis, found.grip_yaw, found.push) == (None, 0.0, None)


@pytest.mark.parametrize("heading", [0.0, 0.6, -0.6, 1.5])
def test_a_lying_can_is_a_strip_and_is_gripped_across_its_axis(heading: float) -> None:
    found = seen(lying(heading))
    assert found.position == pytest.approx((0.6, 0.2, 0.033), abs=0.004)
    assert found.axis == pytest.approx(heading, abs=0.1)
    assert found.grip_yaw == found.axis
    assert found.push is None


def test_a_heading_is_from_minus_a_quarter_turn_on() -> None:
    assert seen(lying(pi - 0.6)).axis == pytest.approx(-0.6, abs=0.1)
    assert seen(lying(-pi + 0.6)).axis == pytest.approx(0.6, abs=0.1)


def test_without_enough_red_there_is_no_can() -> None:
    blue, dark = STANDING._replace(colour=(40, 30, 200)), STANDING._replace(colour=(55, 5, 5))
    pink = STANDING._replace(colour=(200, 30, 105))
    small = STANDING._replace(half=(0.01, 0.0))
    for tops in ([], [blue], [dark], [pink], [small]):
        assert detect_red_cylinder(draw(CAMERA, tops), CAMERA, SIZE) is None


def test_a_standing_can_next_to_a_wall_is_gripped_at_the_other_heading() -> None:
    # The hand needs 0.06 m along its x and 0.115 m across; 2 cm above the can is room for anything.
    assert seen(STANDING, wall(0.08, 0.0, 0.0)).grip_yaw == 0.0
    assert seen(STANDING, wall(0.05, 0.0, 0.0)).grip_yaw is None
    beside = Top(0.6, 0.3, 0.3, (0.02, 0.01), GREY)
    assert seen(STANDING, beside).grip_yaw == pytest.approx(pi / 2.0)
    low = beside._replace(z=0.135)
    assert seen(STANDING, low).grip_yaw == 0.0


def test_a_standing_can_without_room_is_not_pushed() -> None:
    found = seen(STANDING, wall(0.05, 0.0, 0.0))
    assert (found.grip_yaw, found.push) == (None, None)


@pytest.mark.parametrize("heading", [0.0, 0.6])
def test_a_lying_can_beside_a_short_wall_is_pushed_along_its_axis_past_the_nearer_end(heading: float) -> None:
    # Beside the can, 8 cm across its axis, from 20 cm behind its middle to 7 cm ahead.
    beside = wall(-0.065, 0.08, heading, (0.135, 0.01))
    found = seen(lying(heading), beside)
    assert found.grip_yaw is None
    assert found.push is not None
    assert found.axis is not None
    way = found.push.displacement
    along = way[0] * cos(found.axis) + way[1] * sin(found.axis)
    assert 0.12 <= along <= 0.16
    assert way[1] * cos(found.axis) - way[0] * sin(found.axis) == pytest.approx(0.0, abs=1e-9)
    # The fingers come down 8 cm behind the middle, at most 27 mm off the axis and away from the wall.
    x, y, z = found.push.start
    u = (x - 0.6) * cos(found.axis) + (y - 0.2) * sin(found.axis)
    v = (y - 0.2) * cos(found.axis) - (x - 0.6) * sin(found.axis)
    assert u == pytest.approx(-0.08, abs=0.005)
    assert -0.032 < v < 0.005
    assert z == found.position[2]


def test_between_long_walls_nothing_can_be_pushed() -> None:
    # 10 cm high, so that the picture shows as much of them as of the table.
    walls = [wall(0.0, side, 0.0, (0.9, 0.01))._replace(z=0.1) for side in (-0.07, 0.07)]
    found = seen(lying(0.0), *walls)
    assert (found.grip_yaw, found.push) == (None, None)


@pytest.mark.parametrize(
    ("colour", "yellow"),
    [
        ((200, 150, 50), True),
        ((200, 121, 99), True),
        ((200, 119, 50), False),
        ((200, 150, 101), False),
        ((60, 60, 0), False),
        ((61, 60, 0), True),
    ],
)
def test_a_pixel_is_as_yellow_as_a_sponge(colour: tuple[int, int, int], yellow: bool) -> None:
    assert is_yellow(np.array([[colour, (0, 0, 255)]], np.float64)).tolist() == [[yellow, False]]
