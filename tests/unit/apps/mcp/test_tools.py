"""Tools for clients: plans are judged, the operator approves, the gate decides."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.apps.mcp.accepted_plans import MAX_PLANS
from aeros.apps.mcp.approvals import approve, pending_requests, reject
from aeros.apps.mcp.tool_arguments import ToolCallError
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.spec.model.policy import Execute, McpPolicy
from tests.unit.apps.mcp.cells import FREE, LAID_OUT, PREPARE, Cell, cell, dumplings


@pytest.fixture(scope="module")
def configuration() -> Configuration:
    return dumplings()


@pytest.fixture
def usual(configuration: Configuration, tmp_path: Path) -> Iterator[Cell]:
    with cell(configuration, tmp_path, McpPolicy()) as one:
        yield one


@pytest.fixture
def free(configuration: Configuration, tmp_path: Path) -> Iterator[Cell]:
    with cell(configuration, tmp_path, FREE) as one:
        yield one


# Looking.


def test_skills_are_listed_with_what_a_plan_needs(usual: Cell) -> None:
    found = usual.call("list_skills")
    assert found["task"]["goal"] == "dumplings_cooked >= count"
    (wrap,) = (one for one in found["skills"] if one["skill"] == "make_dumplings.wrap")
    needed = "robot_at_bench and wrapper_aligned and filling_on_workspace"
    assert wrap["precondition"] == f"{needed} and wrappers_suffice and fillings_suffice"
    after = ("dumpling_wrapped", "wrappers_suffice", "fillings_suffice")
    then = {f"make_dumplings.{name}": True for name in after}
    assert {"outcome": "wrapped", "failure": False, "then": then} in wrap["outcomes"]
    json.dumps(found)


def test_state_is_as_measured(usual: Cell) -> None:
    found = usual.call("state")
    assert found["state"]["human_distance"] == {"value": 20.0, "age": 0.0}
    assert found["operator"] == "run"
    assert found["running"] is None
    json.dumps(found, allow_nan=False)


# Proposing.


def test_a_plan_that_an_outcome_leads_astray_is_rejected_with_the_state(usual: Cell) -> None:
    names = ("prepare", "wrap", "boil")
    found = usual.call("propose_plan", steps=[{"skill": f"make_dumplings.{name}"} for name in names])
    assert not found["accepted"]
    assert found["plan"] is None
    (problem,) = found["problems"]
    assert "step 2, `make_dumplings.wrap`: its precondition" in problem
    assert "wrapper_aligned = false" in problem
    assert usual.decisions() == 0


@pytest.mark.parametrize(
    ("steps", "why"),
    [
        ([{"skill": "make_dumplings.prepar"}], "has no skill `prepar`; did you mean `prepare`?"),
        ([{"skill": "make_pizza.bake"}], "no active module is named `make_pizza`"),
        ([{"skill": "prepare"}], "`prepare`"),
        ([{"skill": "make_dumplings.prepare", "inputs": {"speed": 9}}], "speed"),
        ([{"skill": "__import__('os').system('x')"}], "step 1"),
        ([{"skill": "make_dumplings.boil"}], "precondition"),
    ],
)
def test_plans_that_cannot_be_are_rejected(steps: list[dict[str, Any]], why: str, usual: Cell) -> None:
    found = usual.call("propose_plan", steps=steps)
    assert not found["accepted"]
    assert why in "; ".join(found["problems"])


@pytest.mark.parametrize(
    "goal", ["dumpling_cooked and", "no_such_thing", "human_distance", "1 m >= 1 s", "x" * 999, "\x00"]
)
def test_a_goal_that_is_none_is_refused_with_its_place(goal: str, usual: Cell) -> None:
    with pytest.raises(ToolCallError, match="the goal is not understood"):
        usual.call("propose_plan", steps=PREPARE, goal=goal)


def test_accepted_plans_are_kept_up_to_a_number(usual: Cell) -> None:
    first = usual.proposed()
    for _ in range(MAX_PLANS):
        usual.proposed()
    with pytest.raises(ToolCallError, match="unknown plan"):
        usual.call("execute_plan", plan=first)


# Executing.


def test_nothing_is_executed_without_the_operator(usual: Cell) -> None:
    name = usual.proposed()
    for _ in range(2):
        found = usual.call("execute_plan", plan=name)
        assert found["status"] == "waits for approval"
    (asked,) = pending_requests(usual.folder / "state")
    assert found["operator"] == f"aeros approve {asked['id']}"
    assert (asked["client"], asked["goal"]) == ("a client 1.0", LAID_OUT)
    assert asked["steps"] == [{"skill": "make_dumplings.prepare", "inputs": {}}]
    assert usual.call("state")["waiting_for_approval"] == [asked["id"]]
    assert usual.decisions() == 0


def test_an_approved_request_is_executed_once_and_its_author_is_on_record(usual: Cell) -> None:
    name = usual.proposed()
    id_ = usual.call("execute_plan", plan=name)["operator"].split()[-1]
    approve(usual.folder / "state", id_)
    found = usual.call("execute_plan", plan=name, wait=30)
    assert found["status"] == "goal reached"
    assert found["steps"] == [
        {"skill": "make_dumplings.prepare", "status": "finished", "outcome": "laid_out", "reason": ""}
    ]
    decided = usual.decisions()
    assert decided > 10
    assert usual.call("execute_plan", plan=name, wait=1) == found
    assert usual.decisions() == decided
    (noted,) = usual.noted("mcp-plan-started")
    assert (noted["client"], noted["plan"], noted["approved"]["id"]) == ("a client 1.0", name, id_)
    assert [note["planner"] for note in usual.noted("plan-accepted")] == ["mcp"]


def test_a_request_that_the_operator_refuses_is_not_executed(usual: Cell) -> None:
    name = usual.proposed()
    id_ = usual.call("execute_plan", plan=name)["operator"].split()[-1]
    reject(usual.folder / "state", id_)
    with pytest.raises(ToolCallError, match="the operator did not approve it"):
        usual.call("execute_plan", plan=name)
    with pytest.raises(ToolCallError, match="unknown plan"):
        usual.call("execute_plan", plan=name)
    assert usual.decisions() == 0


def test_a_site_may_let_plans_be_executed_at_once(free: Cell) -> None:
    assert free.call("execute_plan", plan=free.proposed(), wait=30)["status"] == "goal reached"
    assert free.noted("mcp-plan-started")[0]["approved"] is None


def test_a_site_may_let_nothing_be_executed(configuration: Configuration, tmp_path: Path) -> None:
    with cell(configuration, tmp_path, McpPolicy(Execute.DENIED)) as one:
        with pytest.raises(ToolCallError, match="does not allow MCP clients to execute plans"):
            one.call("execute_plan", plan=one.proposed())
        assert one.noted("mcp-call-rejected")[0]["tool"] == "execute_plan"


def test_a_site_may_name_the_skills_and_the_number_of_steps(
    configuration: Configuration, tmp_path: Path
) -> None:
    policy = McpPolicy(max_steps=2, skills=frozenset(("make_dumplings.boil",)))
    with cell(configuration, tmp_path, policy) as one:
        assert [skill["skill"] for skill in one.call("list_skills")["skills"]] == ["make_dumplings.boil"]
        found = one.call("propose_plan", steps=PREPARE, goal=LAID_OUT)
        assert found["problems"] == [
            "step 1: this site's `policy.mcp.skills` does not have `make_dumplings.prepare`"
        ]
        with pytest.raises(ToolCallError, match="the plan has 3 steps; this site allows 2"):
            one.call("propose_plan", steps=PREPARE * 3)


def test_a_plan_that_the_world_has_left_behind_is_not_executed(free: Cell) -> None:
    early = free.call("propose_plan", steps=[*PREPARE, *PREPARE], goal=LAID_OUT)["plan"]
    late = free.proposed()
    assert free.call("execute_plan", plan=early, wait=30)["status"] == "goal reached"
    decided = free.decisions()
    found = free.call("execute_plan", plan=late, wait=30)
    assert found["status"] == "goal reached"
    assert found["steps"] == []
    assert free.decisions() == decided


def test_after_a_failure_the_client_is_to_propose_again(configuration: Configuration, tmp_path: Path) -> None:
    with cell(configuration, tmp_path, FREE, seed=7) as one:
        found = one.call("execute_plan", plan=one.proposed(), wait=30)
        assert found["status"] == "goal not reached"
        assert "the plan has ended; propose a new one" in found["reason"]
        assert [step["outcome"] for step in found["steps"]] == ["missed"]
        assert one.call("execute_plan", plan=one.proposed(), wait=30)["status"] == "goal reached"


def test_a_site_that_changes_is_followed(free: Cell) -> None:
    name = free.proposed()
    stricter = replace(free.operator.in_force.site, mcp=McpPolicy(Execute.DENIED, max_steps=1))
    free.operator.in_force = replace(free.operator.in_force, site=stricter, digest="another")
    with pytest.raises(ToolCallError, match="does not allow MCP clients to execute plans"):
        free.call("execute_plan", plan=name)
    with pytest.raises(ToolCallError, match="this site allows 1"):
        free.call("propose_plan", steps=PREPARE * 2)
    assert free.call("list_skills")["most_steps"] == 1
    assert free.decisions() == 0


def test_a_plan_is_judged_again_when_it_is_executed(free: Cell) -> None:
    name = free.proposed()
    fewer = McpPolicy(Execute.ALLOWED, skills=frozenset(("make_dumplings.boil",)))
    site = replace(free.operator.in_force.site, mcp=fewer)
    free.operator.in_force = replace(free.operator.in_force, site=site, digest="another")
    found = free.call("execute_plan", plan=name, wait=30)
    assert found["status"] == "goal not reached"
    assert free.noted("plan-rejected")[0]["problems"] == [
        "the planner failed: PlanWithdrawnError: no longer valid in the current state: step 1: this site's "
        "`policy.mcp.skills` does not have `make_dumplings.prepare`"
    ]
    assert free.decisions() == 0


def test_a_plan_that_was_executed_is_not_there_to_be_executed_again(free: Cell) -> None:
    first, second = free.proposed(), free.proposed()
    for name in (first, second):
        free.call("execute_plan", plan=name, wait=30)
    with pytest.raises(ToolCallError, match="unknown plan"):
        free.call("execute_plan", plan=first)


# Holding.


@pytest.mark.parametrize("command", [OperatorCommand.PAUSE, OperatorCommand.STOP])
def test_while_it_is_held_nothing_is_executed(command: OperatorCommand, free: Cell) -> None:
    name = free.proposed()
    free.operator.ask(command)
    with pytest.raises(ToolCallError, match="the operator resumes it"):
        free.call("execute_plan", plan=name)
    assert free.decisions() == 0


def test_a_stop_voids_what_was_accepted_and_approved(usual: Cell) -> None:
    name = usual.proposed()
    id_ = usual.call("execute_plan", plan=name)["operator"].split()[-1]
    approve(usual.folder / "state", id_)
    assert usual.call("stop") == {"status": "stopped"}
    usual.operator.ask(OperatorCommand.RUN)
    with pytest.raises(ToolCallError, match="unknown plan"):
        usual.call("execute_plan", plan=name)
    assert usual.decisions() == 0


def test_a_robot_that_is_busy_says_so_and_can_be_stopped(free: Cell) -> None:
    free.operator.at_first["decision"] = lambda: free.operator.ask(OperatorCommand.PAUSE)
    name, other = free.proposed(), free.proposed()
    executing = free.call("execute_plan", plan=name, wait=0.5)
    assert (executing["status"], executing["plan"]) == ("executing", name)
    assert (executing["steps_done"], executing["steps_total"]) == (0.5, 1)
    with pytest.raises(ToolCallError, match=f"the robot is busy with plan {name}"):
        free.proposed()
    with pytest.raises(ToolCallError, match="the robot is busy"):
        free.call("execute_plan", plan=other)
    state = free.call("state")
    assert state["operator"] == "pause"
    assert state["running"] == executing
    assert state["state"]["estop_pressed"]["value"] is False
    free.call("stop")
    found = free.call("execute_plan", plan=name, wait=30)
    assert found["status"] == "goal not reached"
    assert "stopped by the operator" in found["reason"]


def test_when_the_client_goes_the_robot_stops(configuration: Configuration, tmp_path: Path) -> None:
    with cell(configuration, tmp_path, FREE) as one:
        one.operator.at_first["decision"] = lambda: one.operator.ask(OperatorCommand.PAUSE)
        one.call("execute_plan", plan=one.proposed(), wait=0.2)
        running = one.robot.running
        assert running is not None
        one.robot.close()
        assert running.report is not None
        assert not running.report.reached


# Tasks.


def test_without_a_task_of_its_own_a_server_takes_the_only_one(
    configuration: Configuration, tmp_path: Path
) -> None:
    with cell(configuration, tmp_path, FREE, instruction=None) as one:
        listed = one.call("list_skills")
        assert [task["name"] for task in listed["tasks"]] == ["make_dumplings.make_dumplings"]
        assert listed["task"] == listed["tasks"][0]
        found = one.call("propose_plan", steps=PREPARE, goal=LAID_OUT)
        assert found["task"] == "make_dumplings.make_dumplings"


@pytest.mark.parametrize(
    ("words", "task"),
    [
        ("make dumplings", "make_dumplings.make_dumplings(count = 1)"),
        ("make_dumplings.make_dumplings count=2", "make_dumplings.make_dumplings(count = 2)"),
    ],
)
def test_a_plan_names_its_task_and_the_operator_sees_it(words: str, task: str, usual: Cell) -> None:
    found = usual.call("propose_plan", steps=PREPARE, goal=LAID_OUT, task=words)
    assert (found["accepted"], found["task"]) == (True, task.partition("(")[0])
    usual.call("execute_plan", plan=found["plan"])
    (asked,) = pending_requests(usual.folder / "state")
    assert asked["task"] == task


@pytest.mark.parametrize("words", ["make pizza", "do not make dumplings", "", "\x00"])
def test_a_task_that_is_none_is_refused(words: str, usual: Cell) -> None:
    with pytest.raises(ToolCallError, match="the task is not understood"):
        usual.call("propose_plan", steps=PREPARE, goal=LAID_OUT, task=words)
    assert usual.noted("mcp-call-rejected")


# Cancelling.


def test_a_cancelled_plan_comes_to_rest_and_says_who_cancelled_it(free: Cell) -> None:
    free.operator.at_first["decision"] = lambda: free.operator.ask(OperatorCommand.PAUSE)
    free.call("execute_plan", plan=free.proposed(), wait=0.3)
    running = free.robot.running
    assert running is not None
    running.cancel("cancelled by a client 1.0")
    running.cancel("cancelled by another")
    assert running.ended.wait(10.0)
    found = free.call("state")["running"]
    assert (found["status"], found["reason"]) == ("cancelled", "cancelled by a client 1.0")
    assert [step["status"] for step in found["steps"]] == ["cancelled"]
    assert free.noted("mcp-plan-cancelled") == [{"plan": running.plan, "reason": "cancelled by a client 1.0"}]
    # A cancellation is no stop: the next plan needs no resume.
    free.operator.ask(OperatorCommand.RUN)
    assert free.call("execute_plan", plan=free.proposed(), wait=30)["status"] == "goal reached"


def test_a_plan_for_which_nobody_waits_is_cancelled(free: Cell) -> None:
    free.tools.cancel_unattended(0.0)  # nothing is executed yet
    free.operator.at_first["decision"] = lambda: free.operator.ask(OperatorCommand.PAUSE)
    free.call("execute_plan", plan=free.proposed(), wait=0.3)
    running = free.robot.running
    assert running is not None
    free.tools.cancel_unattended(60.0)
    assert not running.ended.wait(0.2)
    free.tools.cancel_unattended(0.0)
    assert running.ended.wait(10.0)
    assert free.call("state")["running"]["reason"] == "no client has waited for the plan for 0 s"


def test_a_flood_of_rejected_calls_and_proposals_does_not_fill_the_log(free: Cell) -> None:
    for _ in range(150):
        with pytest.raises(ToolCallError, match="unknown plan"):
            free.call("execute_plan", plan="x")
    assert len(free.noted("mcp-call-rejected")) < 110
    with pytest.raises(ToolCallError, match="too many proposals and rejected calls"):
        free.proposed()
    assert free.call("state")["plans"] == []
    free.call("stop")
    assert len(free.noted("mcp-stopped")) == 1
