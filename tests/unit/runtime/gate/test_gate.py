"""The layers of the gate after the form check: a test per code, and decisions from objections."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import nextafter
from typing import Any

import pytest

from aeros.runtime.gate import conditions
from aeros.runtime.gate.configuration import Configuration, make_configuration
from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateDisagreementError, GateMode
from aeros.runtime.ports import ColumnNames, Snapshot
from aeros.skill import Action
from aeros.spec.diagnostics.codes import CODES
from aeros.spec.expr import terms as t
from aeros.spec.model.policy import Access, OperatorOverride
from aeros.spec.model.rules import Risk, Rule
from aeros.spec.model.site import Site
from tests.unit.runtime.bench import ALLOWED, NOW, codes, configuration, denied, gate, request, without


def changed(site: dict[str, Any] | None = None, ecm: dict[str, Any] | None = None) -> CompiledGate:
    """A gate of the bench with some of its site or module replaced, and the certificate as it was."""
    old = configuration()
    module = replace(old.modules["handling"], **(ecm or {}))
    return CompiledGate(
        make_configuration(
            replace(old.site, **(site or {})), {"handling": (module, old.certificates["handling"])}
        )
    )


def skill_changed(name: str, **fields: Any) -> CompiledGate:
    skills = configuration().modules["handling"].skills
    return changed(ecm={"skills": {**skills, name: replace(skills[name], **fields)}})


# ALLOW.


@pytest.mark.parametrize("mode", GateMode)
@pytest.mark.parametrize(("skill", "kind"), ALLOWED)
def test_an_action_without_objections_is_allowed_without_reasons(
    skill: str, kind: str, mode: GateMode
) -> None:
    asked = request(skill, kind)
    decision = asked.decided_by(gate(mode))
    assert (decision.kind, decision.action, decision.reasons) == (DecisionKind.ALLOW, asked.action, ())


@pytest.mark.parametrize(("skill", "kind"), [one for one in ALLOWED if one[0] != "paced"])
def test_a_well_formed_request_with_all_its_inputs_needs_no_slow_path(
    skill: str, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    slow = "aeros.runtime.gate.gate._Decider._decide_slow_path"
    monkeypatch.setattr(slow, lambda *_: pytest.fail("decided slowly"))
    fresh, asked = CompiledGate(configuration()), request(skill, kind)
    order = ColumnNames(asked.readings)
    column = tuple(asked.readings[name].value for name in order.names)
    for readings in (asked.readings, Snapshot(order, column, NOW)):
        for _ in range(2):
            again = replace(asked, readings=readings).decided_by(fresh)
            assert (again.kind, again.action) == (DecisionKind.ALLOW, asked.action)


def test_lists_and_whole_numbers_reach_the_plant_as_tuples_and_doubles() -> None:
    decision = request(target=[0, 0, 0.25], speed=0, hand=[0, 0, 0]).decided_by(gate())
    assert decision.action == Action("move", {"target": (0.0, 0.0, 0.25), "speed": 0.0})
    assert repr(decision.action.parameters) == "{'target': (0.0, 0.0, 0.25), 'speed': 0.0}"


def test_a_default_on_the_bound_of_its_range_is_inside_it() -> None:
    asked = request("paced", "carry", gait=0.0625)
    assert asked.decided_by(gate()).kind is DecisionKind.ALLOW
    assert denied(request("paced", "carry", gait=0.1)) == [("AE730", "carry"), ("AE750", "slow-carry")]


# AE710 to AE742: finite layers.


@pytest.mark.parametrize(
    ("module", "skill", "action"),
    [
        ("handling", None, None),
        ("handling", "quickly", None),
        ("handling", "quickly", "move"),
        (None, None, "move"),
    ],
)
def test_an_operator_block_denies_what_it_matches(
    module: str | None, skill: str | None, action: str | None
) -> None:
    block = OperatorOverride("lent", "it is lent", module, skill, action)
    blocked = changed(site={"blocks": (block,)})
    assert denied(request(), blocked) == [("AE710", "lent")]
    other = changed(site={"blocks": (replace(block, module="others"),)})
    assert request().decided_by(other).kind is DecisionKind.ALLOW


def test_a_module_that_is_not_active_is_denied() -> None:
    asked = replace(request(), caller=Caller("handlin", "quickly", {}))
    assert denied(asked) == [("AE720", "handlin"), ("AE730", "move")]


def test_a_skill_that_the_module_does_not_have_is_denied() -> None:
    asked = replace(request(), caller=Caller("handling", "fast", {}))
    assert denied(asked) == [("AE720", "fast"), ("AE730", "move")]


def test_with_nothing_active_everything_is_denied() -> None:
    nothing = CompiledGate(make_configuration(configuration().site, {}))
    for skill, kind in ALLOWED:
        assert ("AE720", "handling") in denied(request(skill, kind), nothing)


def test_a_kind_that_is_not_in_the_envelope_is_denied() -> None:
    asked = replace(request(), action=Action("throw", {"force": 1.0}))
    assert denied(asked) == [("AE741", "quickly"), ("AE730", "throw")]


def test_an_action_outside_the_envelope_is_denied() -> None:
    assert denied(request("slowly", speed=0.125)) == [("AE730", "move")]


def test_an_action_outside_the_permission_is_denied() -> None:
    permission = configuration().modules["handling"].permitted_actions
    skills = configuration().modules["handling"].skills
    narrow = skills["slowly"].envelope["move"]
    strict = changed(ecm={"permitted_actions": {**permission, "move": narrow}, "manifest_digest": "other"})
    assert denied(request(speed=0.2), strict) == [("AE731", "move")]
    assert request(speed=0.05).decided_by(strict).kind is DecisionKind.ALLOW


def test_a_kind_without_a_permission_is_denied() -> None:
    assert denied(request(), changed(ecm={"permitted_actions": {}})) == [("AE731", "move")]


@pytest.mark.parametrize("layer", ["skill", "module", "site"])
def test_an_actuator_that_any_layer_withholds_is_denied(layer: str) -> None:
    withheld = {
        "skill": lambda: skill_changed("quickly", actuators=frozenset()),
        "module": lambda: changed(ecm={"requested_access": Access()}),
        "site": lambda: changed(site={"access": Access()}),
    }[layer]()
    assert denied(request(), withheld) == [("AE740", "arm")]


def test_access_granted_to_another_module_does_not_count() -> None:
    asked = replace(request(), action=Action("drive", {}))
    assert denied(asked) == [("AE740", "wheels"), ("AE730", "drive")]


def test_more_risk_than_the_skill_declares_or_the_site_allows_is_denied() -> None:
    assert denied(request(), skill_changed("quickly", risk=Risk.LOW)) == [("AE741", "quickly")]
    assert denied(request(), skill_changed("quickly", risk=Risk.HIGH)) == [("AE741", "quickly")]
    assert denied(request(), changed(site={"risk_ceiling": Risk.LOW})) == [("AE741", "quickly")]


@pytest.mark.parametrize("used", [3, 4, 2**63, pytest.param(10**5000, id="beyond str")])
def test_a_quota_that_is_used_up_denies(used: int) -> None:
    assert denied(replace(request("quickly", "carry"), usage={"carry-rate": used})) == [
        ("AE742", "carry-rate")
    ]


def test_a_quota_with_unknown_usage_denies() -> None:
    assert denied(replace(request("quickly", "carry"), usage={})) == [("AE703", "carry-rate")]


@pytest.mark.parametrize("used", [-1, 0.0, False, None, "0", {"value": 1}])
@pytest.mark.parametrize("asked", [request("quickly", "carry"), request()], ids=["governed", "not governed"])
def test_a_malformed_usage_count_denies_every_action(asked: Any, used: Any) -> None:
    reasons = denied(replace(asked, usage={"carry-rate": used}))
    assert ("AE704", "carry-rate") in reasons


def test_a_quota_that_the_site_does_not_have_denies() -> None:
    assert denied(replace(request(), usage={"carry-rate": 0, "other": 0})) == [("AE702", "other")]


def test_a_quota_does_not_concern_other_kinds() -> None:
    assert replace(request(), usage={}).decided_by(gate()).kind is DecisionKind.ALLOW
    last = replace(request("quickly", "carry"), usage={"carry-rate": 2})
    assert last.decided_by(gate()).kind is DecisionKind.ALLOW


# AE750: Φ.


@pytest.mark.parametrize(
    ("kind", "rule", "values"),
    [
        ("move", "stop-button", {"stop_pressed": True}),
        ("carry", "stop-button", {"stop_pressed": True}),
        ("move", "separation", {"human_distance": 0.4, "speed": 0.1}),
        ("move", "short-reach", {"hand": (0.25, 0.75, 0.25)}),
        ("carry", "joints-in-range", {"joint_angle": (0.0, 2.125)}),
        ("carry", "some-joint-ready", {"joint_ready": (False, False)}),
        ("carry", "momentum", {"load": 2.0, "gait": 0.0625}),
    ],
)
def test_an_action_that_breaks_an_invariant_is_denied(kind: str, rule: str, values: dict[str, Any]) -> None:
    assert denied(request("quickly", kind, **values)) == [("AE750", rule)]


def test_proved_rules_are_evaluated_once_anything_objects() -> None:
    assert denied(request(speed=0.6, target=(0.25, 0.45, 0.25))) == [
        ("AE730", "move"),
        ("AE731", "move"),
        ("AE750", "top-speed"),
        ("AE750", "on-the-table"),
    ]


def test_the_protective_stop_is_allowed_in_every_state() -> None:
    state = {"stop_pressed": True, "human_distance": 0.0}
    assert request("slowly", "stop", **state).decided_by(gate()).kind is DecisionKind.ALLOW
    blind = replace(request("slowly", "stop"), readings={}, usage={})
    assert blind.decided_by(gate()).kind is DecisionKind.ALLOW


def test_every_violated_rule_of_every_layer_is_reported_at_once() -> None:
    block = OperatorOverride("lent", "it is lent", "handling", None, None)
    strict = changed(site={"blocks": (block,), "access": Access(), "risk_ceiling": Risk.LOW})
    state = {"human_distance": 0.1, "stop_pressed": True, "load": 6.0, "joint_angle": (3.5, 3.5)}
    asked = request("quickly", "carry", gait=0.5, **state)
    asked = replace(without(asked, "joint_ready"), usage={"carry-rate": 3})
    assert denied(asked, strict) == [
        ("AE705", "load"),
        ("AE703", "joint_ready"),
        ("AE710", "lent"),
        ("AE740", "arm"),
        ("AE741", "quickly"),
        ("AE742", "carry-rate"),
        ("AE730", "carry"),
        ("AE731", "carry"),
        ("AE750", "stop-button"),
        ("AE750", "separation"),
        ("AE750", "joints-in-range"),
        ("AE750", "slow-carry"),
    ]


# Boundaries: a double is the rational it denotes.


def test_the_double_nearest_to_a_bound_is_denied_if_above_it() -> None:
    assert Fraction(0.1) > Fraction(1, 10)
    assert denied(request("quickly", "carry", gait=0.1)) == [("AE730", "carry"), ("AE750", "slow-carry")]
    below = request("quickly", "carry", gait=nextafter(0.1, 0.0))
    assert below.decided_by(gate()).kind is DecisionKind.ALLOW


def test_the_boundary_of_a_product_is_decided_exactly() -> None:
    allowed = request("quickly", "carry", load=1.6, gait=0.0625)  # 1.6 as a double is above 8/5
    assert denied(allowed) == [("AE750", "momentum")]
    just = request("quickly", "carry", load=nextafter(1.6, 0.0), gait=0.0625)
    assert just.decided_by(gate()).kind is DecisionKind.ALLOW


# ATTENUATE.


@pytest.mark.parametrize("mode", GateMode)
def test_an_action_that_only_an_attenuating_rule_denies_is_reduced(mode: GateMode) -> None:
    decision = request(human_distance=1.0, speed=0.5).decided_by(gate(mode))
    assert decision.kind is DecisionKind.ATTENUATE
    assert decision.action == Action("move", {"target": (0.25, 0.125, 0.25), "speed": 0.25})
    assert codes(decision) == [("AE750", "near-person")]


def test_the_reduced_parameter_is_the_double_below_the_bound() -> None:
    decision = request(fitted="knife", speed=0.2).decided_by(gate())
    assert decision.action is not None
    assert decision.action.parameters["speed"] == nextafter(0.1, 0.0)


def test_two_rules_attenuate_at_once() -> None:
    decision = request(human_distance=1.0, fitted="knife", speed=0.5).decided_by(gate())
    assert codes(decision) == [("AE750", "near-person"), ("AE750", "knife-speed")]
    assert decision.kind is DecisionKind.ATTENUATE
    assert decision.action is not None
    assert decision.action.parameters["speed"] == nextafter(0.1, 0.0)


def test_nothing_is_attenuated_if_another_rule_objects_too() -> None:
    assert denied(request(human_distance=0.4, speed=0.5)) == [
        ("AE750", "separation"),
        ("AE750", "near-person"),
    ]
    assert denied(request(human_distance=1.0, speed=0.5, dirt=2.0)) == [
        ("AE705", "dirt"),
        ("AE750", "near-person"),
    ]
    assert denied(request("slowly", human_distance=1.0, speed=0.5)) == [
        ("AE730", "move"),
        ("AE750", "near-person"),
    ]


@pytest.mark.parametrize(("pace", "reduced"), [(3.0, 0.5), (-3.0, -0.5)])
def test_a_negative_parameter_is_reduced_towards_zero(pace: float, reduced: float) -> None:
    decision = request("quickly", "sweep", wind=2.0, gust=5.0, pace=pace).decided_by(gate())
    assert decision.kind is DecisionKind.ATTENUATE
    assert decision.action == Action("sweep", {"tool": "knife", "wet": True, "pace": reduced})


def rules_of(*names: str, site: Site) -> list[Rule]:
    return [next(rule for rule in site.rules if rule.id == name) for name in names]


def with_rules(*rules: Rule) -> CompiledGate:
    """A gate of the bench with these rules first, in place of those of the same name."""
    old = configuration()
    names = {rule.id for rule in rules}
    others = (rule for rule in old.site.rules if rule.id not in names)
    return CompiledGate(replace(old, site=replace(old.site, rules=(*rules, *others))))


def test_an_attenuated_action_that_is_still_denied_is_denied() -> None:
    near, knife = rules_of("near-person", "knife-speed", site=configuration().site)
    wrong = with_rules(replace(knife, attenuations=near.attenuations))
    assert denied(request(fitted="knife", speed=0.5), wrong) == [("AE750", "knife-speed")]


def test_an_attenuation_never_enlarges() -> None:
    near, knife = rules_of("near-person", "knife-speed", site=configuration().site)
    reduced = near.attenuations["move"]["speed"]
    assert isinstance(reduced, t.Extremum)
    # `speed: 250 mm/s` without the `min`: after the knife's rule, that would be larger.
    wrong = with_rules(knife, replace(near, attenuations={"move": {"speed": reduced.right}}))
    decision = request(human_distance=1.0, fitted="knife", speed=0.5).decided_by(wrong)
    assert decision.action is not None
    assert decision.action.parameters["speed"] == nextafter(0.1, 0.0)


# Modes and certificates.


def test_a_certificate_of_another_site_proves_nothing() -> None:
    """After Φ is tightened the certificate is of another site, so the gate evaluates the rule."""
    old = configuration()
    slow, button = rules_of("slow-carry", "stop-button", site=old.site)
    rules = tuple(replace(one, terms=button.terms) if one is slow else one for one in old.site.rules)
    site = replace(old.site, rules=rules, digest="of another file")
    asked = request("slowly", "carry", stop_pressed=True)
    trusting = CompiledGate(
        make_configuration(site, {"handling": (old.modules["handling"], old.certificates["handling"])})
    )
    assert ("AE750", "slow-carry") in denied(asked, trusting)


def test_an_invariant_missing_from_the_certificate_is_evaluated() -> None:
    old = configuration()
    certificate = old.certificates["handling"]
    nothing = replace(certificate, obligations={})
    silent = CompiledGate(replace(old, certificates={"handling": nothing}))
    assert denied(request(stop_pressed=True), silent) == [("AE750", "stop-button")]
    uncertified = CompiledGate(replace(old, certificates={}))
    assert denied(request(stop_pressed=True), uncertified) == [("AE750", "stop-button")]


def falsely_proved() -> Configuration:
    """The broken twin: its certificate says PROVED where the truth is GUARDED."""
    old = configuration()
    certificate = old.certificates["handling"]
    lies = dict.fromkeys(certificate.obligations, "PROVED")
    return replace(old, certificates={"handling": replace(certificate, obligations=lies)})


def test_the_checked_gate_detects_a_wrong_certificate() -> None:
    asked = request(stop_pressed=True)
    assert asked.decided_by(CompiledGate(falsely_proved())).kind is DecisionKind.ALLOW  # what a lie does
    assert asked.decided_by(CompiledGate(falsely_proved(), GateMode.Z3)).kind is DecisionKind.DENY
    with pytest.raises(GateDisagreementError, match="compiled gate"):
        asked.decided_by(CompiledGate(falsely_proved(), GateMode.CHECKED))


def test_a_solver_that_cannot_decide_denies(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        conditions.SolverCondition, "decide", lambda self, values: conditions.ConditionValue.UNDECIDED
    )
    decision = request().decided_by(gate(GateMode.Z3))
    assert decision.kind is DecisionKind.DENY
    assert codes(decision)[:3] == [("AE790", "move"), ("AE790", "move"), ("AE790", "stop-button")]
    assert {code for code, _ in codes(decision)} == {"AE790"}
    assert decision.reasons[2].text == "the solver could not decide `stop-button`"
    assert request().decided_by(gate(GateMode.CHECKED)) == decision


def test_a_reason_names_a_code_that_is_registered() -> None:
    text = "AE701 AE702 AE703 AE704 AE705 AE706 AE707 AE710 AE720 AE730 AE731 AE740 AE741 AE742 AE750 AE790"
    motions = "AE751 AE752 AE760 AE761 AE762 AE763 AE764 AE765 AE766"
    registered = {code for code in CODES if code.startswith("AE7")}
    assert registered == {*text.split(), *motions.split()}


# Modes.


@pytest.mark.parametrize("mode", GateMode)
def test_a_gate_of_another_configuration_has_the_same_mode_and_goes_on_counting(mode: GateMode) -> None:
    first = CompiledGate(configuration(), mode)
    asked = request()
    assert asked.decided_by(first).kind is DecisionKind.ALLOW
    stopped = replace(configuration().site, blocks=())
    second = first.with_configuration(replace(configuration(), site=stopped))
    assert second.mode is mode
    assert second.monitor_rules.site == stopped
    assert asked.decided_by(second).kind is DecisionKind.ALLOW
    assert asked.decided_by(second).kind is DecisionKind.ALLOW
    expected = 3 if mode is GateMode.CHECKED else 0
    assert (second.tally.decided, second.tally.confirmed) == (expected, expected)
    assert second.tally is first.tally


def test_a_gate_is_kept_for_an_equal_configuration_and_for_no_other_with_its_digest() -> None:
    first = CompiledGate(configuration())
    other = replace(configuration(), digest="another")
    second = first.with_configuration(other)
    assert second is not first
    assert second.with_configuration(configuration()) is first
    assert first.with_configuration(other) is second
    emptied = replace(configuration(), modules={})
    third = first.with_configuration(emptied)
    assert third is not first
    assert request().decided_by(third).kind is DecisionKind.DENY


def test_the_earlier_name_of_a_mode_is_read_and_no_other() -> None:
    assert GateMode("shadow") is GateMode.CHECKED
    for name in ("Shadow", "both", None):
        with pytest.raises(ValueError, match="is not a valid GateMode"):
            GateMode(name)
