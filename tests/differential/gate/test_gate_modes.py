"""All modes of the gate and the definition decide alike: inside the envelope, outside it, on bounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from math import inf, nextafter
from typing import Any

import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateDisagreementError, GateMode
from aeros.skill import Action
from aeros.spec.backends import compiled
from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.types import BoolType, EnumType, FamilyType, VectorType
from aeros.spec.model.variables import Declared
from tests.differential.gate.gate_oracle import admits, exact, objections
from tests.hypothesis_profiles import examples
from tests.unit.runtime.bench import (
    ALLOWED,
    PARAMETERS,
    STATE,
    Request,
    codes,
    configuration,
    gate,
    measured,
    request,
)

BOUNDS = [
    Fraction(text)
    for text in [
        "0",
        "1/10",
        "1/4",
        "3/10",
        "1/2",
        "3/5",
        "2/5",
        "-2/5",
        "1",
        "6/5",
        "2",
        "4",
        "-4",
        "5",
        "1/100",
        "8/5",
        "17/18",
        "20",
        "1/5",
        "16/5",
    ]
]
"""The constants of the bench's rules, in SI, and products of them."""

MORE = examples(80)


def doubles(declared: Declared) -> st.SearchStrategy[Any]:
    """Doubles in the declared range: anywhere, and next to every bound that any rule has."""
    assert declared.range is not None
    low, high = adjacent_doubles(declared.range[0])[1], adjacent_doubles(declared.range[1])[0]
    adjacent = [one for bound in BOUNDS for one in adjacent_doubles(bound)]
    near = {*adjacent, *(nextafter(one, to) for one in adjacent for to in (-inf, inf))}
    inside = sorted(one for one in {*near, low, high, -0.0, 5e-324} if low <= one <= high)
    return (
        st.sampled_from(inside)
        | st.floats(low, high)
        | st.integers(-4, 20).filter(lambda n: low <= n <= high)
    )


def values(declared: Declared) -> st.SearchStrategy[Any]:
    match declared.variable.type:
        case BoolType():
            return st.booleans()
        case EnumType(members=members):
            return st.sampled_from(members)
        case VectorType():
            return st.tuples(*[doubles(declared)] * 3)
        case FamilyType(index=index, element=element):
            part = st.booleans() if isinstance(element, BoolType) else doubles(declared)
            return st.tuples(*[part] * len(index.members))
        case _:
            return doubles(declared)


STATES: tuple[dict[str, Any], ...] = (
    {},
    {"human_distance": 1.0},
    {"human_distance": 0.75, "fitted": "knife"},
    {"wind": 5.0, "gust": 5.0},
    {"fitted": "knife", "wind": 1.5},
)
"""States in which no rule denies and some attenuate."""


@st.composite
def requests(draw: st.DrawFn) -> Request:
    """Well-formed requests: an allowed one with some of its values drawn again."""
    site = configuration().site
    skill, kind = draw(st.sampled_from([pair for pair in ALLOWED if pair[1] != "stop"]))
    changed = dict(draw(st.sampled_from(STATES)))
    for name, declared in site.kinds[kind].parameters.items():
        if draw(st.booleans()):
            changed[name] = draw(values(declared))
    for name in draw(st.lists(st.sampled_from(sorted(site.state)), max_size=4, unique=True)):
        changed[name] = draw(values(site.state[name]))
    asked = request(skill, kind, **changed)
    if skill == "paced" and draw(st.booleans()):
        inputs = configuration().modules["handling"].skills[skill].inputs
        drawn = {name: draw(values(one)) for name, one in inputs.items()}
        asked = replace(asked, caller=replace(asked.caller, inputs=drawn))
    return asked


@st.composite
def fast_requests(draw: st.DrawFn) -> Request:
    """Allowed requests with another speed, up to the envelope or beyond it: many are to be attenuated."""
    kind, name, within = draw(st.sampled_from([("move", "speed", 0.5), ("sweep", "pace", 4.0)]))
    declared = configuration().site.kinds[kind].parameters[name]
    wanted = draw(st.floats(within / 8, within) | values(declared))
    return request("quickly", kind, **{**draw(st.sampled_from(STATES[1:])), name: wanted})


def environment(asked: Request) -> dict[str, Any]:
    """The exact values of a well-formed request by vocabulary name."""
    skill = configuration().modules["handling"].skills[asked.caller.skill]
    inputs = {name: one.default_value for name, one in skill.inputs.items()} | dict(asked.caller.inputs)
    given = {f"inputs.{name}": value for name, value in inputs.items()}
    state = {name: reading.value for name, reading in asked.readings.items()}
    return {name: exact(value) for name, value in {**given, **state, **asked.action.parameters}.items()}


def everything_evaluated() -> CompiledGate:
    """The compiled gate without a certificate to rely on: nothing is dropped."""
    return CompiledGate(replace(configuration(), certificates={}))


EVERYTHING = everything_evaluated()


def larger(asked: Mapping[str, Any], given: Mapping[str, Any]) -> list[str]:
    return [
        name
        for name, value in given.items()
        if type(value) is float and abs(Fraction(value)) > abs(Fraction(asked[name]))
    ]


@MORE
@given(requests() | fast_requests())
def test_every_mode_decides_as_the_definition_does(asked: Request) -> None:
    decision = asked.decided_by(gate())
    event(decision.kind.value)
    assert asked.decided_by(gate(GateMode.Z3)) == decision
    assert asked.decided_by(gate(GateMode.CHECKED)) == decision
    expected = objections(configuration(), asked.caller.skill, asked.action.kind, environment(asked))
    assert set(codes(decision)) == expected
    assert len(decision.reasons) == len(expected)
    assert (decision.kind is DecisionKind.ALLOW) == (not expected) == admits(configuration(), asked)
    if decision.action is not None:
        assert admits(configuration(), replace(asked, action=decision.action))
        assert not larger(asked.action.parameters, decision.action.parameters)
        assert decision.action.kind == asked.action.kind
        assert decision.action.parameters.keys() == asked.action.parameters.keys()


