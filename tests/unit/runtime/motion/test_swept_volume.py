"""Barriers against moving bodies: distances worked out by hand; tests/property samples random ones."""

from __future__ import annotations

from dataclasses import replace
from math import dist, hypot, inf, nextafter, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.motion.bezier import Piece, path_chord
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics, norm
from aeros.runtime.motion.swept_volume import (
    BarrierBox,
    Enclosure,
    MergedMotion,
    RemainingMotion,
    SweptMotion,
    ball_enclosures,
    enclosing_box,
    find_breach,
    is_clear,
)
from aeros.runtime.ports import Ball, RobotBody, Trajectory, Vec3
from tests.unit.runtime.motions import body, chance_of, path, tool

NOWHERE = (0.0, 0.0, 0.0)
ARM = RobotBody(
    ((0.0, 0.0, 0.0),),
    (1.0, 0.0, 0.0),
    (Ball("base", 0, NOWHERE, 0.25), Ball("arm", 1, (1.0, 0.0, 0.0), 0.125)),
)
"""One joint about z: a ball at the base, and one at 1 m that it turns."""


def box(
    lower: Vec3,
    upper: Vec3,
    *,
    inside: bool = False,
    in_base: bool = False,
    links: frozenset[str] | None = None,
) -> BarrierBox:
    return BarrierBox("box", lower, upper, inside, in_base, links)


UNIT = box(NOWHERE, (1.0, 1.0, 1.0))


def line(first: float, last: float) -> Piece:
    a, b, c, d = ((first + (last - first) * third / 3.0,) for third in range(4))
    return a, b, c, d


def moving(
    *ends: float, way: Vec3 = NOWHERE, slack: float = 0.0, base: Vec3 = NOWHERE, synchronous: bool = True
) -> SweptMotion:
    """The joint turns from 0 to each of `ends`."""
    starts = (0.0, *ends)
    pieces = [line(a, b) for a, b in zip(starts, ends, strict=False)]
    return SweptMotion(ARM, (pieces,), (slack,), base, way, synchronous)


# A point and a barrier.


@pytest.mark.parametrize(
    ("p", "distance"),
    [
        ((-2.0, 0.5, 0.5), 2.0),
        ((3.0, 0.5, 0.5), 2.0),
        ((0.5, -2.0, 0.5), 2.0),
        ((0.5, 3.0, 0.5), 2.0),
        ((0.5, 0.5, -2.0), 2.0),
        ((0.5, 0.5, 3.0), 2.0),
        # From an edge and from a corner it is the straight distance.
        ((4.0, 5.0, 0.5), 5.0),
        ((0.5, -3.0, -4.0), 5.0),
        ((-3.0, -4.0, 13.0), 13.0),
    ],
)
def test_a_point_outside_keeps_its_distance(p: Vec3, distance: float) -> None:
    assert is_clear(UNIT, p, NOWHERE, NOWHERE, distance)
    assert not is_clear(UNIT, p, NOWHERE, NOWHERE, nextafter(distance, 99.0))


def test_a_point_within_a_barrier_is_never_clear() -> None:
    assert not is_clear(UNIT, (0.5, 0.5, 0.5), NOWHERE, NOWHERE, 1e-9)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_box_around_a_point_and_its_way_count(axis: int, sign: float) -> None:
    def along(length: float) -> Vec3:
        found = [0.0, 0.0, 0.0]
        found[axis] = length
        return (found[0], found[1], found[2])

    p = [0.5, 0.5, 0.5]
    p[axis] = 0.5 + sign * 3.5  # 3 m from the barrier
    point = (p[0], p[1], p[2])
    assert is_clear(UNIT, point, along(1.0), NOWHERE, 2.0)
    assert not is_clear(UNIT, point, along(1.0), NOWHERE, 2.01)
    assert is_clear(UNIT, point, NOWHERE, along(-sign * 1.0), 2.0)
    assert not is_clear(UNIT, point, NOWHERE, along(-sign * 1.0), 2.01)
    for away in (9.0, 1e-9):
        assert is_clear(UNIT, point, along(1.0), along(sign * away), 2.0)
        assert not is_clear(UNIT, point, along(1.0), along(sign * away), 2.01)
    assert is_clear(UNIT, point, along(1.0), along(-sign * 0.5), 1.5)
    assert not is_clear(UNIT, point, along(1.0), along(-sign * 0.5), 1.51)


