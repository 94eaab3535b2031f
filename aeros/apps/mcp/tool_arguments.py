"""Arguments of MCP tools: parse what an untrusted client sends, and reject wrong forms and sizes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

from aeros.apps.report_page.run_data import shortened
from aeros.spec.diagnostics.codes import did_you_mean

MAX_BYTES: Final = 65_536
_MAX_DEPTH: Final = 8
_MAX_TEXT_CHARS: Final = 1_000
MAX_WAIT_S: Final = 300.0


class ToolCallError(Exception):
    """A rejected tool call; the message says why."""


@dataclass(frozen=True, slots=True)
class ProposedStep:
    """A step that a client proposes.

    Attributes:
        skill: Skill as MODULE.SKILL.
        inputs: Inputs by name, JSON values.
    """

    skill: str
    inputs: Mapping[str, Any]


_STEP: Final = {
    "type": "object",
    "properties": {
        "skill": {"type": "string", "description": "MODULE.SKILL, as list_skills names it"},
        "inputs": {"type": "object", "description": "the inputs that have no default, by name"},
    },
    "required": ["skill"],
    "additionalProperties": False,
}
SCHEMAS: Final[Mapping[str, Mapping[str, Any]]] = {
    "list_skills": {},
    "state": {},
    "propose_plan": {
        "steps": {"type": "array", "items": _STEP, "minItems": 1},
        "task": {
            "type": "string",
            "description": "the task, as in `make_dumplings.make_dumplings` or `make dumplings`; list_skills "
            "names all tasks. Its invariants hold, and its goal is reached unless `goal` says another. The "
            "server's own task if absent, if it has one",
        },
        "goal": {"type": "string", "description": "a condition over the state; the task's goal if absent"},
    },
    "execute_plan": {
        "plan": {"type": "string", "description": "id of the plan, as propose_plan returned it"},
        "wait": {
            "type": "number",
            "minimum": 0,
            "maximum": MAX_WAIT_S,
            "description": "seconds to wait for its end; 0 if absent",
        },
    },
    "pause": {},
    "stop": {},
    "resume": {},
}
"""By tool, its arguments, each as a JSON Schema."""

REQUIRED: Final = {"propose_plan": ["steps"], "execute_plan": ["plan"]}


def tool_schema(tool: str) -> dict[str, Any]:
    """Return the JSON Schema of a tool's arguments.

    Args:
        tool: Name of the tool, a key of `SCHEMAS`.

    Returns:
        The schema of an object without further properties.
    """
    return {
        "type": "object",
        "properties": dict(SCHEMAS[tool]),
        "required": REQUIRED.get(tool, []),
        "additionalProperties": False,
    }


def check_call(tool: str, arguments: Mapping[str, Any]) -> None:
    """Check that a tool exists and the arguments have its names, and a permitted size and depth.

    Args:
        tool: Name of the tool.
        arguments: The client's arguments.

    Raises:
        ToolCallError: There is no such tool, or an argument is unknown, missing, too large or no JSON value.
    """
    if tool not in SCHEMAS:
        raise ToolCallError(f"there is no tool `{_shortened(tool)}`{_suggestion(tool, SCHEMAS)}")
    _check_names("argument", arguments, SCHEMAS[tool], REQUIRED.get(tool, ()))
    for text in _value_problem(dict(arguments), 0):
        raise ToolCallError(text)
    if len(json.dumps(arguments, default=str)) > MAX_BYTES:
        raise ToolCallError(f"the arguments are larger than {MAX_BYTES} bytes")


def read_steps(arguments: Mapping[str, Any], max_count: int) -> tuple[ProposedStep, ...]:
    """Read the argument `steps`.

    Args:
        arguments: The client's arguments.
        max_count: Largest number of steps that the site allows.

    Returns:
        The proposed steps.

    Raises:
        ToolCallError: The value is not a list of 1 to `max_count` steps.
    """
    steps = arguments["steps"]
    if type(steps) is not list or not steps:
        raise ToolCallError("`steps` is a list of at least one step")
    if len(steps) > max_count:
        raise ToolCallError(f"the plan has {len(steps)} steps; this site allows {max_count}")
    return tuple(_step(number, step) for number, step in enumerate(steps, 1))


def read_text(arguments: Mapping[str, Any], name: str) -> str | None:
    """Read a string argument.

    Args:
        arguments: The client's arguments.
        name: Name of the argument.

    Returns:
        The string; None if it is absent.

    Raises:
        ToolCallError: The value is not a string.
    """
    text = arguments.get(name)
    if text is not None and type(text) is not str:
        raise ToolCallError(f"`{name}` must be a string")
    return text


def read_seconds(arguments: Mapping[str, Any], name: str) -> float:
    """Read an argument in seconds.

    Args:
        arguments: The client's arguments.
        name: Name of the argument.

    Returns:
        Seconds from 0 to `MAX_WAIT_S`; 0 if it is absent.

    Raises:
        ToolCallError: The value is not such a number.
    """
    seconds = arguments.get(name, 0.0)
    if type(seconds) not in (int, float) or not 0.0 <= seconds <= MAX_WAIT_S:
        raise ToolCallError(f"`{name}` is a number of seconds from 0 to {MAX_WAIT_S:g}")
    return float(seconds)


def _step(number: int, step: Any) -> ProposedStep:
    where = f"step {number}"
    if type(step) is not dict:
        raise ToolCallError(f"{where} is not an object with a `skill`")
    try:
        _check_names("field", step, _STEP["properties"], ("skill",))  # type: ignore[arg-type]
    except ToolCallError as error:
        raise ToolCallError(f"{where}: {error}") from None
    skill, inputs = step["skill"], step.get("inputs", {})
    if type(skill) is not str or type(inputs) is not dict:
        raise ToolCallError(f"{where}: `skill` must be a string, and `inputs` an object")
    return ProposedStep(skill, inputs)


def _check_names(what: str, given: Mapping[str, Any], known: Mapping[str, Any], required: Any) -> None:
    for name in given:
        if name not in known:
            raise ToolCallError(f"there is no {what} `{_shortened(name)}`{_suggestion(name, known)}")
    for name in required:
        if name not in given:
            raise ToolCallError(f"the {what} `{name}` is missing")


def _value_problem(value: Any, depth: int) -> Iterator[str]:
    """Yield the reasons why a value is rejected: it is not JSON, too large or nested too deep."""
    if depth > _MAX_DEPTH:
        yield f"the arguments are nested more than {_MAX_DEPTH} deep"
        return
    match value:
        case bool() | None:
            pass
        case int():
            if abs(value) > 2**53:
                yield "a whole number is larger than 2^53"
        case float():
            if not isfinite(value):
                yield "a number is not finite"
        case str():
            if len(value) > _MAX_TEXT_CHARS:
                yield f"a text is longer than {_MAX_TEXT_CHARS} characters"
        case list():
            for part in value:
                yield from _value_problem(part, depth + 1)
        case dict():
            for name, part in value.items():
                yield from _value_problem(name, depth + 1)
                yield from _value_problem(part, depth + 1)
        case _:
            yield f"{type(value).__name__} is not a JSON value"


def _suggestion(name: str, known: Mapping[str, Any]) -> str:
    near = did_you_mean(name[:_MAX_TEXT_CHARS], known)
    return f"; did you mean `{near}`?" if near else ""


def _shortened(name: object) -> str:
    return shortened(str(name), 80)
