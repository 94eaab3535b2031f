"""The robot behind the tools: measurements for other threads, plans followed once, and one thread for all."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from aeros.agent.agent import start_agent
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import PlanStep, TaskGraph
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.apps.mcp.plan_review import ClientPlan, ClientPlanChecker
from aeros.apps.mcp.robot import (
    ClientPlanner,
    LatestMeasurements,
    McpRobotThread,
    PlanWithdrawnError,
    RobotParts,
)
from aeros.apps.mcp.tool_arguments import ProposedStep
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import Reading
from aeros.spec.model.ecm import ActionCondition, Ecm
from tests.unit.agent.dumplings import MAKE_DUMPLINGS, SPAN, site, term
from tests.unit.agent.fake_runtime import FakeRuntime

ROUTED = RoutedTask("dumpling", MAKE_DUMPLINGS)
PREPARED = ActionCondition(term("dough_on_workspace"), "dough_on_workspace", SPAN)
PREPARE = ClientPlan((ProposedStep("dumpling.prepare", {}),), PREPARED, ROUTED)
NOWHERE = RobotChain()


def test_a_tick_measures_now_and_an_observation_when_it_was_made() -> None:
    heard = LatestMeasurements()
    assert heard.last() == (0.0, {})
    heard.on_tick(2.0, {"a": 1, "b": Reading(True, 1.5)}, NOWHERE)
    heard.on_observed({"c": Reading("pot", 1.0)}, NOWHERE)
    assert heard.last() == (2.0, {"a": Reading(1, 2.0), "b": Reading(True, 1.5), "c": Reading("pot", 1.0)})


def test_later_values_replace_earlier_ones_and_others_stay() -> None:
    heard = LatestMeasurements()
    heard.on_tick(1.0, {"a": 1, "b": 2}, NOWHERE)
    before = heard.last()
    heard.on_tick(2.0, {"a": 3}, NOWHERE)
    assert heard.last() == (2.0, {"a": Reading(3, 2.0), "b": Reading(2, 1.0)})
    assert before == (1.0, {"a": Reading(1, 1.0), "b": Reading(2, 1.0)})  # a copy


class Judge(ClientPlanChecker):
    """Finds the same problems with every plan."""

    def __init__(self, *problems: str) -> None:
        self.found = list(problems)

    def problems(
        self, plan: ClientPlan, routed: RoutedTask, world: WorldModel, modules: Mapping[str, Ecm]
    ) -> list[str]:
        return self.found


WORLD = world_from_readings(site().state, {}, 0.0)


def test_a_plan_is_followed_once() -> None:
    planner = ClientPlanner(Judge())
    planner.plan_to_follow = PREPARE
    assert planner.plan(ROUTED, WORLD, {}) == TaskGraph((PlanStep("dumpling", "prepare"),))
    with pytest.raises(PlanWithdrawnError, match="the plan has ended; propose a new one"):
        planner.plan(ROUTED, WORLD, {})


def test_a_plan_that_is_no_longer_valid_is_not_followed_later_either() -> None:
    planner = ClientPlanner(Judge("it is cold", "it is late"))
    planner.plan_to_follow = PREPARE
    with pytest.raises(
        PlanWithdrawnError, match="no longer valid in the current state: it is cold; it is late"
    ):
        planner.plan(ROUTED, WORLD, {})
    assert planner.plan_to_follow is None


class Robot:
    """A robot thread over a runtime in memory, and what was asked of its halt."""

    def __init__(self, folder: Path, runtime: FakeRuntime) -> None:
        self.runtime, self.halts, self.closed = runtime, 0, False

        @contextmanager
        def opened() -> Iterator[RobotParts]:
            planner = ClientPlanner(Judge())
            with start_agent(folder, "chef", runtime, planner) as agent:
                yield RobotParts(runtime, agent, planner)
            self.closed = True

        self.thread = McpRobotThread(opened, self._halt)

    def _halt(self) -> None:
        self.halts += 1


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Robot]:
    made = Robot(tmp_path, FakeRuntime())
    yield made
    made.thread.close()


def test_a_plan_is_run_to_its_own_goal_and_recorded_first(robot: Robot) -> None:
    assert not robot.thread.is_busy
    running = robot.thread.start_plan("p1", PREPARE, {"client": "me"})
    assert running.ended.wait(10.0)
    assert robot.thread.running is running
    assert not robot.thread.is_busy
    assert running.report is not None
    assert (running.plan, running.report.reached, running.report.goal) == ("p1", True, "dough_on_workspace")
    assert running.failure is None
    assert robot.runtime.submitted == ["prepare"]
    assert robot.runtime.notes[0] == ("mcp-plan-started", {"client": "me"})


def test_while_a_plan_runs_the_robot_is_busy(robot: Robot) -> None:
    seen: list[bool] = []
    submit = robot.runtime.submit

    def watch(request: Any) -> Any:
        seen.append(robot.thread.is_busy)
        return submit(request)

    robot.runtime.submit = watch  # type: ignore[method-assign]
    assert robot.thread.start_plan("p1", PREPARE, {}).ended.wait(10.0)
    assert seen == [True]


def test_an_exception_ends_a_plan_and_is_reported(tmp_path: Path) -> None:
    robot = Robot(tmp_path, FakeRuntime(endings={"prepare": [OSError("disk full")]}))
    running = robot.thread.start_plan("p1", PREPARE, {})
    assert running.ended.wait(10.0)
    assert (running.report, running.failure) == (None, "OSError: disk full")
    robot.thread.close()


def test_the_state_is_measured_in_the_robots_thread(robot: Robot) -> None:
    robot.runtime.state["dumpling_wrapped"] = True
    world = robot.thread.world().result(10.0)
    assert (world.time, world.known["dumpling_wrapped"]) == (100.0, True)


def test_closing_stops_all_motion_and_closes_the_robot(tmp_path: Path) -> None:
    robot = Robot(tmp_path, FakeRuntime())
    robot.thread.close()
    assert (robot.halts, robot.closed) == (1, True)
    robot.thread.close()
    assert robot.halts == 2
