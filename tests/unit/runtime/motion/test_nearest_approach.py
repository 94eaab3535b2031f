"""The least distance of a motion from a barrier is that of its worst position."""

from __future__ import annotations

from itertools import pairwise
from math import sin
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.motion.nearest_approach import _positions, find_nearest_approach, shifted
from aeros.runtime.motion.swept_volume import BarrierBox, Enclosure, SweptMotion, find_breach
from aeros.runtime.ports import Ball, Hull, RobotBody, Vec3

BODY = RobotBody(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.5), (Ball("arm", 1, (0.5, 0.0, 0.5), 0.06),))
WALL = BarrierBox("wall", (-1.0, 0.5, 0.0), (1.0, 2.0, 1.0), False, False, None)
ROOM = BarrierBox("room", (-1.0, -0.2, 0.0), (1.0, 0.2, 1.0), True, False, None)


def turning(angle: float, **changed: Any) -> SweptMotion:
    """One vertical joint turns from 0 to `angle`; the ball at its end is at y = 0.5 sin(angle)."""
    a, b, c, d = ((angle * third / 3.0,) for third in range(4))
    motion = SweptMotion(BODY, ([(a, b, c, d)],), (0.0,), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), True)
    return motion._replace(**changed)


def test_the_distance_is_that_of_the_ball_at_the_worst_position() -> None:
    distance, place = find_nearest_approach(turning(0.5), WALL, "arm")
    assert distance == pytest.approx(0.5 - 0.5 * sin(0.5) - 0.06)
    assert place == 1.0


def test_inside_a_volume_the_distance_is_negative() -> None:
    assert find_nearest_approach(turning(1.5), WALL, "arm").distance < 0.0
    low = WALL._replace(lower=(-1.0, 0.0, 0.0))
    deep = find_nearest_approach(turning(0.5), low, "arm").distance
    assert deep == pytest.approx(-0.5 * sin(0.5) - 0.06)


def test_a_volume_to_stay_in_is_left_by_as_much_as_the_ball_is_outside() -> None:
    distance, place = find_nearest_approach(turning(0.5), ROOM, "arm")
    assert distance == pytest.approx(0.2 - 0.5 * sin(0.5) - 0.06)
    assert place == 1.0
    assert find_nearest_approach(turning(0.1), ROOM, "arm").distance == pytest.approx(0.14 - 0.5 * sin(0.1))


def test_a_base_that_drives_with_the_arm_is_where_the_arm_is() -> None:
    driving = turning(0.0, base_path=(0.0, 0.4, 0.0))
    assert find_nearest_approach(driving, WALL, "arm").distance == pytest.approx(0.04)
    alone = turning(0.5, base_path=(0.0, -0.4, 0.0), is_synchronous=False)
    assert find_nearest_approach(alone, WALL, "arm").distance == pytest.approx(0.44 - 0.5 * sin(0.5))


def test_a_base_that_drives_with_the_arm_is_nowhere_else_meanwhile() -> None:
    driving = turning(-0.5, base_path=(0.0, 0.3, 0.0))
    found = find_nearest_approach(driving, WALL, "arm")
    assert found.distance == pytest.approx(0.44 - 0.3 + 0.5 * sin(0.5))
    assert found.path_parameter == 1.0
    alone = find_nearest_approach(driving._replace(is_synchronous=False), WALL, "arm")
    assert alone.distance == pytest.approx(0.44 - 0.3)


def test_a_volume_of_the_base_drives_with_it() -> None:
    own = WALL._replace(is_in_base_frame=True)
    driving = turning(0.0, base_path=(0.0, 9.0, 0.0))
    assert find_nearest_approach(driving, own, "arm").distance == pytest.approx(0.44)


def test_a_held_object_is_enclosed_by_a_box() -> None:
    corners = tuple((x, y, 0.5) for x in (0.4, 0.6) for y in (-0.1, 0.1))
    holding = turning(0.0, held=Hull("held", 1, corners, 0.0))
    assert find_nearest_approach(holding, WALL, "held").distance == pytest.approx(0.4)


