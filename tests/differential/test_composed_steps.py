"""Steps over several modules and by compositions: exact predictions against runs of the agent's own loop."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import sqrt
from pathlib import Path
from random import Random
from typing import Any

import pytest

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.report import RunReport
from aeros.agent.execution.step_attempt import StepRunner
from aeros.agent.memory.store import open_memory
from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.task_loop import TaskLoop
from aeros.runtime.ports import StepHandle, StepRequest, StepResult
from aeros.spec.closed_loop.giving_up import declared_beliefs
from aeros.spec.closed_loop.markov_chain import Prediction, predict
from aeros.spec.closed_loop.reachability import explore_task
from aeros.spec.closed_loop.success_bounds import bound_success
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from tests.differential.planning.test_giving_up import with_all_failures
from tests.differential.real_loop import Forgetful
from tests.unit.agent.fake_runtime import FakeRuntime
from tests.unit.agent.memory.test_store import WHO


class Counting(Forgetful):
    """A memory without records, in which each episode has another number, so that draws are independent."""

    def __init__(self) -> None:
        self._asked = 0

    def latest_episode(self) -> int:
        self._asked += 1
        return self._asked


CORPUS = Path(__file__).parents[1] / "corpus"
CASES = (
    "steps_of_a_required_module/asker",
    "capability_that_two_modules_provide/asker",
    "capability_by_a_sequence_or_a_composition",
    "step_by_a_composition",
    "alternatives_and_tries",
    "held_and_timed_parts",
)
START = {"fetched": "brush", "table_tidy": False}


@cache
def case(name: str) -> tuple[Site, Ecm, dict[str, Ecm]]:
    """The site, the module of the task, and all modules."""
    sink = Diagnostics()
    site = load_site(CORPUS / "site" / "table.yaml", sink)
    assert site is not None
    folder = CORPUS / "accepted" / name
    others = folder.parent.iterdir() if "/" in name else [folder]
    loaded = [load_ecm(one, site, sink) for one in others if (one / "ecm.yaml").is_file()]
    found = {one.ecm.id: one.ecm for one in loaded if one is not None}
    assert not sink.has_errors
    return site, found[folder.name], found


def run(name: str, seed: int) -> tuple[RunReport, FakeRuntime]:
    site, ecm, modules = case(name)
    drawn = Random(seed)  # noqa: S311  outcomes of a test
    runtime = FakeRuntime(modules, chance=lambda _, outcomes: drawn.choice(outcomes), at=site)
    runtime.state = dict(START)
    memory, (task,) = Counting(), ecm.tasks.values()
    journal = Journal(runtime, memory, None)
    routed = RoutedTask(ecm.id, task)
    loop = TaskLoop(runtime, RulePlanner(), StepRunner(runtime, memory, journal, "t", seed), journal, routed)
    return loop.run("tidy"), runtime


def test_a_composition_learns_from_its_steps_wherever_they_start(tmp_path: Path) -> None:
    site, ecm, modules = case("capability_by_a_sequence_or_a_composition")
    (task,) = ecm.tasks.values()
    counted = []
    with open_memory(tmp_path / "memory.sqlite3", WHO, "symbolic") as memory:
        for seed in range(3):
            runtime = FakeRuntime(modules, at=site)  # every step succeeds
            runtime.state = dict(START)
            journal = Journal(runtime, memory, None)
            steps = StepRunner(runtime, memory, journal, f"{ecm.id}.{task.id}", seed)
            assert TaskLoop(runtime, RulePlanner(), steps, journal, RoutedTask(ecm.id, task)).run("t").reached
            (choice,) = (details for kind, details in runtime.notes if kind == "provider-selected")
            counted.append([option["record"]["successes"] for option in choice["options"]])
    # `tidy` starts with the sponge, and both alternatives are chosen without it.
    assert counted == [[0, 0], [1, 1], [2, 2]]


class Hurried(FakeRuntime):
    """Of the steps under way, the one of a skill ends first as often as it is asked for."""

    def hurry(self, skill: str, share: float, drawn: Random) -> None:
        self._hurried = (skill, share, drawn)
        self.chance = lambda _, outcomes: drawn.choice(outcomes)

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        skill, share, drawn = self._hurried
        self.last = [one for one in ("sweep", "fetch") if (one == skill) is not (drawn.random() < share)]
        return super().start(request)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("replans", [0, 2, 5])
def test_whichever_branch_ends_first_success_is_within_its_bounds(share: float, replans: int) -> None:
    """Also if the agent expects few of the failures, so that it gives some of them up."""
    site, declared, _ = case("branches_that_may_fail")
    (task,) = declared.tasks.values()
    ecm = with_all_failures(declared, Fraction(1, 100)) if replans == 5 else declared
    modules = {ecm.id: ecm}
    site = replace(site, limits=replace(site.limits, replans=replans))
    system = TransitionSystem(declared, task, site, declared_beliefs(ecm))
    soonest, never = system.giving_up_soonest(), system.never_giving_up()
    at_least = bound_success(soonest, soonest.start(START), replans).at_least
    at_most = bound_success(never, never.start(START), replans).at_most
    reached, runs = 0, 300
    for seed in range(runs):
        drawn = Random(seed)  # noqa: S311  outcomes of a test
        runtime = Hurried(modules, at=site)
        runtime.hurry("sweep", share, drawn)
        runtime.state = dict(START)
        memory = Counting()
        journal = Journal(runtime, memory, None)
        steps = StepRunner(runtime, memory, journal, "t", seed)
        reached += (
            TaskLoop(runtime, RulePlanner(), steps, journal, RoutedTask(ecm.id, task)).run("tidy").reached
        )
    mean = reached / runs
    spread = sqrt(mean * (1 - mean) / runs)
    assert at_least - 4.5 * spread <= mean <= at_most + 4.5 * spread


def predicted(name: str) -> Prediction:
    site, ecm, _ = case(name)
    (task,) = ecm.tasks.values()
    system = TransitionSystem(ecm, task, site, declared_beliefs(ecm))
    return predict(system, system.start(START), site.limits.replans)


def counts(report: RunReport) -> tuple[float, ...]:
    steps = len(report.steps)
    return (float(report.reached), steps, report.retries, report.recoveries, report.replans)


@pytest.mark.parametrize(
    ("name", "runs"),
    [(name, 300) for name in CASES] + [pytest.param(name, 3000, marks=pytest.mark.deep) for name in CASES],
)
def test_runs_come_to_what_is_predicted(name: str, runs: int) -> None:
    found = [counts(run(name, seed)[0]) for seed in range(runs)]
    exact = predicted(name)
    expected = (exact.success, exact.invocations, exact.retries, exact.recoveries, exact.replans)
    for mean, values in zip(map(float, expected), zip(*found, strict=True), strict=True):
        average = sum(values) / runs
        spread = sqrt(sum((value - average) ** 2 for value in values) / runs / runs)
        assert abs(average - mean) <= 4.5 * spread + 1e-6  # rarer than that is not seen


@pytest.mark.parametrize("name", CASES)
def test_every_run_stays_among_the_states_that_were_explored(name: str) -> None:
    site, ecm, _ = case(name)
    (task,) = ecm.tasks.values()
    explored = explore_task(ecm, task, site)
    names = explored.system.names
    known = {node.state for node in explored.graph} | explored.through.keys()
    for seed in range(60):
        for states in _states(name, seed):
            assert tuple(states[one] for one in names) in known


def _states(name: str, seed: int) -> list[dict[str, Any]]:
    _, runtime = run(name, seed)
    return [details["after"] for _, details in runtime.notes if "after" in details] + [dict(runtime.state)]


def test_a_step_runs_as_the_module_that_owns_the_skill() -> None:
    for seed in range(20):
        report, runtime = run("steps_of_a_required_module/asker", seed)
        owners = {(one.module, one.skill) for one in report.steps}
        assert owners <= {("helper", "fetch"), ("helper", "drop"), ("asker", "tidy")}
        assert [(one.module, one.skill) for one in runtime.requests] == [
            (one.module, one.skill) for one in report.steps
        ]


def test_all_modules_that_provide_a_capability_are_tried_and_others_are_not() -> None:
    seen = set()
    for seed in range(40):
        report, _ = run("capability_that_two_modules_provide/asker", seed)
        seen |= {(one.module, one.skill) for one in report.steps}
    assert seen == {("one", "fetch"), ("two", "pick"), ("two", "drop"), ("asker", "tidy")}


def test_a_provider_that_is_not_active_is_not_chosen() -> None:
    site, ecm, modules = case("capability_that_two_modules_provide/asker")
    left = {name: one for name, one in modules.items() if name != "two"}
    runtime = FakeRuntime(left, at=site)
    runtime.state = dict(START)
    memory, (task,) = Counting(), ecm.tasks.values()
    journal = Journal(runtime, memory, None)
    loop = TaskLoop(
        runtime, RulePlanner(), StepRunner(runtime, memory, journal, "t"), journal, RoutedTask(ecm.id, task)
    )
    report = loop.run("tidy")
    assert report.reached
    assert [(one.module, one.skill) for one in report.steps] == [("one", "fetch"), ("asker", "tidy")]
