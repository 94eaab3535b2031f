"""Obstacles against a base that drives: distances worked out by hand, and a law about sampled positions."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.motion.base_contact import BASE, BaseTravel, box_corners, find_base_contact
from aeros.runtime.motion.swept_volume import BarrierBreach
from aeros.runtime.ports import Obstacle, Vec3
from aeros.spec.expr.scope import AxisAlignedBox

CARRIAGE = ((-0.25, -0.2, -0.3), (0.25, 0.2, -0.02))
START = (0.0, 0.0, 0.0)


def thing(name: str, lower: Vec3, upper: Vec3) -> Obstacle:
    return Obstacle(name, lower, upper, 1.0, "aisle_top", "aisle_floor")


def along(*path: float) -> BaseTravel:
    x, y = path
    return BaseTravel(CARRIAGE, START, (x, y, 0.0))


AHEAD = thing("ahead", (-0.1, 1.2, -0.3), (0.1, 1.4, -0.15))


def test_the_first_thing_on_the_way_is_found_where_the_base_comes_near() -> None:
    beyond = thing("beyond", (-0.1, 1.8, -0.3), (0.1, 2.0, -0.15))
    breach = find_base_contact(along(0.0, 4.0), [beyond, AHEAD], 0.0)
    assert breach is not None
    assert (breach.barrier, breach.link) == ("ahead", BASE)
    # The front of the carriage is 0.2 m ahead of its origin: it meets the thing after 1.0 m of 4.0 m.
    assert abs(breach.path_parameter - 0.25) < 1e-12


def test_a_way_that_ends_before_it_or_leads_past_it_is_clear() -> None:
    assert find_base_contact(along(0.0, 0.98), [AHEAD], 0.015) is None
    assert find_base_contact(along(0.0, 0.99), [AHEAD], 0.015) is not None
    aside = BaseTravel(CARRIAGE, (-0.37, 0.0, 0.0), (0.0, 4.0, 0.0))
    assert find_base_contact(aside, [AHEAD], 0.015) is None
    assert find_base_contact(aside, [AHEAD], 0.025) is not None


def test_things_over_the_base_are_passed_under() -> None:
    over = thing("over", (-0.1, 1.2, 0.01), (0.1, 1.4, 0.2))
    assert find_base_contact(along(0.0, 4.0), [over], 0.015) is None


def test_a_travel_at_its_end_is_near_things_there_alone() -> None:
    assert find_base_contact(along(0.0, 4.0).at_end(), [AHEAD], 0.015) is None
    assert find_base_contact(along(0.0, 1.3).at_end(), [AHEAD], 0.015) is not None


COORDINATES = st.floats(-2.0, 2.0)
VECTORS = st.tuples(COORDINATES, COORDINATES, COORDINATES)
PATHS = st.tuples(*[st.just(0.0) | COORDINATES] * 3)
SIZES = st.tuples(*[st.floats(0.01, 1.0)] * 3)


def boxed(lower: Vec3, size: Vec3) -> tuple[Vec3, Vec3]:
    return lower, (lower[0] + size[0], lower[1] + size[1], lower[2] + size[2])


def gap(travel: BaseTravel, obstacle: Obstacle, share: float) -> float:
    """Distance of the base from an obstacle at a share of its way, along the axis where it is greatest, m."""
    own_lower, own_upper = travel.box
    gaps = [
        max(obstacle.lower[axis] - at - own_upper[axis], at + own_lower[axis] - obstacle.upper[axis])
        for axis in range(3)
        for at in [travel.start[axis] + share * travel.path[axis]]
    ]
    return max(gaps)


@given(VECTORS, PATHS, VECTORS, SIZES, VECTORS, SIZES, st.floats(0.0, 0.5))
def test_the_contact_is_the_first_place_of_the_way_where_the_base_is_near(
    start: Vec3, path: Vec3, lower: Vec3, size: Vec3, corner: Vec3, extent: Vec3, clearance: float
) -> None:
    travel = BaseTravel(boxed(lower, size), start, path)
    obstacle = thing("crate", *boxed(corner, extent))
    breach = find_base_contact(travel, [obstacle], clearance)
    end = 1.0 if breach is None else breach.path_parameter
    if breach is not None:
        assert gap(travel, obstacle, end) <= clearance + 1e-9
    before = [number / 100 for number in range(101) if breach is None or number / 100 < end]
    assert all(gap(travel, obstacle, share) > clearance - 1e-9 for share in before)


@pytest.mark.parametrize("axis", range(3))
def test_a_base_that_comes_within_exactly_the_clearance_is_near(axis: int) -> None:
    def at(distance: float) -> Vec3:
        found = [0.0, 0.0, 0.0]
        found[axis] = distance
        return (found[0], found[1], found[2])

    unit = ((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    crate = thing("crate", *unit)
    for sign in (-1.0, 1.0):
        resting = BaseTravel(unit, at(sign * 1.25), START)
        assert find_base_contact(resting, [crate], 0.25) is not None
        assert find_base_contact(resting, [crate], 0.2499) is None
        arriving = BaseTravel(unit, at(sign * 2.25), at(-sign))
        assert find_base_contact(arriving, [crate], 0.25) == BarrierBreach("crate", BASE, 1.0)
        assert find_base_contact(arriving, [crate], 0.2499) is None


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_base_that_has_left_along_one_axis_before_it_arrives_along_another_is_clear(sign: float) -> None:
    unit = ((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    crate = thing("crate", *unit)
    for size, reach in ((4.0, 0.75), (0.5, 0.1)):
        # Near along x on the first part of the way, along y from `late` on.
        for late, is_met in ((reach - 0.05, True), (reach + 0.05, False)):
            start = (sign * (1.0 - size * reach), -1.0 - size * late, 0.0)
            travel = BaseTravel(unit, start, (sign * size, size, 0.0))
            assert (find_base_contact(travel, [crate], 0.0) is not None) is is_met


def test_the_corners_of_a_declared_box() -> None:
    box = AxisAlignedBox(
        (Fraction(-1), Fraction(1, 4), Fraction(0)), (Fraction(1), Fraction(1, 2), Fraction(2))
    )
    assert box_corners(box) == ((-1.0, 0.25, 0.0), (1.0, 0.5, 2.0))
