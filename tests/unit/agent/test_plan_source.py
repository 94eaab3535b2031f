"""Plans that come late: what is followed in their place, and when the robot stands still."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from math import inf
from pathlib import Path

import pytest

from aeros.agent.agent import start_agent
from aeros.agent.execution.report import RunReport
from aeros.agent.instructions.meaning import Understanding
from aeros.agent.instructions.understand import understand
from aeros.agent.planning.base import Planner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.smt import SmtPlanner
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import EndedStep
from aeros.spec.model.ecm import Ecm
from tests.unit.agent.dumplings import DUMPLING, site
from tests.unit.agent.fake_runtime import FakeRuntime

WITHIN = 3.0


def run(folder: Path, runtime: FakeRuntime, planner: Planner, timeout: float | None = None) -> RunReport:
    with start_agent(folder, "chef", runtime, planner, within=WITHIN) as agent:
        return agent.run("Make dumplings!", timeout)


def proposed(*skills: str) -> Understanding:
    meaning = understand("Make dumplings!", {"dumpling": DUMPLING})
    plan = TaskGraph(tuple(PlanStep("dumpling", skill) for skill in skills))
    return replace(meaning, errands=(replace(meaning.errands[0], proposed_plan=plan),))


def pursue(
    folder: Path, runtime: FakeRuntime, meaning: Understanding
) -> tuple[RunReport, list[tuple[object, object]]]:
    with start_agent(folder, "chef", runtime, SmtPlanner(site()), within=30.0) as agent:
        report = agent.run(meaning)
    accepted = [details for kind, details in runtime.notes if kind == "plan-accepted"]
    return report, [(one.get("remark"), one["steps"]) for one in accepted]


CAME_WITH_IT = "it came with the meaning of the instruction"


def test_a_plan_that_came_with_the_instruction_is_followed_first_and_once(tmp_path: Path) -> None:
    runtime = FakeRuntime(endings={"wrap": ["misaligned"]})
    report, plans = pursue(tmp_path, runtime, proposed("prepare", "recover", "wrap", "boil"))
    assert report.reached
    (first, _), (second, _) = plans
    assert first == CAME_WITH_IT
    assert str(second).startswith("expected ")


def test_of_a_proposed_plan_the_end_is_followed_that_leads_to_the_goal(tmp_path: Path) -> None:
    runtime = FakeRuntime()
    runtime.state |= {"dough_on_workspace": True, "filling_on_workspace": True}
    _, plans = pursue(tmp_path, runtime, proposed("prepare", "recover", "wrap", "boil"))
    assert plans == [(CAME_WITH_IT, ["dumpling.recover", "dumpling.wrap", "dumpling.boil"])]


@pytest.mark.parametrize("skills", [("boil",), ("teleport",), ("prepare",)])
def test_a_proposed_plan_that_does_not_lead_to_the_goal_is_not_followed(
    skills: tuple[str, ...], tmp_path: Path
) -> None:
    report, plans = pursue(tmp_path, FakeRuntime(), proposed(*skills))
    assert report.reached
    ((remark, _),) = plans
    assert str(remark).startswith("expected ")


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


def test_in_place_of_a_late_plan_the_rest_of_the_one_before_is_followed(tmp_path: Path) -> None:
    runtime = FakeRuntime(endings={"wrap": ["misaligned"]})
    report = run(tmp_path, runtime, Sleeping("prepare", "recover", "wrap", "boil"))
    assert report.reached
    assert runtime.submitted == ["prepare", "recover", "wrap", "recover", "wrap", "boil"]
    (late,) = notes_of(runtime, "planning-timeout")
    assert late["reason"] == f"the plan is late: there was no plan within {WITHIN:g} s"
    assert late["steps"] == ["dumpling.recover", "dumpling.wrap", "dumpling.boil"]


def test_where_the_plan_before_does_not_lead_to_the_goal_any_more_the_robot_stands_still(
    tmp_path: Path,
) -> None:
    runtime = FakeRuntime(endings={"wrap": ["misaligned"]}, at=site(replans=2))
    runtime.state["wrapper_aligned"] = True
    report = run(tmp_path, runtime, Sleeping("prepare", "wrap", "boil"))
    assert runtime.submitted == ["prepare", "wrap"]
    assert [one["steps"] for one in notes_of(runtime, "planning-timeout")] == [[], []]
    assert report.reason is not None
    assert report.reason.endswith(f"the plan is late: there was no plan within {WITHIN:g} s; stands still")


def test_without_a_plan_before_the_robot_stands_still_until_the_time_for_the_task_is_over(
    tmp_path: Path,
) -> None:
    runtime = FakeRuntime()
    runtime.state["dough_on_workspace"] = True
    report = run(tmp_path, runtime, Sleeping("prepare"), timeout=2.0)
    assert runtime.submitted == []
    assert runtime.clock == 102.0
    assert report.reason is not None
    assert report.reason.startswith("the time limit of 2 s has passed; the plan ended: the plan is late")


class Stopped(FakeRuntime):
    """The operator stops everything after 2 s of thinking."""

    @property
    def is_stopped(self) -> bool:
        return self.clock >= 102.0


def test_once_the_operator_has_stopped_everything_nobody_is_waited_for(tmp_path: Path) -> None:
    runtime = Stopped()
    runtime.state["dough_on_workspace"] = True
    with start_agent(tmp_path, "chef", runtime, Sleeping("prepare"), within=inf) as agent:
        report = agent.run("Make dumplings!")
    assert report.replans == 0
    assert runtime.clock == 102.0
    assert report.reason == "the plan is late: the operator has stopped everything; stands still"


class Changing(FakeRuntime):
    """Runtime whose measured values change over time."""

    def wait(self, until: float = inf) -> EndedStep | None:
        ended = super().wait(until)
        if ended is None:
            self.state["wrapper_aligned"] = not self.state["wrapper_aligned"]
        return ended


def test_a_path_found_from_another_world_is_not_followed(tmp_path: Path) -> None:
    # The judge falls asleep too, for long enough that something else is measured by then.
    runtime = Changing(endings={"wrap": ["misaligned"]}, at=site(replans=1))

    def drowsy(*_: object) -> list[str]:
        time.sleep(1.2)
        return []

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("aeros.agent.planning.check_plan.PlanChecker.problems", drowsy)
        with start_agent(
            tmp_path, "chef", runtime, Sleeping("prepare", "recover", "wrap", "boil"), within=2.0
        ) as agent:
            agent.run("Make dumplings!")
    assert [one["steps"] for one in notes_of(runtime, "planning-timeout")] == [[]]