def test_a_way_around_a_corner_is_halved_until_it_is_clear() -> None:
    # The box of the whole way contains the barrier; the way itself passes its corner at 0.5·sqrt(2).
    start, way = (-1.0, 1.0, 0.5), (2.0, -2.0, 0.0)
    far = (-1.0, 0.0, 0.5)
    assert not is_clear(UNIT, start, NOWHERE, way, 0.01)
    assert is_clear(UNIT, far, NOWHERE, (1.0, -1.0, 0.0), 0.6)
    assert not is_clear(UNIT, far, NOWHERE, (1.0, -1.0, 0.0), 0.71)


@pytest.mark.parametrize("axis", range(3))
def test_inside_a_barrier_both_ends_of_the_way_keep_their_distance(axis: int) -> None:
    room = box(NOWHERE, (10.0, 10.0, 10.0), inside=True)
    for end, edge in ((2.0, -1.0), (8.0, 1.0)):
        p, way, edges = [5.0] * 3, [0.0] * 3, [0.0] * 3
        way[axis], edges[axis] = end - 5.0, 0.5
        point, along = (p[0], p[1], p[2]), (way[0], way[1], way[2])
        around = (edges[0], edges[1], edges[2])
        assert is_clear(room, point, around, along, 1.5), edge
        assert not is_clear(room, point, around, along, 1.51), edge
    assert not is_clear(room, (11.0, 5.0, 5.0), NOWHERE, NOWHERE, 0.0)


COORDINATES = st.floats(-3.0, 3.0)
VECTORS = st.tuples(COORDINATES, COORDINATES, COORDINATES)
SIZES = st.tuples(*[st.floats(0.0, 1.0)] * 3)


def sampled_distance(barrier: BarrierBox, p: Vec3, edges: Vec3, way: Vec3) -> float:
    """Least distance from a barrier of the box around a point, at 200 places of its way, m."""
    least = inf
    for number in range(201):
        rows = [
            (c + number / 200 * w - e, c + number / 200 * w + e, low, high)
            for c, w, e, low, high in zip(p, way, edges, barrier.lower, barrier.upper, strict=True)
        ]
        if barrier.keep_inside:
            least = min(least, *(min(a - low, high - b) for a, b, low, high in rows))
        else:
            least = min(least, hypot(*(max(low - b, a - high, 0.0) for a, b, low, high in rows)))
    return least


@pytest.mark.parametrize("inside", [False, True])
@given(p=VECTORS, edges=SIZES, way=VECTORS, upper=SIZES, room=st.floats(1e-3, 1.0))
def test_a_point_is_clear_iff_its_sampled_way_is(
    inside: bool, p: Vec3, edges: Vec3, way: Vec3, upper: Vec3, room: float
) -> None:
    lower = (-0.25, -0.5, -0.125)
    barrier = box(lower, upper, inside=inside)
    if inside:
        barrier = box((-3.0, -2.5, -2.0), (3.0 + upper[0], 3.0 + upper[1], 3.0 + upper[2]), inside=True)
    distance = sampled_distance(barrier, p, edges, way)
    between_samples = 2.0 * norm(way) / 200
    if is_clear(barrier, p, edges, way, room):
        assert distance >= room - 1e-9
    else:
        # The way is halved until its pieces are 1 mm long at most.
        assert distance < room + 1e-3 + between_samples


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_way_is_halved_down_to_a_millimetre(axis: int, sign: float) -> None:
    """Past an edge of the barrier at 45 degrees, at 0.5 m from it: the box around a piece is nearer."""
    other = (axis + 1) % 3
    p, way = [0.5] * 3, [0.0] * 3
    p[axis], p[other] = 0.5 + sign * 0.5, 1.0
    corner = (p[0], p[1], p[2])
    outward = 0.5**0.5
    for step in (axis, other):
        p[step] += (sign if step == axis else 1.0) * 0.5 * outward
    way[axis], way[other] = -sign * 0.5, 0.5
    start, whole = (p[0], p[1], p[2]), (way[0], way[1], way[2])
    back = (start[0] - way[0], start[1] - way[1], start[2] - way[2])
    double = (2.0 * way[0], 2.0 * way[1], 2.0 * way[2])
    assert dist(start, corner) == pytest.approx(0.5)
    for first, along in ((start, whole), (back, double)):
        assert is_clear(UNIT, first, NOWHERE, along, 0.499)
        assert not is_clear(UNIT, first, NOWHERE, along, 0.5001)


