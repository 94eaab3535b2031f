"""Failures of plans: of attempts, of compositions as attempts, and of conditions that decide nothing."""

from __future__ import annotations

import pytest

from aeros.agent.execution.attempt import AttemptResult
from aeros.agent.plan_failure import (
    PlanFailure,
    failure_of_attempt,
    result_of_composition,
    undecided_failure,
)
from aeros.agent.planning.task_graph import PlanStep

STEP = PlanStep("kitchen", "dough")


@pytest.mark.parametrize("is_stop", [False, True])
@pytest.mark.parametrize("is_declared", [False, True])
def test_a_composition_fails_as_its_plan_does(is_declared: bool, is_stop: bool) -> None:
    failure = PlanFailure("why", is_declared=is_declared, is_stop=is_stop)
    attempt = result_of_composition(failure)
    assert (attempt.failed, attempt.is_retryable, attempt.is_stop) == (True, is_declared, is_stop)
    again = failure_of_attempt(STEP, attempt, set())
    assert (again.reason, again.is_declared, again.is_stop) == ("why", is_declared, is_stop)
    assert not result_of_composition(None).failed


def test_a_step_that_was_not_started_for_a_stop_says_so() -> None:
    attempt = AttemptResult(failed=True, reason="cancelled: late", is_stop=True)
    failure = failure_of_attempt(STEP, attempt, set())
    assert failure == PlanFailure("`kitchen.dough` failed: cancelled: late")
    assert failure.is_stop


def test_a_condition_without_a_branch_is_no_declared_failure() -> None:
    failure = undecided_failure("wrapped", "it is not measured", ())
    assert not failure.is_declared
    assert failure.reason.endswith("if `wrapped` is not met: it is not measured")
