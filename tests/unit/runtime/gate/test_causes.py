"""Causes of denials: the condition, its place in a file, the measured values, and the bound."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from aeros.runtime.gate.causes import denial_causes, stop_cause
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.gate.violation import MotionDeviation, RuleViolation
from aeros.skill import Action
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause, file_and_line
from aeros.spec.model.policy import OperatorOverride
from tests.unit.runtime import together
from tests.unit.runtime.bench import Request, configuration, gate, request, unproved, without


def causes(asked: Request) -> dict[str, Cause]:
    decision = asked.decided_by(gate())
    found = denial_causes(configuration(), decision, asked.caller, asked.readings, asked.action, asked.now)
    assert [(one.code, one.rule) for one in found] == [(one.code, one.rule) for one in decision.reasons]
    return {one.rule: one for one in found}


def test_a_cause_has_the_rules_text_source_line_and_measured_values() -> None:
    cause = causes(request(stop_pressed=True))["stop-button"]
    rule = next(one for one in configuration().site.rules if one.id == "stop-button")
    assert (cause.kind, cause.text, cause.source) == ("rule", rule.text, rule.source)
    assert cause.location.endswith(f"bench.yaml:{rule.require_span.line}")
    assert [str(part) for part in cause.shortfalls] == ["stop_pressed is true"]


@pytest.mark.parametrize("changed", [{"speed": 4.0}, {"human_distance": 0.1, "speed": 0.3}])
def test_each_shortfall_is_a_part_that_does_not_hold(changed: dict[str, Any]) -> None:
    found = causes(request(**changed))
    assert found
    for cause in found.values():
        for part in cause.shortfalls:
            ways = {"at most": part.value <= part.bound, "at least": part.value >= part.bound}  # type: ignore[operator]
            assert ways.get(part.required_op) is not True, (cause, part)


def test_causes_quote_envelope_and_permission_from_the_module() -> None:
    found = causes(request("slowly", speed=4.0))
    cause = next(one for one in found.values() if one.kind in ("envelope", "permission"))
    assert "ecm.yaml:" in cause.location
    assert any(part.quantity == "speed" and part.value == 4.0 for part in cause.shortfalls)


def test_a_missing_reading_is_reported_as_unknown() -> None:
    cause = causes(without(request(), "human_distance"))["human_distance"]
    assert cause.kind == "reading"
    assert [str(part) for part in cause.shortfalls] == ["`human_distance` is not measured"]


def test_stop_causes_of_missing_readings_and_of_unknown_rules() -> None:
    site = configuration().site
    cause = stop_cause(site, "input:hand", None)
    assert (cause.kind, cause.rule) == ("reading", "hand")
    assert stop_cause(site, "stopped by the operator", None) == Cause(
        "stopped", "stopped by the operator", "stopped by the operator"
    )


def cause_of(reason: Reason, asked: Request | None = None, under: Configuration | None = None) -> Cause:
    """Cause of one reason, which need not be the gate's own."""
    asked = asked or request()
    decision = Decision(DecisionKind.DENY, None, (reason,))
    found = denial_causes(
        under or unproved(), decision, asked.caller, asked.readings, asked.action, asked.now
    )
    (cause,) = found
    return cause


def test_the_cause_of_a_broken_rule_in_full() -> None:
    rule = next(one for one in unproved().site.rules if one.id == "near-person")
    reason = Reason("AE750", "near-person", "whoever is near is hit slowly")
    part = UnmetBound("speed", 0.5, "at most", 0.25, "m/s")
    assert cause_of(reason, request(speed=0.5, human_distance=1.0)) == Cause(
        "rule",
        "near-person",
        "human_distance < 1200 mm implies speed <= 250 mm/s",
        "risk assessment",
        file_and_line(rule.require_span),
        (UnmetBound("human_distance", 1.0, "at least", 1.2, "m"), part),
        "AE750",
    )


