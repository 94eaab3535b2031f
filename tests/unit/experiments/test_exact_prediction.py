"""Exact predictions: of the baselines by theory, and of any loop as the shipped prediction has it."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.planning.task_graph import PlanStep
from aeros.experiments.architecture import (
    Architecture,
    ArchitectureReport,
    Budget,
    TrialContext,
    TrialModel,
    build_architecture,
)
from aeros.experiments.exact_prediction import predict
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import Prediction
from tests.unit.experiments.support.common import FAILURES, model
from tests.unit.experiments.support.entered import Dicey, Endless, Raising, Stubborn

TASKS = sorted(FAILURES)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize(("name", "tries"), [("flat", 1), ("behaviour_tree", 3), ("progprompt", 3)])
def test_so_many_attempts_at_a_rate_of_failure_succeed_with_1_less_its_power(
    task: str, name: str, tries: int
) -> None:
    rate = Fraction(FAILURES[task][2])
    assert predict(lambda: build_architecture(name, {}), model(task=task)).success == 1 - rate**tries


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("tries", [1, 3, 7])
def test_at_equal_budgets_all_that_go_on_succeed_as_often(task: str, tries: int) -> None:
    rate, skill = Fraction(FAILURES[task][2]), FAILURES[task][0]
    patient = {
        "behaviour_tree": {"max_tries": 9},
        "progprompt": {"max_plans": 9},
        "expert_tree": {"max_tries": 9},
    }
    for name, options in patient.items():
        found = predict(
            lambda name=name, options=options: build_architecture(name, options),  # type: ignore[misc]
            model(task=task),
            Budget(tries=tries),
            skill,
        )
        assert found.success == 1 - rate**tries, name


def test_of_a_budget_of_time_nothing_is_predicted() -> None:
    with pytest.raises(StateSpaceError, match="budget"):
        predict(lambda: build_architecture("flat", {}), model(), Budget(seconds=3.0), "wrap")


def test_the_agent_predicts_budgets_of_tries_itself() -> None:
    found = predict(lambda: build_architecture("aeros", {}), model(), Budget(tries=3), "wrap")
    assert found.success == 1 - Fraction(3, 10) ** 3


class WithoutBudgets:
    """An architecture that predicts only trials without a budget."""

    def pursue(self, context: TrialContext) -> ArchitectureReport:
        raise AssertionError

    def predict(self, model: TrialModel) -> Prediction:
        raise AssertionError


def test_of_a_budget_that_the_architecture_does_not_know_nothing_is_predicted() -> None:
    with pytest.raises(StateSpaceError, match="knows no budget of tries"):
        predict(WithoutBudgets, model(), Budget(tries=3), "wrap")


def test_expected_counts_are_of_runs_that_reach_the_goal_or_not() -> None:
    # prepare, recover, wrap, and with 7 in 10 boil
    assert predict(lambda: build_architecture("flat", {}), model()).invocations == Fraction(37, 10)


class Loop:
    """The agent's loop as the paper has it, on the means that all are given; `replans` more plans at most."""

    def __init__(self, replans: int, *, recovery: bool) -> None:
        self._left = replans
        self._recovery = recovery
        self._report = ArchitectureReport()

    def pursue(self, means: TrialContext) -> ArchitectureReport:
        while not means.is_goal_reached():
            for step in means.plan():
                if means.is_goal_reached() or not self._done(means, step):
                    break
            if means.is_goal_reached() or not self._left:
                break
            self._left -= 1
            self._report = replace(self._report, replans=self._report.replans + 1)
        return self._report

    def _done(self, means: TrialContext, step: PlanStep) -> bool:
        assert step.unless is not None
        for attempt in range(step.retry + 1):
            if means.world().evaluate(step.unless) is True:
                return True
            if attempt and self._recovery and step.between_tries is not None:
                self._report = replace(self._report, recoveries=self._report.recoveries + 1)
                means.run(step.between_tries)
                if means.world().evaluate(step.unless) is True:
                    return True
            self._report = replace(self._report, retries=self._report.retries + (attempt > 0))
            if not means.run(step).failed:
                return True
        if means.world().evaluate(step.unless) is True:
            return True
        if self._recovery and step.on_failure is not None and not means.is_goal_reached():
            self._report = replace(self._report, recoveries=self._report.recoveries + 1)
            means.run(step.on_failure)
        return False


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("recovery", [False, True])
@pytest.mark.parametrize("replans", [0, 3])
def test_the_loop_run_against_all_outcomes_comes_to_what_the_shipped_prediction_says(
    task: str, recovery: bool, replans: int
) -> None:
    shipped = predict(
        lambda: build_architecture("aeros", {"recovery": recovery, "replans": replans}), model(task=task)
    )
    assert predict(lambda: Loop(replans, recovery=recovery), model(task=task)) == shipped


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (Dicey, "is not deterministic"),
        (Endless, "calls without finishing"),
        (Raising, "ZeroDivisionError: mine"),
        (lambda: Driving(), "drives the runtime and has no"),
        (lambda: Seeded(), "uses its seed and has no"),
    ],
)
def test_where_nothing_can_be_predicted_it_says_why(make: type[Architecture], why: str) -> None:
    with pytest.raises(StateSpaceError, match=why):
        predict(make, model())


class Driving:
    def pursue(self, means: TrialContext) -> ArchitectureReport:
        means.runtime.now()
        return ArchitectureReport()


class Seeded:
    def pursue(self, means: TrialContext) -> ArchitectureReport:
        for step in means.plan() * (1 + means.seed % 2):
            means.run(step)
        return ArchitectureReport()


def test_of_anybodys_class_there_is_a_prediction() -> None:
    found = predict(Stubborn, model(task="clean_table"))
    # of 12 skills two are needed besides those that wipe
    assert found.success == 1 - Fraction(2, 5) ** 10
