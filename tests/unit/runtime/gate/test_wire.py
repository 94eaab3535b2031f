"""Requests as JSON lines: every line gets one decision."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.gate.explain import Explainer
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.gate.wire import MAX_LINE, decide_line, decision_json, explain_line, request_json
from tests.unit.runtime.bench import NOW, STATE, codes, gate, request, unproved


def allowed() -> dict[str, Any]:
    return request_json(request().action, STATE, NOW, inputs={}, usage={})


def decide(line: bytes | str | dict[str, Any], skill: str = "quickly") -> Decision:
    text = json.dumps(line) if isinstance(line, dict) else line
    raw = text.encode() if isinstance(text, str) else text
    decision = decide_line(gate(), "handling", skill, raw)
    assert json.loads(json.dumps(decision_json(decision)))["verdict"] == decision.kind.value
    return decision


def denied(line: bytes | str | dict[str, Any]) -> list[tuple[str, str]]:
    decision = decide(line)
    assert decision.kind is DecisionKind.DENY
    return codes(decision)


def text(change: Callable[[dict[str, Any]], Any]) -> str:
    asked = allowed()
    change(asked)
    return json.dumps(asked)


@pytest.mark.parametrize("mode", list(GateMode))
def test_a_request_is_decided_as_it_would_be_in_python(mode: GateMode) -> None:
    for asked in (request(), request(speed=0.5, human_distance=1.0), request(stop_pressed=True)):
        state = {name: reading.value for name, reading in asked.readings.items()}
        line = json.dumps(request_json(asked.action, state, NOW, usage={"carry-rate": 0})).encode()
        assert decide_line(gate(mode), "handling", "quickly", line) == asked.decided_by(gate(mode))


def test_usage_and_inputs_are_optional() -> None:
    asked = allowed()
    del asked["usage"], asked["inputs"]
    assert decide(asked).kind is DecisionKind.ALLOW


def test_a_decision_as_json_has_verdict_action_and_reasons() -> None:
    assert decision_json(decide(allowed())) == {
        "verdict": "ALLOW",
        "action": {"kind": "move", "parameters": {"target": (0.25, 0.125, 0.25), "speed": 0.0625}},
        "reasons": [],
    }
    assert decision_json(decide(text(lambda asked: asked["state"].pop("hand")))) == {
        "verdict": "DENY",
        "action": None,
        "reasons": [{"code": "AE703", "rule": "hand", "text": "`hand` is not measured"}],
    }


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b" ",
        b"{",
        b"null",
        b"[]",
        b"3",
        b'"move"',
        b"[" * 100_000,
        b"[" * 100_000 + b"]" * 100_000,
        b'{"a":' * 100_000 + b"1" + b"}" * 100_000,
        b"\xff\xfe",
        b'{"time": "\xc3\x28"}',
        b"\xef\xbb\xbf" + json.dumps(allowed()).encode(),
        json.dumps(allowed()).encode("utf-16"),
        json.dumps(allowed()).encode() + b" {}",
        b"1" * 5_000,
        b" " * (2 << 20),
        json.dumps({**allowed(), "padding": "x" * (2 << 20)}).encode(),
    ],
    ids=lambda line: repr(line[:12]) + f" of {len(line)}",
)
def test_a_malformed_line_is_denied(line: bytes) -> None:
    assert denied(line) == [("AE701", "request")]


def test_the_longest_request_is_still_read() -> None:
    line = json.dumps(allowed()).encode()
    padded = line + b" " * (MAX_LINE - len(line))
    assert decide(padded).kind is DecisionKind.ALLOW
    assert denied(padded + b" ") == [("AE701", "request")]


@pytest.mark.parametrize("field", ["time", "state", "hand", "value", "speed"])
def test_a_key_that_is_given_twice_is_denied(field: str) -> None:
    line = json.dumps(allowed()).replace(f'"{field}": ', f'"{field}": 0, "{field}": ', 1)
    assert denied(line) == [("AE701", field)]


@pytest.mark.parametrize("literal", ["NaN", "Infinity", "-Infinity", "1e999", "-1e999", "1" + "0" * 400])
@pytest.mark.parametrize("where", ["speed", "human_distance", "dirt", "time"])
def test_a_number_that_is_not_finite_is_denied(where: str, literal: str) -> None:
    asked = allowed()
    if where == "time":
        asked["time"] = "@"
    elif where == "speed":
        asked["action"]["parameters"]["speed"] = "@"
    else:
        asked["state"][where]["value"] = "@"
    assert denied(json.dumps(asked).replace('"@"', literal)) == [("AE704", where)]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda asked: asked.update(urgent=True), ("AE702", "urgent")),
        (lambda asked: asked["action"].update(force=1), ("AE702", "force")),
        (lambda asked: asked["state"]["hand"].update(frame="W"), ("AE702", "frame")),
        (lambda asked: asked["action"]["parameters"].update(force=1), ("AE702", "force")),
        (lambda asked: asked["inputs"].update(limit=1), ("AE702", "inputs.limit")),
        (lambda asked: asked["state"].update(mood={"value": 1, "time": NOW}), ("AE702", "mood")),
        (lambda asked: asked.pop("time"), ("AE703", "time")),
        (lambda asked: asked.pop("action"), ("AE703", "action")),
        (lambda asked: asked["action"].pop("parameters"), ("AE703", "parameters")),
        (lambda asked: asked["state"]["dirt"].pop("time"), ("AE703", "time")),
        (lambda asked: asked.update(state=[]), ("AE701", "state")),
        (lambda asked: asked.update(state=None), ("AE701", "state")),
        (lambda asked: asked.update(usage=[]), ("AE701", "usage")),
        (lambda asked: asked.update(inputs=None), ("AE701", "inputs")),
        (lambda asked: asked["action"].update(kind=None), ("AE701", "kind")),
        (lambda asked: asked["action"].update(parameters=[]), ("AE701", "parameters")),
        (lambda asked: asked["state"].update(hand=[0, 0, 0]), ("AE701", "hand")),
        (lambda asked: asked["state"]["hand"].update(value={"x": 0}), ("AE704", "hand")),
        (lambda asked: asked["state"]["hand"].update(value=[[0], 0, 0]), ("AE704", "hand")),
        (lambda asked: asked["state"]["hand"].update(time=None), ("AE704", "hand")),
        (lambda asked: asked.update(time="now"), ("AE704", "time")),
        (lambda asked: asked["action"].update(kind="fly\ud800", parameters={}), ("AE702", "fly\ud800")),
    ],
)
def test_a_request_is_read_strictly(change: Callable[[dict[str, Any]], Any], reason: tuple[str, str]) -> None:
    assert denied(text(change)) == [reason]


def test_a_very_long_name_is_cut_in_the_report() -> None:
    (reason,) = decide(text(lambda asked: asked.update({"n" * 500_000: 1}))).reasons
    assert reason == Reason("AE702", "n" * 100, f"`{'n' * 100}` is not a field of `request`")
    name = "n" * 500_000
    (reason,) = decide(f'{{"{name}": 1, "{name}": 2}}').reasons
    assert reason == Reason("AE701", "n" * 100, f"`{'n' * 100}` is given twice")


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b" " * (MAX_LINE + 1), "AE701 request: the request is longer than 1048576 bytes"),
        (b"\xff\xfe", "AE701 request: the request is not UTF-8"),
        (b"[" * 100_000, "AE701 request: the request is nested too deeply"),
        (
            b"{",
            "AE701 request: the request is not JSON: Expecting property name enclosed in double quotes: "
            "line 1 column 2 (char 1)",
        ),
        (b"[]", "AE701 request: `request` is not an object with action, state, time, usage, inputs"),
        (b'{"time": 0, "time": 1}', "AE701 time: `time` is given twice"),
        (b'{"urgent": 0}', "AE702 urgent: `urgent` is not a field of `request`"),
        (b'{"action": {}}', "AE703 state: `request` has no `state`"),
        (b'{"action": {}, "state": []}', "AE701 state: `state` of `request` has the wrong type"),
        (b'{"action": {}, "state": {}, "time": 0}', "AE703 kind: `action` has no `kind`"),
        (
            b'{"action": {"kind": 1}, "state": {}, "time": 0}',
            "AE701 kind: `kind` of `action` has the wrong type",
        ),
        (
            b'{"action": {"kind": "move", "parameters": {}}, "state": {"hand": 1}, "time": 0}',
            "AE701 hand: `hand` is not an object with value, time",
        ),
        (
            b'{"action": {"kind": "move", "parameters": {}}, "state": {"hand": {"value": 1}}, "time": 0}',
            "AE703 time: `hand` has no `time`",
        ),
        (
            b'{"action": {"kind": "move", "parameters": {}}, "state": {"hand": {"frame": 1}}, "time": 0}',
            "AE702 frame: `frame` is not a field of `hand`",
        ),
    ],
)
def test_the_reason_names_the_field_and_its_fault(line: bytes, reason: str) -> None:
    (found,) = decide(line).reasons
    assert f"{found.code} {found.rule}: {found.text}" == reason


def test_an_explanation_of_a_malformed_line_has_its_reason() -> None:
    explainer = Explainer(unproved(), GateMode.COMPILED)
    found = explain_line(explainer, "handling", "quickly", b"[]")
    assert found.decision == decide(b"[]")
    assert found.conditions == ()


def test_usage_and_inputs_of_a_line_reach_the_gate() -> None:
    used = {**allowed(), **request_json(request(kind="carry").action, STATE, NOW, usage={"carry-rate": 3})}
    assert codes(decide(used)) == [("AE742", "carry-rate")]
    line = {**used, "usage": {"carry-rate": 0}, "inputs": {"tool": "brush"}}
    assert decide(line, "paced").kind is DecisionKind.ALLOW
    assert codes(decide({**line, "inputs": {}}, "paced")) == [("AE703", "inputs.tool")]
    explained = explain_line(
        Explainer(unproved(), GateMode.COMPILED), "handling", "paced", json.dumps(line).encode()
    )
    assert explained.decision.kind is DecisionKind.ALLOW
