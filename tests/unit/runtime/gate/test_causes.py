"""Causes of denials: the condition, its place in a file, the measured values, and the bound."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.runtime.gate.causes import denial_causes, stop_cause
from aeros.spec.model.cause import Cause
from tests.unit.runtime.bench import Request, configuration, gate, request, without


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
