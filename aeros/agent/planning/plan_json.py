"""Plans as JSON, for people and programs, with a strict reader for untrusted input.

    plan ::= [part, …]
    part ::= {"skill": "MODULE.SKILL", "inputs": {…}, "retry": 0,
              "between_tries": "SKILL" or null; it runs before each repetition of a failed step,
              "on_failure": "SKILL" or null; it runs when the last repetition has failed,
              "unless": "CONDITION"; the step is skipped if it is measured as true at its turn}
           | {"if": "CONDITION", "then": plan, "else": plan or null} | {"seq": plan}

SKILL is one of the same module, or MODULE.SKILL. Both run with default inputs.

The reader accepts this form only. An unknown key, a number instead of text, or a condition that is not one
over the site's vocabulary is refused with its place. `verify_plan` decides if the plan may start.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from aeros.agent.planning.task_graph import PLAN_SPAN, Part, PlanStep, TaskGraph
from aeros.agent.world.values import to_json_value
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.elaborate.scopes import argument_scope
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import ExpressionSyntaxError, parse
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.site import Site
from aeros.spec.model.step_graph import MAX_DEPTH, MAX_STEPS, If, Seq

_MAX_TEXT_CHARS: Final = 2000


class MalformedPlanError(Exception):
    """Input that is not a plan; the message says where and why."""


def plan_to_json(graph: TaskGraph) -> list[dict[str, Any]]:
    """Convert a plan to JSON values.

    Args:
        graph: plan without parallel branches and flows, whose failures lead to steps with default inputs.

    Returns:
        The list of its parts.
    """
    return [_part_to_json(part) for part in graph.parts]


def _part_to_json(part: Part) -> dict[str, Any]:
    match part:
        case PlanStep():
            inputs = {name: to_json_value(value) for name, value in part.inputs.items()}
            skill = f"{part.module}.{part.skill}"
            form: dict[str, Any] = {"skill": skill, "inputs": inputs, "retry": part.retry}
            form |= {"between_tries": None, "on_failure": None}
            form |= {word: part.helper_name(helper) for word, helper in part.helpers}
            return form if part.unless is None else {**form, "unless": unparse(part.unless)}
        case If(text=text, then=then, otherwise=otherwise):
            other = None if otherwise is None else _parts_to_json(otherwise)
            return {"if": text, "then": _parts_to_json(then), "else": other}
        case Seq():
            return {"seq": _parts_to_json(part)}
        case _:
            raise InternalError("a plan with parallel branches or alternatives has no JSON form")


def _parts_to_json(part: Part) -> list[dict[str, Any]]:
    return [_part_to_json(one) for one in part.parts] if isinstance(part, Seq) else [_part_to_json(part)]


def parse_strict_json(text: str | bytes) -> Any:
    """Parse JSON strictly.

    Args:
        text: JSON text.

    Returns:
        The JSON values.

    Raises:
        MalformedPlanError: it is not JSON, an object has a key twice, or a number is not finite.
    """
    try:
        return json.loads(text, object_pairs_hook=_reject_duplicate_keys, parse_constant=_reject_non_finite)
    except (ValueError, RecursionError) as error:
        raise MalformedPlanError(f"it is not JSON: {error}") from error


def _reject_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise MalformedPlanError("an object has a key twice")
    return found


def _reject_non_finite(name: str) -> float:
    raise MalformedPlanError(f"{name} is not a number")


def plan_from_json(data: Any, site: Site) -> TaskGraph:
    """Read a plan from JSON values.

    Args:
        data: JSON values, untrusted.
        site: site whose vocabulary the conditions use.

    Returns:
        The plan, not verified yet.

    Raises:
        MalformedPlanError: it does not have the form of a plan.
    """
    return TaskGraph(_PlanReader(site).parts(data, "plan", 0))


class _PlanReader:
    """Reader of one plan with a bounded number of parts."""

    def __init__(self, site: Site) -> None:
        self._scope = argument_scope(site)
        self._left = 2 * MAX_STEPS

    def parts(self, form: Any, place: str, level: int) -> tuple[Part, ...]:
        if type(form) is not list:
            raise MalformedPlanError(f"`{place}` is not a list of steps")
        if level > MAX_DEPTH:
            raise MalformedPlanError(f"`{place}` is nested more than {MAX_DEPTH} deep")
        return tuple(self._part(one, f"{place}[{at}]", level) for at, one in enumerate(form))

    def _part(self, form: Any, place: str, level: int) -> Part:
        self._left -= 1
        if self._left < 0:
            raise MalformedPlanError(f"it has more than {2 * MAX_STEPS} parts")
        if type(form) is not dict:
            raise MalformedPlanError(f"`{place}` is not an object")
        if "if" in form:
            return self._if(form, place, level)
        if "seq" in form:
            _reject_unknown_keys(form, {"seq"}, place)
            return Seq(self.parts(form["seq"], f"{place}.seq", level + 1))
        return self._step(form, place)

    def _step(self, form: Mapping[str, Any], place: str) -> PlanStep:
        known = {"skill", "inputs", "retry", "between_tries", "on_failure", "unless"}
        _reject_unknown_keys(form, known, place)
        module, dot, skill = _read_text(form, "skill", place).partition(".")
        if not dot:
            raise MalformedPlanError(f"`{place}.skill` is not of the form MODULE.SKILL")
        inputs, retry = form.get("inputs", {}), form.get("retry", 0)
        if type(inputs) is not dict:
            raise MalformedPlanError(f"`{place}.inputs` is not an object")
        if type(retry) is not int:
            raise MalformedPlanError(f"`{place}.retry` is not a whole number")
        between, last = (_helper(form, key, module, place) for key in ("between_tries", "on_failure"))
        unless = None if form.get("unless") is None else self._condition(form, "unless", place)
        return PlanStep(module, skill, inputs, retry, between, last, unless)

    def _if(self, form: Mapping[str, Any], place: str, level: int) -> Part:
        _reject_unknown_keys(form, {"if", "then", "else"}, place)
        condition = self._condition(form, "if", place)
        then = Seq(self.parts(form.get("then"), f"{place}.then", level + 1))
        other = form.get("else")
        otherwise = None if other is None else Seq(self.parts(other, f"{place}.else", level + 1))
        return If(condition, form["if"], then, otherwise, PLAN_SPAN)

    def _condition(self, form: Mapping[str, Any], key: str, place: str) -> t.Term:
        try:
            return check(parse(_read_text(form, key, place)), self._scope, BOOL)
        except (ExpressionSyntaxError, ExpressionTypeError) as fault:
            raise MalformedPlanError(f"`{place}.{key}` is not a condition: {fault.message}") from fault


def _helper(form: Mapping[str, Any], key: str, module: str, place: str) -> PlanStep | None:
    """Read a step that a failure leads to: a skill of `module`, or MODULE.SKILL."""
    if form.get(key) is None:
        return None
    of, dot, skill = _read_text(form, key, place).rpartition(".")
    return PlanStep(of if dot else module, skill)


def _reject_unknown_keys(form: Mapping[str, Any], known: set[str], place: str) -> None:
    unknown = sorted(form.keys() - known)
    if unknown:
        raise MalformedPlanError(f"`{place}` has a key that no plan has: {json.dumps(unknown[0][:80])}")


def _read_text(form: Mapping[str, Any], key: str, place: str) -> str:
    text = form.get(key)
    if type(text) is not str or len(text) > _MAX_TEXT_CHARS:
        raise MalformedPlanError(f"`{place}.{key}` is not a text of at most {_MAX_TEXT_CHARS} characters")
    return text
