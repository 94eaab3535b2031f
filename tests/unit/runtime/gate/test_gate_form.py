"""AE701 to AE707: malformed requests, missing values and invalid values are denied."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import inf, nan, nextafter
from typing import Any

import pytest

from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.ports import Reading
from aeros.skill import Action
from tests.unit.runtime.bench import NOW, denied, gate, measured, request, without


@pytest.mark.parametrize(
    ("broken", "rule"),
    [
        ({"caller": None}, "caller"),
        ({"caller": ("handling", "quickly", {})}, "caller"),
        ({"caller": Caller(1, "quickly", {})}, "caller"),  # type: ignore[arg-type]
        ({"caller": Caller("handling", None, {})}, "caller"),  # type: ignore[arg-type]
        ({"caller": object.__new__(Caller)}, "caller"),
        ({"caller": Caller("handling", "quickly", None)}, "inputs"),  # type: ignore[arg-type]
        ({"action": None}, "action"),
        ({"action": ("move", {})}, "action"),
        ({"action": Action(None, {})}, "action"),  # type: ignore[arg-type]
        ({"action": tuple.__new__(Action, ())}, "action"),
        ({"action": tuple.__new__(Action, ("move", {}, 1))}, "action"),
        ({"action": Action("move", None)}, "parameters"),  # type: ignore[arg-type]
        ({"action": Action("move", {1: 2})}, "parameters"),  # type: ignore[dict-item]
        ({"readings": []}, "state"),
        ({"readings": {b"load": Reading(1.0, NOW)}}, "state"),
        ({"usage": None}, "usage"),
    ],
)
def test_a_malformed_request_is_denied(broken: dict[str, Any], rule: str) -> None:
    assert denied(replace(request(), **broken)) == [("AE701", rule)]


@pytest.mark.parametrize("reading", [3.0, None, (3.0, NOW), {"value": 3.0, "time": NOW}])
def test_a_value_without_a_time_is_malformed(reading: Any) -> None:
    asked = request()
    assert denied(replace(asked, readings={**asked.readings, "load": reading})) == [("AE701", "load")]


def test_a_reading_with_nothing_in_it_is_denied() -> None:
    asked = request()
    broken = {**asked.readings, "load": tuple.__new__(Reading)}
    assert denied(replace(asked, readings=broken)) == [("AE701", "load")]


def test_unknown_names_are_denied_in_every_field() -> None:
    asked = request()
    caller = replace(asked.caller, inputs={"limit": 0.1})
    action = Action("move", {**asked.action.parameters, "haste": 1.0})
    asked = replace(asked, caller=caller, action=action, readings=asked.readings | measured({"mood": 1.0}))
    assert denied(asked) == [("AE702", "haste"), ("AE702", "inputs.limit"), ("AE702", "mood")]


def test_an_unknown_kind_is_denied() -> None:
    assert denied(replace(request(), action=Action("fly", {}))) == [("AE702", "fly")]
    assert denied(replace(request(), action=Action("Move", request().action.parameters))) == [
        ("AE702", "target"),
        ("AE702", "speed"),
        ("AE702", "Move"),
    ]


def test_a_missing_parameter_is_denied_and_rules_that_do_not_read_it_are_still_evaluated() -> None:
    asked = request(stop_pressed=True)
    asked = replace(asked, action=Action("move", {"speed": 0.1}))
    assert denied(asked) == [("AE703", "target"), ("AE750", "stop-button")]


def test_a_missing_input_is_denied_and_one_with_a_default_is_not() -> None:
    asked = request("paced", "carry")
    assert asked.caller.inputs == {"tool": "brush"}
    assert denied(replace(asked, caller=Caller("handling", "paced", {"limit": 0.05}))) == [
        ("AE703", "inputs.tool")
    ]


@pytest.mark.parametrize("name", ["human_distance", "stop_pressed", "fitted", "hand"])
def test_variables_that_a_rule_reads_must_be_measured(name: str) -> None:
    assert denied(without(request(), name)) == [("AE703", name)]


@pytest.mark.parametrize("name", ["dirt", "load", "wind", "gust", "joint_angle", "joint_ready"])
def test_variables_that_no_rule_on_the_kind_reads_need_not_be_measured(name: str) -> None:
    assert without(request(), name).decided_by(gate()).kind is DecisionKind.ALLOW


def test_variables_that_only_the_envelope_reads_must_be_measured_and_fresh() -> None:
    asked = request("slowly", "carry")
    assert denied(without(asked, "wind")) == [("AE703", "wind")]
    old = {**asked.readings, "wind": Reading(0.0, NOW - 1.5)}
    assert denied(replace(asked, readings=old)) == [("AE706", "wind")]
    assert without(request("quickly", "carry"), "wind").decided_by(gate()).kind is DecisionKind.ALLOW


def test_variables_that_only_an_attenuation_reads_must_be_measured() -> None:
    assert denied(without(request("quickly", "sweep", wind=2.0, pace=3.0), "gust")) == [
        ("AE703", "gust"),
        ("AE750", "windy-sweep"),
    ]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("speed", True),
        ("speed", "0.1"),
        ("speed", None),
        ("speed", nan),
        ("speed", inf),
        ("speed", 2**53 + 1),
        ("speed", Fraction(1, 10)),
        ("target", (0.25, 0.125)),
        ("target", (0.25, 0.125, 0.25, 0.25)),
        ("target", (0.25, 0.125, True)),
        ("target", {"x": 0.25, "y": 0.125, "z": 0.25}),
        ("target", 0.25),
        ("human_distance", -inf),
        ("stop_pressed", 0),
        ("stop_pressed", None),
        ("fitted", "Brush"),
        ("fitted", 0),
        ("joint_ready", (True, 1)),
        ("joint_angle", (0.0,)),
        ("dirt", nan),
    ],
)
def test_a_value_of_the_wrong_type_is_denied(name: str, value: Any) -> None:
    assert denied(request(**{name: value})) == [("AE704", name)]


@pytest.mark.parametrize("time", [None, nan, inf, "100", True, 10**400, 1e300, Fraction(100)])
def test_an_invalid_time_is_denied(time: Any) -> None:
    asked = request()
    assert denied(replace(asked, now=time)) == [("AE704", "time")]
    of_reading = {**asked.readings, "dirt": Reading(0.5, time)}
    assert denied(replace(asked, readings=of_reading)) == [("AE704", "dirt")]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("speed", nextafter(5.0, inf)),
        ("speed", -5e-324),
        ("target", (0.25, 2.0000001, 0.25)),
        ("human_distance", 20.1),
        ("human_distance", -5e-324),
        ("joint_angle", (0.0, 4.5)),
        ("dirt", 50.0),
    ],
)
def test_a_value_outside_its_range_is_denied(name: str, value: Any) -> None:
    assert denied(request(**{name: value})) == [("AE705", name)]


def test_a_required_value_is_denied_exactly_when_older_than_its_max_age() -> None:
    asked = request()
    oldest = NOW - 0.1  # 99.9 as a double is above the rational, so its age is below 1/10
    for time, verdict in ((oldest, DecisionKind.ALLOW), (nextafter(oldest, 0.0), DecisionKind.DENY)):
        assert (Fraction(NOW) - Fraction(time) <= Fraction(1, 10)) == (verdict is DecisionKind.ALLOW)
        aged = replace(asked, readings={**asked.readings, "human_distance": Reading(3.0, time)})
        assert aged.decided_by(gate()).kind is verdict
    assert denied(aged) == [("AE706", "human_distance")]


def test_a_value_that_no_rule_reads_may_be_old() -> None:
    asked = request()
    old = {**asked.readings, "dirt": Reading(0.5, -1e6), "load": Reading(1.0, 0)}
    assert replace(asked, readings=old).decided_by(gate()).kind is DecisionKind.ALLOW


@pytest.mark.parametrize("name", ["human_distance", "dirt"])
def test_a_value_from_the_future_is_denied_even_if_no_rule_reads_it(name: str) -> None:
    asked = request()
    early = Reading(asked.readings[name].value, nextafter(NOW, inf))
    assert denied(replace(asked, readings={**asked.readings, name: early})) == [("AE707", name)]


def test_the_greatest_possible_age_is_too_old() -> None:
    asked = request()
    far = {**asked.readings, "hand": Reading((0.0, 0.0, 0.0), float(-(2**53)))}
    assert ("AE706", "hand") in denied(replace(asked, readings=far, now=2.0**53))