def test_an_enclosure_is_shifted_as_a_whole() -> None:
    moved = shifted(Enclosure((1.0, 2.0, 3.0), (0.1, 0.2, 0.3), 0.05), (1.0, -1.0, 0.5))
    assert moved == Enclosure((2.0, 1.0, 3.5), (0.1, 0.2, 0.3), 0.05)


@given(st.floats(-1.5, 1.5), st.floats(0.0, 0.1))
def test_a_motion_that_is_shown_to_be_clear_is_measured_as_clear(angle: float, clearance: float) -> None:
    for box in (WALL, ROOM):
        if find_breach(turning(angle), [box], clearance) is None:
            assert find_nearest_approach(turning(angle), box, "arm").distance >= clearance


@pytest.mark.parametrize(("count", "steps"), [(1, 64), (3, 96), (64, 64), (100, 100)])
def test_a_path_is_measured_at_64_places_or_more(count: int, steps: int) -> None:
    ends = [1.5 * number / count for number in range(count + 1)]
    pieces = [
        tuple(((a + (b - a) * third / 3.0),) for third in range(4)) for a, b in pairwise(ends)
    ]  # fmt: skip
    found = [*_positions(pieces)]  # type: ignore[arg-type]
    assert [s for s, _ in found] == pytest.approx([number / steps for number in range(steps + 1)])
    assert [q for _, (q,) in found] == pytest.approx([1.5 * number / steps for number in range(steps + 1)])


@pytest.mark.parametrize("is_synchronous", [True, False])
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_base_nears_a_wall_by_its_way(is_synchronous: bool, axis: int, sign: float) -> None:
    """The wall is a metre from the ball, whose radius is 60 mm; the base drives 0.3 m towards it."""
    middle, way, lower, upper = (0.5, 0.0, 0.5), [0.0] * 3, [-9.0] * 3, [9.0] * 3
    way[axis] = sign * 0.3
    lower[axis], upper[axis] = sorted((middle[axis] + sign, middle[axis] + sign * 2.0))
    wall = BarrierBox("wall", tuple(lower), tuple(upper), False, False, None)  # type: ignore[arg-type]
    driving = turning(0.0, base_path=tuple(way), is_synchronous=is_synchronous)
    found = find_nearest_approach(driving, wall, "arm")
    assert found.distance == pytest.approx(1.0 - 0.3 - 0.06)


def test_a_held_box_is_measured_from_faces_edges_and_corners() -> None:
    """A box from 0.4 to 0.6, -0.1 to 0.1, and 0.4 to 0.6."""
    corners = tuple((x, y, z) for x in (0.4, 0.6) for y in (-0.1, 0.1) for z in (0.4, 0.6))
    holding = turning(0.0, held=Hull("held", 1, corners, 0.0))

    def distance(lower: Vec3, upper: Vec3, *, keep_inside: bool = False) -> float:
        box = BarrierBox("box", lower, upper, keep_inside, False, None)
        return find_nearest_approach(holding, box, "held").distance

    assert distance((0.9, 0.5, 0.0), (2.0, 2.0, 1.0)) == pytest.approx(0.5)
    assert distance((0.8, 0.3, 0.7), (2.0, 2.0, 1.0)) == pytest.approx(0.3)
    assert distance((0.5, -0.5, 0.0), (2.0, 2.0, 1.0)) == pytest.approx(-0.1)
    assert distance((0.1, -1.0, 0.0), (2.0, 1.0, 1.0), keep_inside=True) == pytest.approx(0.3)
    assert distance((-1.0, -1.0, 0.0), (0.8, 1.0, 1.0), keep_inside=True) == pytest.approx(0.2)
    assert distance((-1.0, -1.0, 0.0), (0.5, 1.0, 1.0), keep_inside=True) == pytest.approx(-0.1)
