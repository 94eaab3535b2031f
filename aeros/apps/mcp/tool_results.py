"""Results of MCP tools: a JSON Schema of each, and texts of plan executions.

Schemas allow no unnamed fields, so that a client, a test or the protocol's SDK finds any deviation.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aeros.apps.mcp.robot import PlanExecution

_ANY: Final[Mapping[str, Any]] = {}
_TEXT: Final = {"type": "string"}
_TEXT_OR_NULL: Final = {"type": ["string", "null"]}
_NUMBER: Final = {"type": "number"}
_TRUTH: Final = {"type": "boolean"}
_TEXTS: Final = {"type": "array", "items": _TEXT}
_VALUES: Final = {"type": "object", "description": "values by name, SI units"}


def _object(
    fields: Mapping[str, Any], optional: tuple[str, ...] = (), also: str = "", *, or_null: bool = False
) -> dict[str, Any]:
    described = {"description": also} if also else {}
    return {
        "type": ["object", "null"] if or_null else "object",
        "properties": dict(fields),
        "required": [name for name in fields if name not in optional],
        "additionalProperties": False,
        **described,
    }


def _by_name(value: Mapping[str, Any], also: str) -> dict[str, Any]:
    return {"type": "object", "additionalProperties": dict(value), "description": also}


def _list(item: Mapping[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": dict(item)}


_DECLARED: Final = _object(
    {
        "type": _TEXT,
        "unit": _TEXT_OR_NULL,
        "range": {"type": ["array", "null"], "items": _NUMBER, "minItems": 2, "maxItems": 2},
    }
)
_TASK: Final = {"name": _TEXT, "goal": _TEXT, "words": _TEXTS, "parameters": _by_name(_DECLARED, "by name")}
_SKILL: Final = _object(
    {
        "skill": {**_TEXT, "description": "MODULE.SKILL"},
        "risk": _TEXT,
        "precondition": _TEXT_OR_NULL,
        "outcomes": _list(_object({"outcome": _TEXT, "failure": _TRUTH, "then": _ANY})),
        "inputs": _by_name(_DECLARED, "inputs that have no default, by name"),
    }
)
_MEASUREMENT: Final = _object(
    {
        "value": _ANY,
        "age": {**_NUMBER, "description": "plant seconds"},
        "unknown": {**_TEXT, "description": "why it is unknown"},
    },
    optional=("age", "unknown"),
)
_STEP_RESULT: Final = _object({"skill": _TEXT, "status": _TEXT, "outcome": _TEXT_OR_NULL, "reason": _TEXT})
_STATUSES: Final = ("executing", "failed", "cancelled", "goal reached", "goal not reached")
_PROGRESS: Final = {
    "status": {"type": "string", "enum": list(_STATUSES)},
    "plan": {**_TEXT, "description": "id of the plan"},
    "steps_done": {**_NUMBER, "description": "steps that have ended, plus a half for one that has begun"},
    "steps_total": {"type": "integer"},
    "latest": {**_TEXT, "description": "text of the latest step event"},
    "reason": _TEXT_OR_NULL,
    "measured": _VALUES,
    "steps": _list(_STEP_RESULT),
}
_OPTIONAL_PROGRESS: Final = ("steps_done", "steps_total", "latest", "reason", "measured", "steps")
_OPERATOR: Final = {**_TEXT, "description": "command with which the operator approves, in another terminal"}
_PENDING: Final = "waits for approval"

_EXECUTED: Final = _object(
    {
        **_PROGRESS,
        "status": {"type": "string", "enum": [*_STATUSES, _PENDING]},
        "operator": _OPERATOR,
        "user_may_approve": {
            **_TRUTH,
            "description": "true if the site also accepts a yes of the client's user, by elicitation",
        },
    },
    optional=(*_OPTIONAL_PROGRESS, "operator", "user_may_approve"),
)

OUTPUT_SCHEMAS: Final[Mapping[str, Mapping[str, Any]]] = {
    "list_skills": _object(
        {
            "task": _object(_TASK, also="the task of plans that name none", or_null=True),
            "tasks": _list(_object(_TASK)),
            "most_steps": {"type": "integer", "description": "steps of a plan at most"},
            "skills": _list(_SKILL),
        }
    ),
    "state": _object(
        {
            "time": {**_NUMBER, "description": "plant seconds"},
            "state": _by_name(_MEASUREMENT, "measurements by the name of their variable"),
            "operator": {"type": "string", "enum": ["run", "pause", "stop"]},
            "running": _object(_PROGRESS, _OPTIONAL_PROGRESS, "running or latest plan", or_null=True),
            "plans": _TEXTS,
            "waiting_for_approval": _TEXTS,
        }
    ),
    "propose_plan": _object(
        {
            "accepted": _TRUTH,
            "plan": {**_TEXT_OR_NULL, "description": "id for execute_plan; null if it is not accepted"},
            "problems": _TEXTS,
            "task": _TEXT,
            "goal": _TEXT,
            "judged_from": _VALUES,
        }
    ),
    "execute_plan": _EXECUTED,
    "pause": _object({"status": _TEXT}),
    "stop": _object({"status": _TEXT}),
    "resume": _object({"status": _TEXT, "operator": _OPERATOR}, optional=("operator",)),
}
"""By tool, the JSON Schema of its structured result."""


def pending_result(plan: str, request: str, *, user_may_approve: bool) -> dict[str, Any]:
    """Return the result of an execution that waits for approval.

    Args:
        plan: Id of the plan.
        request: Id of the request for approval.
        user_may_approve: True if the site accepts a yes of the client's user.

    Returns:
        JSON values, as `OUTPUT_SCHEMAS` describes them.
    """
    return {
        "status": _PENDING,
        "plan": plan,
        "operator": f"aeros approve {request}",
        "user_may_approve": user_may_approve,
    }


def execution_result(running: PlanExecution) -> dict[str, Any]:
    """Return the result of a plan in execution, or after it.

    Args:
        running: The execution.

    Returns:
        JSON values, as `OUTPUT_SCHEMAS` describes them.
    """
    if not running.ended.is_set():
        done, latest = running.progress
        counted = {"steps_done": done, "steps_total": running.step_count, "latest": latest}
        return {"status": "executing", "plan": running.plan, **counted}
    report = running.report
    if report is None:
        return {"status": "failed", "plan": running.plan, "reason": running.failure}
    steps = [
        {"skill": f"{s.module}.{s.skill}", "status": s.status.value, "outcome": s.outcome, "reason": s.reason}
        for s in report.steps
    ]
    is_cancelled = running.cancel_reason is not None and not report.reached
    ended = "goal reached" if report.reached else "goal not reached"
    return {
        "status": "cancelled" if is_cancelled else ended,
        "plan": running.plan,
        "reason": running.cancel_reason if is_cancelled else report.reason,
        "measured": dict(report.measured),
        "steps": steps,
    }
