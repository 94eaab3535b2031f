"""A failure that chance does not explain is known again by step, state and cause, not by measured numbers."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import pytest

from aeros.agent.execution.repeats import FinishedPlans, RepeatedFailures, is_explained_by_chance
from aeros.runtime.ports import StepStatus
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause
from aeros.spec.model.site import Site

STEP = ("m", "boil", {"force": 0.5})
STATE = {"wrapped": True, "cooked": None}
LATE = (Cause("timed_out", "m.boil", "took 61.2 s"),)


@pytest.mark.parametrize(
    ("step", "status", "causes", "state", "times"),
    [
        (STEP, StepStatus.TIMED_OUT, (Cause("timed_out", "m.boil", "took 60.8 s"),), STATE, 2),
        (("m", "wrap", STEP[2]), StepStatus.TIMED_OUT, LATE, STATE, 1),
        (("m", "boil", {"force": 0.6}), StepStatus.TIMED_OUT, LATE, STATE, 1),
        (STEP, StepStatus.STOPPED, LATE, STATE, 1),
        (STEP, None, LATE, STATE, 1),
        (STEP, StepStatus.TIMED_OUT, (Cause("rule", "force", "force <= 65 N"),), STATE, 1),
        (STEP, StepStatus.TIMED_OUT, LATE, {**STATE, "cooked": False}, 1),
    ],
)
def test_a_failure_repeats_if_step_state_and_cause_are_the_same(
    step: Any, status: StepStatus | None, causes: Any, state: Any, times: int
) -> None:
    failures = RepeatedFailures()
    assert failures.count(STEP, StepStatus.TIMED_OUT, LATE, STATE) == 1
    resumed = RepeatedFailures()
    resumed.restore(failures.to_checkpoint)
    for each in (failures, resumed):
        assert each.count(step, status, causes, state) == times


def test_a_stop_repeats_at_the_same_place_however_it_is_felt() -> None:
    failures = RepeatedFailures()
    force, torque = Cause("rule", "collision-force", ""), Cause("rule", "joint-torque-rates", "")

    def stop(cause: Cause, *joints: float) -> int:
        return failures.count(STEP, StepStatus.STOPPED, (cause,), STATE, joints)

    assert stop(force, 0.5, -1.0) == 1
    assert stop(torque, 0.66, -0.8) == 2  # 4.5 cm away, at the other side of a pot
    assert stop(force, 0.5, -0.5) == 1
    assert stop(torque, 0.52, -1.0) == 3
    resumed = RepeatedFailures()
    resumed.restore(failures.to_checkpoint)
    assert resumed.count(STEP, StepStatus.STOPPED, (force,), STATE, (0.5, -1.0)) == 4


PERSON = UnmetBound("human_distance", 0.4, "at least", 0.5, "m")


@pytest.mark.parametrize(
    ("status", "causes", "by_chance"),
    [
        (StepStatus.TIMED_OUT, (), False),
        (StepStatus.STOPPED, (Cause("stopped", "m.boil", "out of reach"),), False),
        (StepStatus.STOPPED, (Cause("rule", "tool-speed", "tool_speed <= 1.7 m/s"),), False),
        (StepStatus.STOPPED, (Cause("rule", "separation", ""),), True),
        (StepStatus.STOPPED, (Cause("stopped", "m.boil", "", shortfalls=(PERSON,)),), True),
        (StepStatus.STOPPED, (Cause("reading", "tool_speed", ""),), True),
        (StepStatus.FINISHED, (Cause("outcome", "m.boil", "outcome `dropped`"),), True),
        (StepStatus.HOLD_LOST, (), True),
        (StepStatus.CANCELLED, (), True),
    ],
)
def test_an_obstacle_is_no_chance_and_a_person_or_a_sensor_is(
    status: StepStatus, causes: tuple[Cause, ...], cell: Site, *, by_chance: bool
) -> None:
    assert is_explained_by_chance(status, causes, cell) is by_chance


def test_a_plan_that_surely_leaves_the_same_state_is_useless_the_third_time() -> None:
    plans = FinishedPlans()
    assert [plans.is_useless("a", {"there": False}) for _ in range(2)] == [False, False]
    assert not plans.is_useless("b", {"there": False})
    assert plans.is_useless("a", {"there": False})
    plans.forget()
    assert [plans.is_useless("a", {"there": False}) for _ in range(2)] == [False, False]
    assert not plans.is_useless("a", {"there": True})
    assert not plans.is_useless("a", {"there": False})


@pytest.mark.parametrize(("percent", "times"), [(1, 3), (5, 6), (30, 21)])
def test_a_plan_that_may_leave_another_state_is_useless_when_chance_does_not_explain_it(
    percent: int, times: int
) -> None:
    plans = FinishedPlans()
    for number in range(1, times + 1):
        plans.begin()
        plans.note_success(Fraction(percent, 100))
        plans.note_success(Fraction(1))
        assert plans.is_useless("a", {"there": False}) is (number == times)
