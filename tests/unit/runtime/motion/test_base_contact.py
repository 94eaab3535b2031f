"""Obstacles against a base that drives: distances worked out by hand, and a law about sampled positions."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.motion.base_contact import BASE, BaseTravel, enlarged_obstacle, find_base_contact
from aeros.runtime.ports import Obstacle, Vec3

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


coordinates = st.floats(-2.0, 2.0)


@given(coordinates, coordinates, coordinates, coordinates, st.floats(0.0, 1.0))
def test_no_position_on_a_clear_way_is_near(x: float, y: float, u: float, v: float, share: float) -> None:
    travel = BaseTravel(CARRIAGE, (x, y, 0.0), (u, v, 0.0))
    if find_base_contact(travel, [AHEAD], 0.015) is None:
        lower, upper = enlarged_obstacle(CARRIAGE, AHEAD, 0.014)
        at = (x + share * u, y + share * v, 0.0)
        assert not all(low <= p <= high for low, p, high in zip(lower, at, upper, strict=True))
