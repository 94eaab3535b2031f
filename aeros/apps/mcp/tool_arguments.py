"""Arguments of tools, as an untrusted client gives them: of the right form and size, or refused."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

from aeros.apps.report_page.run_data import shortened
from aeros.spec.diagnostics.codes import did_you_mean

MOST_BYTES: Final = 65_536
_MOST_LEVELS: Final = 8
_LONGEST_TEXT: Final = 1_000
LONGEST_WAIT: Final = 300.0


class RefusedCallError(Exception):
    """A tool does not do what was asked; the message says why."""


@dataclass(frozen=True, slots=True)
class AskedStep:
    """A step that a client proposes: MODULE.SKILL and its inputs, JSON values."""

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
        "goal": {"type": "string", "description": "a condition over the state; the task's goal if absent"},
    },
    "execute_plan": {
        "plan": {"type": "string", "description": "what propose_plan called it"},
        "wait": {
            "type": "number",
            "minimum": 0,
            "maximum": LONGEST_WAIT,
            "description": "seconds to wait for its end; 0 if absent",
        },
    },
    "pause": {},
    "stop": {},
    "resume": {},
}
"""By tool, its arguments, each as a JSON Schema."""

REQUIRED: Final = {"propose_plan": ["steps"], "execute_plan": ["plan"]}


def schema_of(tool: str) -> dict[str, Any]:
    """The JSON Schema of a tool's arguments."""
    return {
        "type": "object",
        "properties": dict(SCHEMAS[tool]),
        "required": REQUIRED.get(tool, []),
        "additionalProperties": False,
    }


def check_call(tool: str, arguments: Mapping[str, Any]) -> None:
    """That there is such a tool and it has such arguments.  Raises `RefusedCallError`."""
    if tool not in SCHEMAS:
        raise RefusedCallError(f"there is no tool `{_shown(tool)}`{_meant(tool, SCHEMAS)}")
    _check_names("argument", arguments, SCHEMAS[tool], REQUIRED.get(tool, ()))
    for text in _unusable(dict(arguments), 0):
        raise RefusedCallError(text)
    if len(json.dumps(arguments, default=str)) > MOST_BYTES:
        raise RefusedCallError(f"the arguments are larger than {MOST_BYTES} bytes")


def steps_in(arguments: Mapping[str, Any], most: int) -> tuple[AskedStep, ...]:
    """The steps that are proposed, at most so many.  Raises `RefusedCallError`."""
    steps = arguments["steps"]
    if type(steps) is not list or not steps:
        raise RefusedCallError("`steps` is a list of at least one step")
    if len(steps) > most:
        raise RefusedCallError(f"the plan has {len(steps)} steps; this site allows {most}")
    return tuple(_step(number, step) for number, step in enumerate(steps, 1))


def text_in(arguments: Mapping[str, Any], name: str) -> str | None:
    """The text of that name, if it is given.  Raises `RefusedCallError`."""
    text = arguments.get(name)
    if text is not None and type(text) is not str:
        raise RefusedCallError(f"`{name}` is a text")
    return text


def seconds_in(arguments: Mapping[str, Any], name: str) -> float:
    """The seconds of that name, 0 if they are not given.  Raises `RefusedCallError`."""
    seconds = arguments.get(name, 0.0)
    if type(seconds) not in (int, float) or not 0.0 <= seconds <= LONGEST_WAIT:
        raise RefusedCallError(f"`{name}` is a number of seconds from 0 to {LONGEST_WAIT:g}")
    return float(seconds)


def _step(number: int, step: Any) -> AskedStep:
    where = f"step {number}"
    if type(step) is not dict:
        raise RefusedCallError(f"{where} is not an object with a `skill`")
    try:
        _check_names("field", step, _STEP["properties"], ("skill",))  # type: ignore[arg-type]
    except RefusedCallError as error:
        raise RefusedCallError(f"{where}: {error}") from None
    skill, inputs = step["skill"], step.get("inputs", {})
    if type(skill) is not str or type(inputs) is not dict:
        raise RefusedCallError(f"{where}: `skill` is a text, and `inputs` an object")
    return AskedStep(skill, inputs)


def _check_names(what: str, given: Mapping[str, Any], known: Mapping[str, Any], required: Any) -> None:
    for name in given:
        if name not in known:
            raise RefusedCallError(f"there is no {what} `{_shown(name)}`{_meant(name, known)}")
    for name in required:
        if name not in given:
            raise RefusedCallError(f"the {what} `{name}` is missing")


def _unusable(value: Any, depth: int) -> Iterator[str]:
    """Why a value is none that JSON has, or is none that is looked at any further."""
    if depth > _MOST_LEVELS:
        yield f"the arguments are nested more than {_MOST_LEVELS} deep"
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
            if len(value) > _LONGEST_TEXT:
                yield f"a text is longer than {_LONGEST_TEXT} characters"
        case list():
            for part in value:
                yield from _unusable(part, depth + 1)
        case dict():
            for name, part in value.items():
                yield from _unusable(name, depth + 1)
                yield from _unusable(part, depth + 1)
        case _:
            yield f"a {type(value).__name__} is no JSON value"


def _meant(name: str, known: Mapping[str, Any]) -> str:
    near = did_you_mean(name[:_LONGEST_TEXT], known)
    return f"; did you mean `{near}`?" if near else ""


def _shown(name: object) -> str:
    return shortened(str(name), 80)
