"""Requests and decisions as JSON lines: the gate's interface outside Python.

Requests are parsed strictly: no duplicate key, no unknown field, no missing field. A malformed line is denied
like any other request, with a reason.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.gate.explain import EvaluatedCondition, Explainer, Explanation, explain_malformed_request
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import Reading
from aeros.skill import Action

MAX_LINE = 1 << 20
"""Greatest length of one request in bytes: far beyond any real one, far below the size of memory."""

_FIELDS = {"action": dict, "state": dict, "time": object, "usage": dict, "inputs": dict}
_OPTIONAL = ("usage", "inputs")


class _MalformedRequestError(Exception):
    """The line is not a request; carries the field and its fault."""

    def __init__(self, field: str, text: str, code: str = "AE701") -> None:
        self.reason = Reason(code, field, text)


def decide_line(gate: Gate, module: str, skill: str, line: bytes) -> Decision:
    """Decide the request on one line of JSON.

    Args:
        gate: the gate that decides.
        module: the module that asks.
        skill: its skill that asks.
        line: the request as UTF-8.

    Returns:
        The decision; DENY with the reason if the line is malformed.
    """
    try:
        request = _request(module, skill, line)
    except _MalformedRequestError as fault:
        return Decision(DecisionKind.DENY, None, (fault.reason,))
    return gate.decide(*request)


def explain_line(explainer: Explainer, module: str, skill: str, line: bytes) -> Explanation:
    """Decide the request on one line of JSON, and explain the decision.

    Args:
        explainer: the explainer of the configuration's gate.
        module: the module that asks.
        skill: its skill that asks.
        line: the request as UTF-8.

    Returns:
        The explanation; a denial with the reason if the line is malformed.
    """
    try:
        request = _request(module, skill, line)
    except _MalformedRequestError as fault:
        return explain_malformed_request(Decision(DecisionKind.DENY, None, (fault.reason,)))
    return explainer.explain(*request)


def decision_json(decision: Decision) -> dict[str, Any]:
    """Convert a decision to JSON data.

    Args:
        decision: the decision.

    Returns:
        `verdict`, the `action` that may be executed or None, and `reasons`.
    """
    action = decision.action
    return {
        "verdict": decision.kind.value,
        "action": None if action is None else {"kind": action.kind, "parameters": dict(action.parameters)},
        "reasons": [
            {"code": reason.code, "rule": reason.rule, "text": reason.text} for reason in decision.reasons
        ],
    }


def explanation_json(explanation: Explanation) -> dict[str, Any]:
    """Convert an explanation to JSON data.

    Args:
        explanation: the explanation.

    Returns:
        The fields of `decision_json`, with `layers` and every condition on the action.
    """
    data = {
        **decision_json(explanation.decision),
        "layers": dict(explanation.layers),
        "conditions": [_condition_json(condition) for condition in explanation.conditions],
    }
    if explanation.attenuated_parameters:
        data["conditions_after_attenuation"] = [
            _condition_json(condition) for condition in explanation.attenuated_parameters
        ]
    return data


def _condition_json(clause: EvaluatedCondition) -> dict[str, Any]:
    return {
        "name": clause.name,
        "text": clause.text,
        "proved_by": clause.obligation,
        "evaluated": clause.holds is not None,
        "holds": clause.holds,
        "values": dict(clause.values),
        "missing": list(clause.missing),
    }


def request_json(action: Action, state: Mapping[str, Any], time: float, **rest: Any) -> dict[str, Any]:
    """Make a request as JSON data.

    Args:
        action: the requested action.
        state: the value of each state variable, by name, SI.
        time: time of the request and of every measurement, s.
        rest: further fields, such as `usage` and `inputs`.

    Returns:
        The request, which `decide_line` accepts as a line of JSON.
    """
    return {
        "time": time,
        "action": {"kind": action.kind, "parameters": dict(action.parameters)},
        "state": {name: {"value": value, "time": time} for name, value in state.items()},
        **rest,
    }


class _Request(NamedTuple):
    """Arguments of `Gate.decide`, in its order."""

    caller: Caller
    readings: dict[str, Reading]
    action: Action
    now: Any
    usage: Any


def _request(module: str, skill: str, line: bytes) -> _Request:
    request = _parse(line)
    action = _action(request["action"])
    state = {name: _reading(name, value) for name, value in request["state"].items()}
    caller = Caller(module, skill, request.get("inputs", {}))
    return _Request(caller, state, action, request["time"], request.get("usage", {}))


def _parse(line: bytes) -> dict[str, Any]:
    if len(line) > MAX_LINE:
        raise _MalformedRequestError("request", f"the request is longer than {MAX_LINE} bytes")
    try:
        request = json.loads(line.decode(), object_pairs_hook=_reject_duplicate_keys)
    except UnicodeDecodeError:
        raise _MalformedRequestError("request", "the request is not UTF-8") from None
    except RecursionError:
        raise _MalformedRequestError("request", "the request is nested too deeply") from None
    except ValueError as error:
        raise _MalformedRequestError("request", f"the request is not JSON: {error}") from None
    _check_fields(request, _FIELDS, _OPTIONAL, "request")
    return dict(request)


def _reject_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for key, value in pairs:
        if key in fields:
            raise _MalformedRequestError(key[:100], f"`{key[:100]}` is given twice")
        fields[key] = value
    return fields


def _action(value: dict[str, Any]) -> Action:
    _check_fields(value, {"kind": str, "parameters": dict}, (), "action")
    return Action(value["kind"], value["parameters"])


def _reading(name: str, value: Any) -> Reading:
    _check_fields(value, {"value": object, "time": object}, (), name)
    return Reading(value["value"], value["time"])


def _check_fields(value: Any, fields: Mapping[str, type], optional: tuple[str, ...], where: str) -> None:
    if type(value) is not dict:
        raise _MalformedRequestError(where, f"`{where}` is not an object with {', '.join(fields)}")
    for name in value:
        if name not in fields:
            raise _MalformedRequestError(name[:100], f"`{name[:100]}` is not a field of `{where}`", "AE702")
    for name, type_ in fields.items():
        if name not in value:
            if name not in optional:
                raise _MalformedRequestError(name, f"`{where}` has no `{name}`", "AE703")
        elif not isinstance(value[name], type_):
            raise _MalformedRequestError(name, f"`{name}` of `{where}` has the wrong type")
