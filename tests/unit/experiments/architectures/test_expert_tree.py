"""Experts' trees: recovery, new starts, leaves that run, and guards that interrupt; both libraries alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf

import pytest

pytest.importorskip("py_trees", reason="needs `pip install '.[experiments]'`")
pytest.importorskip("behaviortreepy", reason="needs `pip install '.[experiments]'`")

from aeros.agent.planning.routing import RoutedTask
from aeros.experiments.architecture import (
    Architecture,
    ArchitectureReport,
    BudgetSpentError,
    build_architecture,
)
from aeros.experiments.exact_prediction import predict
from aeros.runtime.ports import EndedStep, StepHandle, StepRequest, StepResult
from tests.unit.agent.dumplings import DUMPLING, rule
from tests.unit.agent.fake_runtime import Ending, FakeRuntime
from tests.unit.experiments.support.common import FAILURES, model
from tests.unit.experiments.support.dumpling_trials import Trial

NAMES = ("expert_tree", "behaviortree_cpp")


def tree(name: str, **options: int) -> Architecture:
    return build_architecture(name, options)


class Slow(FakeRuntime):
    """Each skill takes two seconds; the wrapper may be seen to be aligned while it is being aligned."""

    def __init__(
        self, endings: Mapping[str, Sequence[Ending]] | None = None, until_aligned: float = inf
    ) -> None:
        super().__init__(endings={name: list(listed) for name, listed in (endings or {}).items()})
        self._until_aligned = until_aligned
        self._began = 0.0

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        self._began = self.clock
        return super().start(request)

    def wait(self, until: float = inf) -> EndedStep | None:
        aligning = any(one.skill == "recover" for one in self.under_way.values())
        if aligning and self.clock >= self._began + self._until_aligned:
            self.state["wrapper_aligned"] = True
        if not self.cancelled and until < self._began + 2.0:
            self.clock = until
            return None
        return super().wait()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("endings", "report", "submitted"),
    [
        ({}, ArchitectureReport(), ["prepare", "recover", "wrap", "boil"]),
        (
            {"wrap": ["misaligned"]},
            ArchitectureReport(retries=1, recoveries=1),
            ["prepare", "recover", "wrap", "recover", "wrap", "boil"],
        ),
        (
            {"boil": ["nothing_changed"] * 3},
            ArchitectureReport(retries=3, replans=1),
            ["prepare", "recover", "wrap", *["boil"] * 4],
        ),
        (
            {"boil": ["nothing_changed"] * 9},
            ArchitectureReport(retries=5, replans=1, reason="boil: outcome `nothing_changed`"),
            ["prepare", "recover", "wrap", *["boil"] * 6],
        ),
    ],
)
def test_failures_are_helped_tried_again_and_started_again(
    name: str, endings: dict[str, Sequence[Ending]], report: ArchitectureReport, submitted: list[str]
) -> None:
    trial = Trial(runtime=Slow(endings))
    assert tree(name, max_tries=3, max_starts=2).pursue(trial.context) == report
    assert trial.runtime.submitted == submitted


@pytest.mark.parametrize("name", NAMES)
def test_a_recovery_after_all_attempts_runs_once_and_before_a_new_start(name: str) -> None:
    task = DUMPLING.tasks["make_dumplings"]
    task = replace(task, rules=(*task.rules[:-1], rule("dumpling_cooked", "boil", on_failure="prepare")))
    trial = Trial(runtime=Slow({"boil": ["nothing_changed"] * 4}))
    trial.context._routed = RoutedTask("dumpling", task)
    assert tree(name, max_tries=3, max_starts=2).pursue(trial.context) == ArchitectureReport(
        retries=4, recoveries=1, replans=1
    )
    assert trial.runtime.submitted == ["prepare", "recover", "wrap", *["boil"] * 3, "prepare", *["boil"] * 2]


@pytest.mark.parametrize("name", NAMES)
def test_a_leaf_runs_over_ticks_and_a_guard_that_holds_halts_it(name: str) -> None:
    runtime = Slow()
    trial = Trial(runtime=runtime)
    assert tree(name).pursue(trial.context) == ArchitectureReport()
    assert runtime.cancelled == {}
    runtime = Slow(until_aligned=1.0)
    trial = Trial(runtime=runtime)
    assert tree(name).pursue(trial.context) == ArchitectureReport()
    assert list(runtime.cancelled.values()) == ["the architecture halts it"]
    assert runtime.submitted == ["prepare", "wrap", "boil"]  # what was halted has not ended


@pytest.mark.parametrize("name", NAMES)
def test_a_spent_budget_ends_the_tree(name: str) -> None:
    class Spent(FakeRuntime):
        def start(self, request: StepRequest) -> StepHandle | StepResult:
            raise BudgetSpentError

    with pytest.raises(BudgetSpentError):
        tree(name).pursue(Trial(runtime=Spent()).context)


@pytest.mark.parametrize("task", sorted(FAILURES))
def test_both_libraries_are_predicted_alike(task: str) -> None:
    first, second = (predict(lambda name=name: tree(name, max_starts=2), model(task=task)) for name in NAMES)  # type: ignore[misc]
    assert first == second
    assert first.success > 1 - (1 / 2) ** 3