# Enclosures.


def test_a_ball_that_stands_is_enclosed_by_itself() -> None:
    base, arm = ball_enclosures(ARM, [line(0.5, 0.5)], (0.0,), list(ARM.balls))
    assert (base.centre, base.edges, base.radius) == (NOWHERE, NOWHERE, 0.25)
    assert arm.centre == pytest.approx((0.8775825618903728, 0.479425538604203, 0.0))  # cos, sin of 0.5
    assert arm.edges == pytest.approx(NOWHERE)
    assert arm.radius == pytest.approx(0.125)


def test_a_moving_ball_is_enclosed_along_its_chord_and_near_it() -> None:
    # About 0 rad by ±0.2: 0.2 m along y, and half of 0.2² off the tangent.
    _, arm = ball_enclosures(ARM, [line(-0.2, 0.2)], (0.0,), list(ARM.balls))
    assert arm.centre == pytest.approx((1.0, 0.0, 0.0))
    assert arm.edges == pytest.approx((0.0, 0.2, 0.0))
    assert arm.radius == pytest.approx(0.125 + 0.02)


def test_the_enclosure_of_a_ball_is_around_its_centre_exactly() -> None:
    for seed in range(10):
        chance = chance_of(seed)
        robot, line_ = body(chance), [*path(chance, 1)]
        middle = path_chord(line_).middle
        posture = ForwardKinematics(robot, middle)
        found = ball_enclosures(robot, line_, (0.0,) * 4, robot.balls)
        centres = [posture.frames[ball.joint].to_base(ball.centre) for ball in robot.balls]
        assert [one.centre for one in found] == centres


def test_a_box_around_enclosures_reaches_to_the_farthest_of_them_on_each_side() -> None:
    points = [
        Enclosure((1.0, -2.0, 0.5), (0.25, 0.5, 0.125), 0.25),
        Enclosure((3.0, -1.0, 0.25), (0.5, 2.0, 0.0625), 0.5),
        Enclosure((2.0, 0.0, 0.0), (3.0, 0.25, 0.5), 0.125),
    ]
    # x from -1 to 5, y from -3 to 1, z from -0.5 to 0.625.
    assert enclosing_box(points) == Enclosure((2.0, -1.0, 0.0625), (3.0, 2.0, 0.5625), 0.5)
    assert enclosing_box(points[:1]) == points[0]


def test_tool_and_base_at_the_end_of_a_motion() -> None:
    chance = chance_of(3)
    arm = Trajectory(body(chance), (path(chance, 3),), (0.1, 0.2, 0.3), NOWHERE, 2.0)
    drive = replace(arm, base_path=(0.5, -0.25, 0.125))
    merged = MergedMotion(RemainingMotion(arm), RemainingMotion(drive))
    assert merged.base_at_end() == pytest.approx((0.6, -0.05, 0.425))
    expected = [a + b for a, b in zip(tool(arm, 1.0), drive.base_path, strict=True)]
    assert merged.tool_at_end() == pytest.approx(expected)


def test_slack_is_added_across_the_chord() -> None:
    _, arm = ball_enclosures(ARM, [line(-0.2, 0.2)], (0.1,), list(ARM.balls))
    assert arm.radius == pytest.approx(0.125 + 0.1 + 0.3**2 / 2.0)


# A motion and its barriers.


def post(angle_x: float, angle_y: float, half: float = 0.0625) -> BarrierBox:
    """A post around a place, of great height."""
    return box((angle_x - half, angle_y - half, -1.0), (angle_x + half, angle_y + half, 1.0))


def test_a_motion_without_barriers_is_clear() -> None:
    assert find_breach(moving(pi / 2), [], 0.0) is None


def test_an_arm_that_sweeps_over_a_post_is_not_clear() -> None:
    at_45 = post(0.7071, 0.7071)
    breach = find_breach(moving(pi / 2), [at_45], 0.0)
    assert breach is not None
    assert (breach.barrier, breach.link) == ("box", "arm")
    # The first place within reach: some 0.2 rad of 1.57 before the middle.
    assert 0.3 < breach.path_parameter < 0.5
    assert find_breach(moving(0.5), [at_45], 0.0) is None
    assert find_breach(moving(-pi / 2), [at_45], 0.0) is None


