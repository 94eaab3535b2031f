"""A carried body goes up, over and down, and turns on the way."""

from __future__ import annotations

from math import pi, sqrt

import pytest

from aeros.sim.engine.carried_way import CarriedWay
from aeros.sim.geometry import UPRIGHT, Pose

START = Pose((0.1, 0.2, 0.3), UPRIGHT)
GOAL = (0.5, -0.2, 0.1)


def way(lift: float = 0.25, turn: float = pi / 2.0) -> CarriedWay:
    return CarriedWay(START, GOAL, turn, (0.0, 0.0, 1.0), lift)


@pytest.mark.parametrize(
    ("share", "place"),
    [
        (0.0, START.position),
        (0.25, (0.1, 0.2, 0.55)),
        (0.7, (0.5, -0.2, 0.55)),
        (0.95, GOAL),
        (1.0, GOAL),
    ],
)
def test_it_goes_up_over_and_down(share: float, place: tuple[float, float, float]) -> None:
    assert way().position(share) == pytest.approx(place)


def test_without_a_lift_it_does_not_rise_above_its_ends() -> None:
    heights = [way(lift=0.0).position(share / 100.0)[2] for share in range(101)]
    assert max(heights) == pytest.approx(0.3)
    assert heights == sorted(heights, reverse=True)


def test_it_is_turned_while_it_goes_over() -> None:
    assert way().orientation(0.2) == pytest.approx(UPRIGHT)
    assert way().orientation(0.8) == pytest.approx((0.0, 0.0, sqrt(0.5), sqrt(0.5)))
