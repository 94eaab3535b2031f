"""Where on its path a held object may be in a surface's volume."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nextafter

import pytest

from aeros.runtime.motion.kinematic_bounds import piece_speeds
from aeros.runtime.motion.surface_contact import SurfaceLimits, find_surface_breach
from aeros.runtime.motion.swept_volume import BarrierBox, MergedMotion, RemainingMotion
from aeros.runtime.ports import Hull, ServoBounds, Trajectory
from tests.unit.runtime.motion.test_trajectory import motion, turn

HELD = Hull("held", 1, ((0.5, 0.0, 0.5),), 0.1)
"""A ball of 0.1 m around the tool of the arm that turns, half a metre from its axis."""
SHELF = BarrierBox("shelf", (0.0, 0.5, 0.0), (1.0, 2.0, 1.0), False, False, frozenset({"held"}))


def breach(
    plan: Trajectory, limits: SurfaceLimits, base_path: float = 0.0
) -> tuple[float, float, float] | None:
    plan = replace(plan, base_path=(0.0, base_path, 0.0))
    part = RemainingMotion(plan)
    return find_surface_breach(plan, MergedMotion(part, part).swept_motion(HELD), [SHELF], 0.0, limits)


def test_a_motion_that_stays_clear_may_be_fast() -> None:
    assert breach(turn(0.0, 0.5, 0.1), SurfaceLimits(0.0, 0.0)) is None


@pytest.mark.parametrize(
    ("distance", "speed", "is_allowed"), [(0.1, 0.2, True), (0.02, 0.2, False), (0.1, 0.05, False)]
)
def test_a_motion_to_a_target_inside_is_slow_and_near_it(
    distance: float, speed: float, is_allowed: bool
) -> None:
    """The ball enters at sin θ = 0.8, θ = 0.927; the target at θ = 1 is 36 mm farther."""
    found = breach(turn(0.0, 1.0, 3.0), SurfaceLimits(distance, speed))
    assert (found is None) is is_allowed
    if found is not None:
        assert 0.85 < found[0] < 1.0
        assert found[1] >= 0.02 or found[2] >= 0.05


def test_a_motion_that_leaves_is_bounded_by_the_way_alone() -> None:
    assert breach(turn(1.0, 0.0, 3.0), SurfaceLimits(0.1, 0.0)) is None
    assert breach(turn(1.0, 0.0, 3.0), SurfaceLimits(0.02, 0.0)) is not None


def test_a_motion_through_a_volume_is_none_to_or_from_it() -> None:
    """It passes the shelf with start and target outside."""
    assert breach(turn(0.6, 2.6, 9.0), SurfaceLimits(0.3, 0.2)) is not None


def test_a_motion_that_is_inside_all_the_way_is_near_its_target_from_the_start() -> None:
    """Its tool goes 0.3 m along an arc of 0.6 rad."""
    assert breach(turn(1.0, 1.6, 9.0), SurfaceLimits(0.35, 1.0)) is None
    found = breach(turn(1.0, 1.6, 9.0), SurfaceLimits(0.25, 1.0))
    assert found is not None
    assert found[0] == 0.5 / 16


def test_the_way_of_the_base_counts() -> None:
    assert breach(turn(0.0, 0.5, 4.0), SurfaceLimits(0.05, 0.01), 0.05) is None
    assert breach(turn(0.0, 0.5, 4.0), SurfaceLimits(0.05, 0.01), 0.3) is not None


def test_under_feedback_the_tool_is_slow_all_the_way() -> None:
    servo = ServoBounds((0.0,), (1.0,), (1.0,), (1.0,), 0.1, 1.0, 1.0)
    pressing = motion(1.0, 4.0, servo=servo)
    assert breach(pressing, SurfaceLimits(0.0, 0.1)) is None
    assert breach(pressing, SurfaceLimits(0.0, 0.09)) == (0.0, inf, 0.1)


def test_a_motion_under_feedback_may_be_exactly_as_fast_as_allowed() -> None:
    for speed, is_allowed in ((0.125, True), (0.126, False)):
        servo = ServoBounds((0.0,), (0.5,), (2.0,), (50.0,), speed, 1.0, 10.0)
        found = breach(replace(turn(0.9, 1.0, 4.0), servo=servo), SurfaceLimits(0.0, 0.125))
        assert (found is None) is is_allowed
        if found is not None:
            assert found == (0.0, inf, 0.126)


def test_a_base_that_drives_a_little_takes_the_held_object_no_farther() -> None:
    assert breach(turn(0.0, 1.0, 3.0), SurfaceLimits(0.1, 0.2), 0.01) is None


def test_a_motion_may_be_exactly_as_fast_as_allowed_where_it_enters() -> None:
    plan = turn(0.0, 1.0, 3.0)
    speeds = piece_speeds(plan.body, plan.joint_paths[0], plan.duration)
    least = min(speed for speed in speeds if breach(plan, SurfaceLimits(0.1, speed)) is None)
    found = breach(plan, SurfaceLimits(0.1, nextafter(least, 0.0)))
    assert found is not None
    assert found[2] == least
    assert found[0] == (speeds.index(least) + 0.5) / 16


def test_a_surface_is_touched_by_the_tool_of_a_longer_chain_as_by_that_of_one_joint() -> None:
    """A first joint that stands makes no difference."""
    for distance in (0.1, 0.02):
        plan = turn(0.0, 1.0, 3.0)
        (path,) = plan.joint_paths
        pieces = tuple(tuple((0.0, *q) for q in piece) for piece in path)
        balls = tuple(ball._replace(joint=2) for ball in plan.body.balls)
        longer = replace(
            plan,
            body=replace(plan.body, dh_rows=plan.body.dh_rows * 2, balls=balls),
            joint_paths=(pieces,),  # type: ignore[arg-type]
        )
        part, limits = RemainingMotion(longer), SurfaceLimits(distance, 0.2)
        swept = MergedMotion(part, part).swept_motion(HELD._replace(joint=2))
        found = find_surface_breach(longer, swept, [SHELF], 0.0, limits)
        expected = breach(plan, limits)
        assert (found is None) is (expected is None)
        if found is not None:
            assert found == pytest.approx(expected)


def test_the_body_itself_is_not_what_is_held() -> None:
    """The arm's own ball enters the shelf, for which all links count; a small thing at its axis does not."""
    plan = turn(0.0, 1.0, 3.0)
    part = RemainingMotion(plan)
    held = Hull("held", 1, ((0.1, 0.0, 0.5),), 0.01)
    shelf = SHELF._replace(lower=(0.0, 0.3, 0.0), links=None)
    moving = MergedMotion(part, part).swept_motion(held)
    assert find_surface_breach(plan, moving, [shelf], 0.0, SurfaceLimits(0.0, 0.0)) is None


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_base_takes_what_is_held_into_a_volume_at_its_share_of_the_way(axis: int, sign: float) -> None:
    """The ball of 0.1 m drives 1 m, towards a volume that is 0.75 m from its centre: it enters after 0.65."""
    way, lower, upper = [0.0] * 3, [-9.0] * 3, [9.0] * 3
    way[axis] = sign
    middle = (0.5, 0.0, 0.5)[axis]
    lower[axis], upper[axis] = sorted((middle + sign * 0.75, middle + sign * 2.0))
    plan = replace(turn(0.0, 0.0, 4.0), base_path=(way[0], way[1], way[2]))
    box = BarrierBox(
        "shelf", (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2]), False, False, None
    )
    part = RemainingMotion(plan)
    moving = MergedMotion(part, part).swept_motion(HELD)
    found = find_surface_breach(plan, moving, [box], 0.0, SurfaceLimits(1.0, -1.0))
    assert found is not None
    assert found.path_parameter == (int(0.65 * 16) + 0.5) / 16


def test_a_target_may_be_exactly_as_far_away_as_allowed() -> None:
    plan = turn(0.0, 1.0, 3.0)
    first = breach(plan, SurfaceLimits(0.0, 1.0))
    assert first is not None
    second = breach(plan, SurfaceLimits(first[1], 1.0))
    assert second is None or second[0] > first[0]
    assert breach(plan, SurfaceLimits(nextafter(first[1], 0.0), 1.0)) == first