@MORE
@given(requests() | fast_requests())
def test_code_that_the_proof_drops_changes_nothing(asked: Request) -> None:
    assert asked.decided_by(gate()) == asked.decided_by(EVERYTHING)


@given(fast_requests())
def test_attenuation_reduces_only_what_the_violated_rules_declare(asked: Request) -> None:
    kind = asked.action.kind
    name, within = {"move": ("speed", Fraction(1, 2)), "sweep": ("pace", Fraction(4))}[kind]
    wanted = asked.action.parameters[name]
    decision = asked.decided_by(gate())
    event(f"{kind}: {decision.kind.value}")
    assert (decision.kind is DecisionKind.DENY) == (abs(Fraction(wanted)) > within)
    if decision.kind is DecisionKind.ATTENUATE:
        assert decision.action is not None
        assert {reason.code for reason in decision.reasons} == {"AE750"}
        reduced = decision.action.parameters[name]
        assert decision.action.parameters == {**PARAMETERS[kind], name: reduced}
        assert abs(Fraction(reduced)) < abs(Fraction(wanted))
        again = replace(asked, action=decision.action).decided_by(gate())
        assert (again.kind, again.action) == (DecisionKind.ALLOW, decision.action)


@pytest.mark.parametrize("bound", BOUNDS)
@pytest.mark.parametrize("steps", range(-2, 3))
def test_both_sides_of_every_bound(bound: Fraction, steps: int) -> None:
    value = adjacent_doubles(bound)[0]
    for _ in range(abs(steps)):
        value = nextafter(value, inf if steps > 0 else -inf)
    cases = [
        ("carry", "gait"),
        ("carry", "load"),
        ("move", "speed"),
        ("move", "human_distance"),
        ("sweep", "pace"),
    ]
    for kind, name in cases:
        asked = request("quickly", kind, **{name: value})
        decision = asked.decided_by(gate(GateMode.CHECKED))
        assert (decision.kind is DecisionKind.ALLOW) == admits(configuration(), asked)


# Broken twins: what the tests above would notice.


def falsely_proved(rule: str) -> Configuration:
    """A certificate that claims `rule` PROVED of all actions, so that the compiled gate leaves it out."""
    old = configuration()
    certificate = old.certificates["handling"]
    obligations = {
        name: "PROVED" if str(name).endswith(f"/{rule}") else verdict
        for name, verdict in certificate.obligations.items()
    }
    assert obligations != certificate.obligations
    return replace(old, certificates={"handling": replace(certificate, obligations=obligations)})


@pytest.mark.parametrize(
    ("rule", "kind", "broken"),
    [
        ("stop-button", "move", {"stop_pressed": True}),
        ("separation", "carry", {"human_distance": 0.1}),
        ("joints-in-range", "carry", {"joint_angle": (3.5, 0.0)}),
        ("some-joint-ready", "carry", {"joint_ready": (False, False)}),
        ("near-person", "move", {"human_distance": 1.0, "speed": 0.5}),
        ("knife-speed", "move", {"fitted": "knife", "speed": 0.5}),
        ("short-reach", "move", {"hand": (-1.0, 0.0, 0.0)}),
        ("momentum", "carry", {"load": 5.0, "gait": 0.0625}),
        ("windy-sweep", "sweep", {"wind": 5.0, "pace": 3.0}),
    ],
)
def test_an_invariant_falsely_claimed_as_proved_halts_the_checked_gate(
    rule: str, kind: str, broken: dict[str, Any]
) -> None:
    twin = falsely_proved(rule)
    asked = request("quickly", kind, **broken)
    assert asked.decided_by(CompiledGate(twin)) != asked.decided_by(EVERYTHING)
    with pytest.raises(GateDisagreementError):
        asked.decided_by(CompiledGate(twin, GateMode.CHECKED))


def test_every_guarded_invariant_has_a_broken_twin() -> None:
    (marked,) = test_an_invariant_falsely_claimed_as_proved_halts_the_checked_gate.pytestmark
    tried = {case[0] for case in marked.args[1]}
    obligations = configuration().certificates["handling"].obligations
    assert tried == {one.name_of("invariant") for one, verdict in obligations.items() if verdict == "GUARDED"}


@pytest.mark.parametrize("stopped", [False, True], ids=["verdicts differ", "only reasons differ"])
def test_a_condition_compiled_without_its_rounding_filter_halts_the_checked_gate(
    stopped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        compiled._CodeGenerator,
        "_filtered_comparison",
        lambda self, term, a, b: f"({a.code} {term.op} {b.code})",
    )
    twin = CompiledGate(configuration(), GateMode.CHECKED)
    asked = request("quickly", "carry", load=1.6, gait=0.0625, stop_pressed=stopped)
    # The bound as a double is above 1/10 too, and equal to the product.
    assert Fraction(1.6) * Fraction(0.0625) == Fraction(0.1) > Fraction(1, 10)
    with pytest.raises(GateDisagreementError):
        asked.decided_by(twin)


def test_state_that_nothing_reads_and_the_order_of_readings_change_nothing() -> None:
    asked = request(speed=0.5, human_distance=1.0)
    turned = measured(dict(reversed({**STATE, "human_distance": 1.0, "dirt": 0.25}.items())))
    same = Request(asked.caller, turned, Action("move", dict(asked.action.parameters)))
    for mode in GateMode:
        assert asked.decided_by(gate(mode)) == same.decided_by(gate(mode))