@pytest.mark.parametrize("skill", ["quickly", "nobody"])
def test_the_cause_of_a_broken_rule_about_an_action_that_it_does_not_govern_is_the_gate(skill: str) -> None:
    reason = Reason("AE750", "near-person", "near")
    expected = Cause("gate", "near-person", "near", code="AE750")
    assert cause_of(reason, request(skill, "sweep")) == expected
    assert cause_of(reason, of_kind("fly", skill)) == expected


def of_kind(kind: str, skill: str = "slowly") -> Request:
    asked = request(skill)
    return replace(asked, action=asked.action._replace(kind=kind))


@pytest.mark.parametrize("code", ["AE710", "AE790"])
def test_a_reason_that_only_has_the_name_of_a_rule_is_the_gates(code: str) -> None:
    assert cause_of(Reason(code, "top-speed", "a text")) == Cause("gate", "top-speed", "a text", code=code)
    assert cause_of(Reason(code, "not-fast-together", "a text"), under=together.configuration()) == Cause(
        "gate", "not-fast-together", "a text", code=code
    )


def test_the_cause_of_a_broken_joint_rule_in_full() -> None:
    rule = together.configuration().site.joint_rules[0]
    reason = Reason("AE751", "not-fast-together", "too fast")
    assert cause_of(reason, under=together.configuration()) == Cause(
        "rule",
        "not-fast-together",
        "moving.speed + rolling.pace <= 1 m/s",
        rule.source,
        file_and_line(rule.require_span),
        code="AE751",
    )
    assert rule.source
    other = Reason("AE751", "arm", "the arm is in use")
    assert cause_of(other, under=together.configuration()) == Cause("gate", "arm", other.text, code="AE751")


def test_the_causes_of_a_broken_envelope_and_permission_in_full() -> None:
    module = unproved().modules["handling"]
    asked = request("slowly", speed=4.0)
    envelope, permission = module.skills["slowly"].envelope["move"], module.permitted_actions["move"]
    assert cause_of(Reason("AE730", "slowly", "envelope"), asked) == Cause(
        "envelope",
        "slowly",
        "target in table and speed <= 100 mm/s and distance(hand, target) <= 300 mm",
        location=file_and_line(envelope.span),
        shortfalls=(UnmetBound("speed", 4.0, "at most", 0.1, "m/s"),),
        code="AE730",
    )
    assert cause_of(Reason("AE731", "handling", "permission"), asked) == Cause(
        "permission",
        "handling",
        "target in table and speed <= 500 mm/s",
        location=file_and_line(permission.span),
        shortfalls=(UnmetBound("speed", 4.0, "at most", 0.5, "m/s"),),
        code="AE731",
    )


@pytest.mark.parametrize("code", ["AE730", "AE731"])
def test_an_envelope_or_permission_that_nobody_declares_is_the_gates(code: str) -> None:
    reason = Reason(code, "handling", "not permitted")
    expected = Cause("gate", "handling", "not permitted", code=code)
    for asked in (of_kind("throw"), replace(request(), caller=Caller("nobody", "slowly", {}))):
        assert cause_of(reason, asked) == expected


def test_shortfalls_of_inputs_are_in_the_cause() -> None:
    asked = request("paced", "carry", gait=0.09)
    asked = replace(asked, caller=replace(asked.caller, inputs={"tool": "knife", "limit": 0.05}))
    assert cause_of(Reason("AE730", "paced", "envelope"), asked).shortfalls == (
        UnmetBound("inputs.tool", "knife", "exactly", "brush"),
        UnmetBound("gait", 0.09, "at most", 0.05, "m/s"),
    )


