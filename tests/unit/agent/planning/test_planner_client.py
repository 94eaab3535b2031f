"""Plans that come late, or not at all: what the agent does in their place."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from math import inf
from pathlib import Path

import pytest

from aeros.agent.agent import start_agent
from aeros.agent.execution.report import RunReport
from aeros.agent.planning.base import Planner, RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.smt import SmtPlanner
from aeros.agent.planning.strong_cyclic import NoPlanError
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import EndedStep
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.model.ecm import Ecm
from tests.unit.agent.dumplings import site
from tests.unit.agent.fake_runtime import FakeRuntime

WITHIN = 3.0


def run(folder: Path, runtime: FakeRuntime, planner: Planner, timeout: float | None = None) -> RunReport:
    with start_agent(folder, "chef", runtime, planner, within=WITHIN) as agent:
        return agent.run("Make dumplings!", timeout)


class Sleeping:
    """By heart as long as nothing has been prepared; then it falls asleep."""

    name = "sleeping"

    def __init__(self, *skills: str) -> None:
        self.skills = skills

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        if world.predicates["dough_on_workspace"]:
            time.sleep(1000.0)
        return TaskGraph(tuple(PlanStep("dumpling", skill) for skill in self.skills))


def notes_of(runtime: FakeRuntime, kind: str) -> list[dict[str, object]]:
    return [details for one, details in runtime.notes if one == kind]


def test_a_planner_in_a_subprocess_reaches_the_goal_as_in_process(tmp_path: Path) -> None:
    planners: list[Planner] = [RulePlanner(), SmtPlanner(site())]
    for planner in planners:
        runtime = FakeRuntime(endings={"wrap": ["misaligned"]})
        assert run(tmp_path / planner.name, runtime, planner).reached
        assert runtime.submitted[-2:] == ["wrap", "boil"]


def test_the_site_says_how_long_a_planner_may_take_at_most(tmp_path: Path) -> None:
    limits = replace(site().limits, replans=0, planning=Fraction(1, 2))
    runtime = FakeRuntime(at=replace(site(), limits=limits))
    runtime.state["dough_on_workspace"] = True
    with start_agent(tmp_path, "chef", runtime, Sleeping("prepare"), within=inf) as agent:
        agent.run("Make dumplings!")
    assert runtime.clock == 100.5
    (late,) = notes_of(runtime, "planning-timeout")
    assert late["reason"] == "the plan is late: there was no plan within 0.5 s"


class Unable:
    """It says why, and proposes nothing."""

    name = "unable"

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        raise LookupError("no idea")


def test_a_planner_that_aborts_in_a_subprocess_is_refused_as_in_process(tmp_path: Path) -> None:
    message = []
    for within in (None, WITHIN):
        runtime = FakeRuntime()
        with start_agent(tmp_path / str(within), "chef", runtime, Unable(), within=within) as agent:
            message.append(agent.run("Make dumplings!").reason)
    assert message == ["the plan is rejected: the planner failed: LookupError: no idea"] * 2


class Unsolvable:
    """It finds that there is no plan, and says why over two lines."""

    name = "unsolvable"

    def plan(self, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]) -> TaskGraph:
        raise NoPlanError("no plan reaches\nthe goal: nothing boils")


def test_the_reason_why_there_is_no_plan_has_no_name_of_an_exception(tmp_path: Path) -> None:
    for within in (None, WITHIN):
        with start_agent(tmp_path / str(within), "chef", FakeRuntime(), Unsolvable(), within=within) as agent:
            reason = agent.run("Make dumplings!").reason
        assert reason == "the plan is rejected: the planner failed: no plan reaches the goal: nothing boils"


class Broken(FakeRuntime):
    """The runtime itself fails while somebody thinks."""

    def wait(self, until: float = inf) -> EndedStep | None:
        raise InternalError("the plant is gone")


def test_a_fault_of_the_runtime_while_planning_is_no_fault_of_the_planner(tmp_path: Path) -> None:
    runtime = Broken()
    runtime.state["dough_on_workspace"] = True
    with pytest.raises(InternalError, match="the plant is gone"):
        run(tmp_path, runtime, Sleeping("prepare"))
