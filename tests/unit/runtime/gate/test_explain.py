"""Explanations agree with the decisions they explain, and show the result of every condition."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from math import nan

import pytest
from hypothesis import given

from aeros.cli.run.decision_text import decision_text, explanation_text
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.gate.explain import EvaluatedCondition, Explainer, Explanation
from aeros.runtime.gate.gate import GateMode
from aeros.runtime.gate.wire import explain_line, explanation_json
from tests.differential.gate.test_gate_modes import fast_requests, requests
from tests.unit.runtime.bench import Request, configuration, gate, request, unproved, without


@cache
def explainer() -> Explainer:
    return Explainer(configuration(), GateMode.COMPILED)


def explained(asked: Request, by: Explainer | None = None) -> Explanation:
    return (by or explainer()).explain(asked.caller, asked.readings, asked.action, asked.now, asked.usage)


def clause(found: Explanation, name: str) -> EvaluatedCondition:
    (one,) = (one for one in found.conditions if one.name == name)
    return one


@given(requests() | fast_requests())
def test_an_explanation_agrees_with_its_decision(asked: Request) -> None:
    found = explained(asked)
    assert found.decision == asked.decided_by(gate())
    failing = {one.name for one in found.conditions if one.holds is False}
    named = {"AE730": "envelope", "AE731": "permission"}
    assert failing == {named.get(one.code, one.rule) for one in found.decision.reasons}
    assert found.layers["invariants"] is all(one.code != "AE750" for one in found.decision.reasons)
    rules = [rule.id for rule in configuration().site.rules_for_kind(asked.action.kind)]
    assert [one.name for one in found.conditions] == ["envelope", "permission", *rules]
    obligations = configuration().certificates["handling"].obligations
    verdicts = {str(claim_id): verdict for claim_id, verdict in obligations.items()}
    for one in (*found.conditions, *found.attenuated_parameters):
        assert one.obligation is None or verdicts[one.obligation] == "PROVED"
        left_out = one.obligation is not None and one.holds is None
        assert left_out is (one.holds is None)
        assert left_out is (
            one.obligation is not None
            and (one in found.attenuated_parameters or found.decision.kind is DecisionKind.ALLOW)
        )
    assert bool(found.attenuated_parameters) is (found.decision.kind is DecisionKind.ATTENUATE)


def test_proved_conditions_are_not_evaluated_and_the_others_show_their_values() -> None:
    found = explained(request(speed=0.25, human_distance=1.5))
    assert clause(found, "top-speed").obligation == "safety/quickly/move/top-speed"
    assert clause(found, "top-speed").holds is None
    assert clause(found, "permission").obligation == "permission/quickly/move"
    assert clause(found, "permission").text == "target in table and speed <= 500 mm/s"
    assert clause(found, "envelope").values == {"target": "[0.25, 0.125, 0.25] m", "speed": "0.25 m/s"}
    assert clause(found, "near-person").values == {"human_distance": "1.5 m", "speed": "0.25 m/s"}
    assert clause(found, "near-person").holds is True
    assert set(found.layers.values()) == {True}


@pytest.mark.parametrize("mode", [GateMode.Z3, GateMode.CHECKED])
def test_solver_modes_evaluate_every_condition(mode: GateMode) -> None:
    by = Explainer(configuration(), mode)
    assert by.gate.mode is mode
    found = explained(request(), by)
    assert all(one.holds for one in found.conditions)
    assert clause(found, "top-speed").obligation == "safety/quickly/move/top-speed"


def test_conditions_on_missing_or_malformed_values_are_unknown() -> None:
    asked = request()
    far = asked.readings["human_distance"]
    for broken in (
        without(asked, "human_distance"),
        replace(asked, readings={**asked.readings, "human_distance": far._replace(value=nan)}),
    ):
        found = explained(broken)
        assert clause(found, "separation").missing == ("human_distance",)
        assert clause(found, "separation").holds is None
        assert clause(found, "top-speed").holds is True  # something objects, so the proof is not relied on
        assert found.layers["form"] is False
        assert found.layers["invariants"] is None


def test_a_layer_is_unknown_iff_one_of_its_conditions_reads_a_missing_value() -> None:
    windless = explained(without(request("slowly", "carry"), "wind"))
    assert clause(windless, "envelope").missing == ("wind",)
    assert windless.layers["envelope and permission"] is None
    assert windless.layers["invariants"] is True
    module = unproved().modules["handling"]
    permitted = {**module.permitted_actions, "carry": module.skills["slowly"].envelope["carry"]}
    changed = replace(unproved(), modules={"handling": replace(module, permitted_actions=permitted)})
    asked = without(request("quickly", "carry"), "wind")
    windless = explained(asked, Explainer(changed, GateMode.COMPILED))
    assert [one.name for one in windless.conditions if one.missing] == ["permission"]
    assert windless.layers["envelope and permission"] is None
    assert windless.layers["invariants"] is True


def test_a_malformed_request_passes_no_layer() -> None:
    for found in (
        explained(replace(request(), now=nan)),
        explain_line(explainer(), "handling", "quickly", b"{"),
    ):
        assert found.decision.kind is DecisionKind.DENY
        assert found.layers["form"] is False
        assert {passed for name, passed in found.layers.items() if name != "form"} == {None}
        assert "not known: overrides" in explanation_text(found, None)


def test_callers_and_kinds_that_do_not_exist_are_explained_too() -> None:
    asked = request()
    for broken, layer in (
        (replace(asked, caller=replace(asked.caller, module="nobody")), "lifecycle"),
        (replace(asked, caller=replace(asked.caller, skill="nothing")), "lifecycle"),
        (replace(asked, action=replace_kind(asked, "fly")), "form"),
    ):
        found = explained(broken)
        assert found.layers[layer] is False
        assert found.decision.kind is DecisionKind.DENY


def replace_kind(asked: Request, kind: str) -> object:
    return asked.action._replace(kind=kind)


def test_the_text_shows_the_result_of_every_condition() -> None:
    asked = request(human_distance=1.0, speed=0.5)
    found = explained(asked)
    text = explanation_text(found, None)
    assert text.startswith("ATTENUATE move(target=(0.25, 0.125, 0.25), speed=0.25)\n  AE750 near-person: ")
    assert text.splitlines()[0] == decision_text(found.decision).splitlines()[0]
    first, again = text.split("  re-decided after attenuation\n")
    assert "near-person   fails" in first
    assert "[human_distance = 1 m, speed = 0.5 m/s]" in first
    assert "near-person   holds" in again
    assert "top-speed     by safety/quickly/move/top-speed" in again


def test_the_json_says_the_same_as_the_text() -> None:
    found = json.loads(json.dumps(explanation_json(explained(request(human_distance=1.0, speed=0.5)))))
    by_name = {one["name"]: one for one in found["conditions"]}
    assert found["verdict"] == "ATTENUATE"
    assert found["layers"]["invariants"] is False
    assert by_name["near-person"] == {
        "name": "near-person",
        "text": "human_distance < 1200 mm implies speed <= 250 mm/s",
        "proved_by": None,
        "evaluated": True,
        "holds": False,
        "values": {"human_distance": "1 m", "speed": "0.5 m/s"},
        "missing": [],
    }
    again = {one["name"]: one for one in found["conditions_after_attenuation"]}
    assert again["top-speed"]["proved_by"] == "safety/quickly/move/top-speed"
    assert again["top-speed"]["evaluated"] is False