@pytest.mark.parametrize("code", ["AE703", "AE704", "AE705", "AE706", "AE707"])
def test_the_cause_of_a_missing_or_malformed_reading_in_full(code: str) -> None:
    declared = unproved().site.observed_variables["wind"]
    for text, why in (
        ("`wind` is 2 s old", "is 2 s old"),
        ("`wind` is older than `max` is", "is older than `max` is"),
        ("too old", "too old"),
    ):
        assert cause_of(Reason(code, "wind", text)) == Cause(
            "reading",
            "wind",
            text,
            location=file_and_line(declared.span),
            shortfalls=(UnmetBound("wind", None, "known", True, reason=why),),
            code=code,
        )
    assert cause_of(Reason(code, "gait", "missing")) == Cause("gate", "gait", "missing", code=code)
    assert cause_of(Reason("AE701", "wind", "no reading")) == Cause(
        "gate", "wind", "no reading", code="AE701"
    )


def test_the_cause_of_a_block_has_its_place_in_the_site_file() -> None:
    site = unproved().site
    span = site.rules[0].span
    blocks = (
        OperatorOverride("other", "cleaning", "nobody", None, None, site.rules[1].span),
        OperatorOverride("cleaning", "cleaning", None, None, "move", span),
        OperatorOverride("by-hand", "stop it", None, None, None),
    )
    under = replace(unproved(), site=replace(site, blocks=blocks))
    for name, at in (("cleaning", file_and_line(span)), ("by-hand", ""), ("absent", "")):
        assert cause_of(Reason("AE710", name, "blocked"), under=under) == Cause(
            "gate", name, "blocked", location=at, code="AE710"
        )
    assert cause_of(Reason("AE742", "cleaning", "quota"), under=under) == Cause(
        "gate", "cleaning", "quota", code="AE742"
    )


def test_the_cause_of_a_stop_for_a_missing_reading_in_full() -> None:
    site = unproved().site
    for name, at in (("wind", file_and_line(site.state["wind"].span)), ("rain:x", "")):
        assert stop_cause(site, f"input:{name}", None) == Cause(
            "reading",
            name,
            "every value that a rule reads is measured",
            location=at,
            shortfalls=(UnmetBound(name, None, "known", True, reason="is missing, old or malformed"),),
        )


def test_the_cause_of_a_stop_for_a_broken_rule_in_full() -> None:
    site = unproved().site
    rule = next(one for one in site.rules if one.id == "separation")
    at = file_and_line(rule.require_span)
    violation = RuleViolation("separation", rule.terms["move"], {"human_distance": 0.25})
    part = UnmetBound("human_distance", 0.25, "at least", 0.5, "m")
    expected = Cause("rule", "separation", "human_distance >= 500 mm", "risk assessment", at, (part,))
    assert stop_cause(site, "separation", violation) == expected
    assert stop_cause(site, "separation", None) == replace(expected, shortfalls=())
    assert stop_cause(site, "separation", violation._replace(rule="other")) == replace(
        expected, shortfalls=()
    )


def test_the_causes_of_stops_for_joint_rules_and_deviations_in_full() -> None:
    site = together.configuration().site
    rule = site.joint_rules[0]
    assert stop_cause(site, "not-fast-together", None) == Cause(
        "rule", "not-fast-together", rule.text, rule.source, file_and_line(rule.require_span)
    )
    part = UnmetBound("distance from the decided path", 0.034, "at most", 0.01, "m")
    assert stop_cause(site, "tracking", MotionDeviation("tracking", (part,))) == Cause(
        "stopped", "tracking", "tracking", shortfalls=(part,)
    )


def test_shortfalls_need_every_value_of_the_condition_and_no_other() -> None:
    asked = request("slowly", speed=4.0)
    reason = Reason("AE730", "slowly", "envelope")
    assert cause_of(reason, without(asked, "hand")).shortfalls == ()
    alone = replace(asked, readings={}, action=Action("move", {"speed": 4.0}))
    (part,) = cause_of(Reason("AE750", "top-speed", "too fast"), alone).shortfalls
    assert str(part) == "speed is 4 m/s (at most 0.5 m/s)"
