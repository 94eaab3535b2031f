"""A motion under feedback is compared with the speeds that its plan declares."""

from __future__ import annotations

from math import nan
from typing import Any

import pytest

from aeros.runtime.monitor.feedback_rates import FeedbackRates
from aeros.runtime.ports import Reading, RobotBody, ServoBounds, Trajectory

TICK = 1.0 / 240.0
BODY = RobotBody(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.0), ())
"""One joint with the tool half a metre from its axis."""


def rates(joint_speed: float, tool_speed: float) -> FeedbackRates:
    bounds = ServoBounds((0.01,), (joint_speed,), (9.0,), (9.0,), tool_speed, 9.0, 9.0)
    path = ((((0.0,), (0.0,), (1.0,), (1.0,)),),)
    return FeedbackRates(Trajectory(BODY, path, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0, bounds), "q")


def is_found(one: FeedbackRates, speed: float, ticks: int = 48) -> bool:
    return any(one.is_broken(tick * TICK, {"q": (speed * tick * TICK,)}) for tick in range(ticks))


@pytest.mark.parametrize(("speed", "found"), [(0.2, False), (0.29, False), (0.4, True), (-0.4, True)])
def test_a_joint_that_is_faster_than_declared_is_found(speed: float, found: bool) -> None:
    assert is_found(rates(0.2, 9.0), speed) is found


@pytest.mark.parametrize(("speed", "found"), [(0.2, False), (0.3, False), (0.5, True)])
def test_a_tool_that_is_faster_than_declared_is_found(speed: float, found: bool) -> None:
    assert is_found(rates(9.0, 0.1), speed) is found


def test_readings_count_at_their_own_times() -> None:
    one = rates(0.2, 9.0)
    assert not one.is_broken(0.0, {"q": Reading((0.0,), 0.0)})
    assert not one.is_broken(0.02, {"q": Reading((0.5,), 0.0)})  # not measured anew
    assert one.is_broken(0.03, {"q": Reading((0.5,), 0.03)})


@pytest.mark.parametrize("odd", [None, 3.0, "x", (nan,), (0.0, 0.0), (1,), ("x",), Reading(None, 0.0)])
def test_malformed_joints_are_left_to_other_checks(odd: Any) -> None:
    assert not rates(0.0, 0.0).is_broken(1.0, {"q": odd})
