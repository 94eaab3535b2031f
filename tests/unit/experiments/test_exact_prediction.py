"""Exact predictions: of the baselines by theory, and of any loop as the shipped prediction has it."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.agent.planning.task_graph import Step
from aeros.experiments.architecture import Architecture, Means, Told, made
from aeros.experiments.exact_prediction import predicted
from aeros.spec.closed_loop.transition_system import NotExploredError
from tests.unit.experiments.common import FAILURES, model
from tests.unit.experiments.entered import Dicey, Endless, Raising, Stubborn

TASKS = sorted(FAILURES)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize(("name", "tries"), [("flat", 1), ("behaviour_tree", 3), ("progprompt", 3)])
def test_so_many_attempts_at_a_rate_of_failure_succeed_with_1_less_its_power(
    task: str, name: str, tries: int
) -> None:
    rate = Fraction(FAILURES[task][2])
    assert predicted(lambda: made(name, {}), model(task=task)).success == 1 - rate**tries


def test_expected_counts_are_of_runs_that_reach_the_goal_or_not() -> None:
    # prepare, recover, wrap, and with 7 in 10 boil
    assert predicted(lambda: made("flat", {}), model()).invocations == Fraction(37, 10)


class Loop:
    """The agent's loop as the paper has it, on the means that all are given; `replans` more plans at most."""

    def __init__(self, replans: int, *, recovery: bool) -> None:
        self._left = replans
        self._recovery = recovery
        self._told = Told()

    def pursue(self, means: Means) -> Told:
        while not means.is_reached():
            for step in means.plan():
                if means.is_reached() or not self._done(means, step):
                    break
            if means.is_reached() or not self._left:
                break
            self._left -= 1
            self._told = replace(self._told, replans=self._told.replans + 1)
        return self._told

    def _done(self, means: Means, step: Step) -> bool:
        assert step.unless is not None
        for attempt in range(step.retry + 1):
            if means.world().evaluate(step.unless) is True:
                return True
            if attempt and self._recovery and step.on_failure is not None:
                self._told = replace(self._told, recoveries=self._told.recoveries + 1)
                means.run(Step(step.module, step.on_failure))
                if means.world().evaluate(step.unless) is True:
                    return True
            self._told = replace(self._told, retries=self._told.retries + (attempt > 0))
            if not means.run(step).failed:
                return True
        return False


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("recovery", [False, True])
@pytest.mark.parametrize("replans", [0, 3])
def test_the_loop_run_against_all_outcomes_comes_to_what_the_shipped_prediction_says(
    task: str, recovery: bool, replans: int
) -> None:
    shipped = predicted(lambda: made("aeros", {"recovery": recovery, "replans": replans}), model(task=task))
    assert predicted(lambda: Loop(replans, recovery=recovery), model(task=task)) == shipped


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (Dicey, "does not do the same"),
        (Endless, "it does not end"),
        (Raising, "ZeroDivisionError: mine"),
        (lambda: Driving(), "drives the runtime itself"),
        (lambda: Seeded(), "chooses by its seed"),
    ],
)
def test_where_nothing_can_be_predicted_it_says_why(make: type[Architecture], why: str) -> None:
    with pytest.raises(NotExploredError, match=why):
        predicted(make, model())


class Driving:
    def pursue(self, means: Means) -> Told:
        means.runtime.now()
        return Told()


class Seeded:
    def pursue(self, means: Means) -> Told:
        for step in means.plan() * (1 + means.seed % 2):
            means.run(step)
        return Told()


def test_of_anybodys_class_there_is_a_prediction() -> None:
    found = predicted(Stubborn, model(task="clean_table"))
    # of 12 skills two are needed besides those that wipe
    assert found.success == 1 - Fraction(2, 5) ** 10
