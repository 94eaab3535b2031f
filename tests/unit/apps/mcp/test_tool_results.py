"""Results of executions, and schemas of all tools."""

from __future__ import annotations

import pytest
from jsonschema import Draft202012Validator

from aeros.agent.execution.journal import AgentEvent
from aeros.apps.mcp.robot import PlanExecution
from aeros.apps.mcp.tool_arguments import SCHEMAS
from aeros.apps.mcp.tool_results import OUTPUT_SCHEMAS, execution_result, pending_result


@pytest.mark.parametrize("tool", SCHEMAS)
def test_every_tool_has_a_valid_output_schema_of_an_object(tool: str) -> None:
    schema = OUTPUT_SCHEMAS[tool]
    Draft202012Validator.check_schema(schema)
    assert (schema["type"], schema["additionalProperties"]) == ("object", False)


def test_an_execution_counts_the_steps_that_begin_and_end() -> None:
    running = PlanExecution("p1", "c", 2)
    assert execution_result(running) == {
        "status": "executing", "plan": "p1", "steps_done": 0.0, "steps_total": 2, "latest": "",
    }  # fmt: skip
    running.on_event(AgentEvent("step-started", "prepare begins", {}, 1.0))
    running.on_event(AgentEvent("plan-accepted", "another event", {}, 1.0))
    found = execution_result(running)
    assert (found["steps_done"], found["latest"]) == (0.5, "prepare begins")
    Draft202012Validator(OUTPUT_SCHEMAS["execute_plan"]).validate(found)


def test_an_exception_and_a_request_for_approval_are_results() -> None:
    running = PlanExecution("p1", failure="OSError: disk full")
    running.ended.set()
    failed = execution_result(running)
    assert failed == {"status": "failed", "plan": "p1", "reason": "OSError: disk full"}
    pending = pending_result("p1", "0a0a0a0a", user_may_approve=True)
    assert pending["operator"] == "aeros approve 0a0a0a0a"
    for one in (failed, pending):
        Draft202012Validator(OUTPUT_SCHEMAS["execute_plan"]).validate(one)