def test_a_breach_is_placed_on_the_whole_path() -> None:
    pieces = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5)
    breach = find_breach(moving(*pieces), [post(0.0707, 0.9975)], 0.0)  # at 1.5 rad
    assert breach is not None
    assert 0.8 < breach.path_parameter < 0.95


def test_the_clearance_is_kept() -> None:
    # The ball at 1 m of 0.125 m passes a post from 1.25 m on: 0.125 m are left.
    ahead = box((1.25, -0.5, -1.0), (2.0, 0.5, 1.0))
    assert find_breach(moving(0.5), [ahead], 0.12) is None
    assert find_breach(moving(0.5), [ahead], 0.13) is not None


def test_slack_of_the_joints_reaches_farther() -> None:
    beside = post(0.0, 1.0)
    assert find_breach(moving(1.0), [beside], 0.0) is None
    assert find_breach(moving(1.0, slack=0.5), [beside], 0.0) is not None


def test_a_barrier_applies_to_its_links() -> None:
    at_base = box((-1.0, -1.0, -1.0), (0.0, 1.0, 1.0), links=frozenset({"arm"}))
    assert find_breach(moving(0.5), [at_base], 0.0) is None
    breach = find_breach(moving(0.5), [at_base._replace(links=None)], 0.0)
    assert breach is not None
    assert (breach.barrier, breach.link) == ("box", "base")
    assert find_breach(moving(0.5), [at_base._replace(links=frozenset({"base"}))], 0.0) is not None


def test_the_base_carries_the_arm_past_barriers_of_the_world() -> None:
    wall = box((3.0, -9.0, -1.0), (4.0, 9.0, 1.0))
    assert find_breach(moving(0.5), [wall], 0.0) is None
    assert find_breach(moving(0.5, base=(2.0, 0.0, 0.0)), [wall], 0.0) is not None
    assert find_breach(moving(0.5, way=(2.0, 0.0, 0.0)), [wall], 0.0) is not None
    assert find_breach(moving(0.5, way=(-2.0, 0.0, 0.0)), [wall], 0.0) is None
    in_base = wall._replace(is_in_base_frame=True)
    assert find_breach(moving(0.5, way=(2.0, 0.0, 0.0)), [in_base], 0.0) is None


def test_synchronous_motions_pass_where_independent_ones_may_meet() -> None:
    # The arm turns away from the wall while the base drives towards it.
    wall = box((2.5, -9.0, -1.0), (3.5, 9.0, 1.0))
    drive = (1.5, 0.0, 0.0)
    assert find_breach(moving(pi / 2, way=drive), [wall], 0.0) is None
    assert find_breach(moving(pi / 2, way=drive, synchronous=False), [wall], 0.0) is not None


def test_a_room_is_left_by_no_link() -> None:
    room = box((-2.0, -2.0, -1.0), (2.0, 1.0, 1.0), inside=True)
    assert find_breach(moving(0.8), [room], 0.0) is None
    assert find_breach(moving(pi / 2), [room], 0.0) is not None


def test_every_path_is_searched() -> None:
    one, other = moving(-pi / 2), moving(pi / 2)
    both = one._replace(paths=(*one.paths, *other.paths))
    at_45 = post(0.7071, 0.7071)
    assert find_breach(one, [at_45], 0.0) is None
    assert find_breach(both, [at_45], 0.0) is not None


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_breach_is_where_the_base_takes_its_own_ball(axis: int, sign: float) -> None:
    """The ball of 0.25 m at the base starts 2 m before a wall and drives 4 m: it meets it after 1.75 m."""
    start, way, low, high = [0.5, 0.25, 0.125], [0.0] * 3, [-9.0] * 3, [9.0] * 3
    way[axis] = sign * 4.0
    low[axis], high[axis] = sorted((start[axis] + sign * 2.0, start[axis] + sign * 3.0))
    wall = box((low[0], low[1], low[2]), (high[0], high[1], high[2]), links=frozenset({"base"}))
    drive = moving(0.5, base=(start[0], start[1], start[2]), way=(way[0], way[1], way[2]))
    breach = find_breach(drive, [wall], 0.0)
    assert breach is not None
    assert 1.75 / 4.0 - 1.0 / 16.0 <= breach.path_parameter <= 1.75 / 4.0 + 1.0 / 16.0
    short = drive._replace(base_path=(0.43 * way[0], 0.43 * way[1], 0.43 * way[2]))
    assert find_breach(short, [wall], 0.0) is None
