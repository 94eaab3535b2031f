"""The generated decision of one skill and kind: it allows, denies, returns the scalars, or has no answer."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from math import inf, nan, nextafter
from typing import Any

import pytest

from aeros.runtime.gate.compiled.fast_path import (
    DecisionCriteria,
    FastDecide,
    SnapshotCache,
    compile_fast_path,
    compile_read_each,
    decide_fast,
)
from aeros.runtime.gate.decision import Caller, Decision, DecisionKind, Reason
from aeros.runtime.gate.value_check import value_checkers
from aeros.runtime.ports import ColumnNames, Reading, Snapshot
from aeros.skill import Action
from aeros.spec.backends.compiled import compile_conditions
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, VectorType
from aeros.spec.expr.units import LENGTH
from aeros.spec.model.policy import Quota
from aeros.spec.model.variables import ranges_of
from tests.unit.runtime.conftest import METRES, SPAN, declare

NOW = 100.0
STATE = {
    "distance": declare(
        "distance", METRES, t.VariableRole.STATE, range=(Fraction(0), Fraction(9)), max_age=Fraction(1, 10)
    ),
    "hand": declare("hand", VectorType(LENGTH), t.VariableRole.STATE, range=(Fraction(-2), Fraction(2))),
    "pressed": declare("pressed", BOOL, t.VariableRole.STATE, max_age=Fraction(1)),
}
INPUTS = {"careful": declare("inputs.careful", BOOL, t.VariableRole.INPUT)}
PARAMETERS = {
    "speed": declare("speed", METRES, t.VariableRole.PARAMETER, range=(Fraction(0), Fraction(5))),
    "target": declare(
        "target", VectorType(LENGTH), t.VariableRole.PARAMETER, range=(Fraction(-2), Fraction(2))
    ),
}
QUOTAS = (
    Quota("moves", frozenset({"move"}), 3, Fraction(60), SPAN),
    Quota("lifts", frozenset({"lift"}), 3, Fraction(60), SPAN),
)
CALLER = Caller("handling", "lift", {"careful": True})
ACTION = Action("move", {"speed": 1.0, "target": (0.5, 0.0, 0.25)})
FAR, SLOW, FREE = "distance >= 1", "speed <= 2", "not pressed"


def at_most(name: str, bound: int) -> t.Term:
    return t.Compare("<=", t.Variable(name, METRES, t.VariableRole.PARAMETER), literal(bound))


def literal(bound: int) -> t.Term:
    return t.Literal(Fraction(bound), METRES)


RULES: dict[str, t.Term] = {
    FAR: t.Compare("<=", literal(1), STATE["distance"].variable),
    FREE: t.Not(STATE["pressed"].variable),
}


class Denials:
    """Makes denials that name the conditions that failed; counts them."""

    def __init__(self, names: list[str], *, reducible: str = "") -> None:
        self.names, self.reducible, self.made = names, reducible, 0

    def __call__(self, holds: tuple[bool, ...]) -> Decision | None:
        self.made += 1
        failed = [name for name, held in zip(self.names, holds, strict=True) if not held]
        if failed == [self.reducible]:
            return None
        return Decision(DecisionKind.DENY, None, tuple(Reason("AE750", name, name) for name in failed))


def compiled(
    *, can_allow: bool = True, kind: str = "move", reducible: str = "", quotas: tuple[Quota, ...] = QUOTAS
) -> tuple[FastDecide, Denials]:
    """Envelope: at most 2 m/s; permission: at most 3 m/s; both rules are residual."""
    state = value_checkers(STATE)
    required = frozenset({"distance", "pressed"})
    of_kind = [quota.id for quota in quotas if kind in quota.kinds]
    denials = Denials([*of_kind, "envelope", "permission", *RULES], reducible=reducible)
    function = compile_fast_path(
        DecisionCriteria(
            can_allow,
            at_most("speed", 2),
            at_most("speed", 3),
            t.conjunction(*RULES.values()),
            compile_conditions(RULES.values(), ranges_of([*STATE.values(), *PARAMETERS.values()])),
            denials,
        ),
        inputs=value_checkers({one.name: one for one in INPUTS.values()}),
        state=state,
        snapshot_cache=SnapshotCache(state),
        read_each=compile_read_each(state, required),
        required=required,
        parameters=value_checkers(PARAMETERS),
        quotas=quotas,
        kind=kind,
    )
    return function, denials


@cache
def usual() -> FastDecide:
    return compiled()[0]


VALUES: Mapping[str, Any] = {"distance": 3.0, "hand": (0.0, 0.0, 0.5), "pressed": False}
WANTED: Mapping[str, Any] = {"speed": 1.0, "target": (0.5, 0.0, 0.25)}
USAGE = {"moves": 0, "lifts": 9}


def readings(time: Any = NOW, **changed: Any) -> dict[str, Any]:
    return {name: Reading(value, time) for name, value in {**VALUES, **changed}.items()}


def snapshot(time: Any = NOW, **changed: Any) -> Snapshot:
    values = {**VALUES, **changed}
    order = ColumnNames(values)
    return Snapshot(order, tuple(values[name] for name in order.names), time)


def ask(
    function: FastDecide | None = None,
    *,
    inputs: Any = None,
    readings: Any = None,
    parameters: Any = None,
    now: Any = NOW,
    usage: Any = None,
) -> Any:
    """The answer; the same for readings one by one and, if there are none given, for a snapshot."""
    function = function or usual()
    inputs = {"careful": True} if inputs is None else inputs
    parameters = WANTED if parameters is None else parameters
    usage = USAGE if usage is None else usage
    if readings is not None:
        return function(inputs, readings, parameters, now, usage)
    one_by_one = function(inputs, globals()["readings"](), parameters, now, usage)
    assert function(inputs, snapshot(), parameters, now, usage) == one_by_one
    return one_by_one


def failed(answer: Any) -> list[str]:
    assert type(answer) is Decision
    assert answer.kind is DecisionKind.DENY
    return [reason.rule for reason in answer.reasons]


# ALLOW and DENY.


def test_an_action_is_allowed_in_the_form_that_plants_expect() -> None:
    assert ask() == Decision(DecisionKind.ALLOW, Action("move", dict(WANTED)), ())
    answer = ask(parameters={"speed": 1, "target": [0, 0.5, -2]})
    assert answer.action == Action("move", {"speed": 1.0, "target": (0.0, 0.5, -2.0)})
    assert repr(answer.action.parameters) == "{'speed': 1.0, 'target': (0.0, 0.5, -2.0)}"


def test_the_action_is_not_the_callers_own_mapping() -> None:
    asked = dict(WANTED)
    answer = ask(parameters=asked)
    asked["speed"] = 5.0
    assert answer.action.parameters["speed"] == 1.0


@pytest.mark.parametrize(
    ("speed", "changed", "expected"),
    [
        (2.5, {}, ["envelope"]),
        (3.5, {}, ["envelope", "permission"]),
        (2.0, {"distance": 1.0}, []),
        (1.0, {"distance": nextafter(1.0, 0.0)}, [FAR]),
        (1.0, {"pressed": True}, [FREE]),
        (4.0, {"pressed": True, "distance": 0.0}, ["envelope", "permission", FAR, FREE]),
    ],
)
def test_every_condition_that_fails_is_in_the_denial(
    speed: float, changed: dict[str, Any], expected: list[str]
) -> None:
    for measured in (readings(**changed), snapshot(**changed)):
        answer = ask(readings=measured, parameters={**WANTED, "speed": speed})
        assert (failed(answer) if expected else answer.kind) == (expected or DecisionKind.ALLOW)


def test_a_quota_on_the_kind_denies_when_it_is_used_up() -> None:
    assert ask(usage={**USAGE, "moves": 2}).kind is DecisionKind.ALLOW
    for used in (3, 4, 10**30):
        assert failed(ask(usage={**USAGE, "moves": used})) == ["moves"]


def test_without_quotas_usage_is_empty() -> None:
    function, _ = compiled(quotas=())
    assert ask(function, usage={}).kind is DecisionKind.ALLOW
    assert ask(function, usage={"moves": 0}) is None


def test_where_the_finite_layers_object_nothing_is_allowed() -> None:
    function, denials = compiled(can_allow=False)
    assert failed(ask(function)) == []
    assert denials.made == 1


def test_denials_are_cached_by_what_failed() -> None:
    function, denials = compiled()
    fast = {**WANTED, "speed": 2.5}
    assert ask(function, parameters=fast) is ask(function, parameters=fast)
    assert denials.made == 1
    ask(function, readings=readings(pressed=True))
    assert denials.made == 2


def test_scalars_are_returned_where_a_reduced_action_may_remain() -> None:
    function, _ = compiled(reducible=FAR)
    near = {"distance": 0.5}
    expected = {
        "inputs.careful": True,
        "speed": 1.0,
        "target.x": 0.5,
        "target.y": 0.0,
        "target.z": 0.25,
        "distance": 0.5,
        "pressed": False,
    }
    for measured in (readings(**near), snapshot(**near)):
        assert ask(function, readings=measured) == expected
    assert failed(ask(function, readings=readings(distance=0.5, pressed=True))) == [FAR, FREE]


# No answer when in doubt.


class Sly(dict[str, Any]):
    """A mapping that could run code of the caller."""


class Name(str):
    """A name that could run code of the caller."""

    __slots__ = ()


@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"speed": 1.0},
        {**WANTED, "extra": 1.0},
        {"speed": 1.0, "extra": (0.0, 0.0, 0.0)},
        {**WANTED, "speed": nan},
        {**WANTED, "speed": inf},
        {**WANTED, "speed": -0.5},
        {**WANTED, "speed": 5.5},
        {**WANTED, "speed": True},
        {**WANTED, "speed": "1"},
        {**WANTED, "target": (0.0, 0.0)},
        {**WANTED, "target": (0.0, 0.0, 2.5)},
        {**WANTED, "target": None},
        Sly(WANTED),
        {Name("speed"): 1.0, "target": (0.0, 0.0, 0.0)},
        [],
        None,
    ],
)
def test_malformed_parameters_have_no_answer(parameters: Any) -> None:
    assert usual()({"careful": True}, readings(), parameters, NOW, USAGE) is None


@pytest.mark.parametrize(
    "inputs", [{}, {"careful": 1}, {"careful": True, "more": 1}, {"inputs.careful": True}, None]
)
def test_malformed_inputs_have_no_answer(inputs: Any) -> None:
    assert usual()(inputs, readings(), WANTED, NOW, USAGE) is None


@pytest.mark.parametrize(
    "usage",
    [
        {},
        {"lifts": 0},
        {"moves": -1, "lifts": 0},
        {"moves": True, "lifts": 0},
        {"moves": 0.0, "lifts": 0},
        {"moves": 0, "lifts": -1},
        {"moves": 0, "lifts": None},
        {**USAGE, "others": 0},
        {"moves": 0, "lifts": 9, 1: 0},
        Sly(USAGE),
        None,
    ],
)
def test_malformed_usage_has_no_answer(usage: Any) -> None:
    assert usual()({"careful": True}, readings(), WANTED, NOW, usage) is None


def test_a_count_of_another_kinds_quota_may_be_missing() -> None:
    assert ask(usage={"moves": 0}).kind is DecisionKind.ALLOW


@pytest.mark.parametrize("now", [nan, inf, -inf, None, "100", True, 2.0**53 + 2, -(2**53) - 1, 10**400])
def test_a_time_that_no_clock_shows_has_no_answer(now: Any) -> None:
    assert ask(readings=readings(0.0), now=now) is None
    assert ask(readings=snapshot(0.0), now=now) is None


@pytest.mark.parametrize(
    ("now", "time", "is_answered"),
    [
        (100, 100, True),
        (100.0, 100, True),
        (100, 100.0, True),
        (100.0, 99.95, True),
        (100.0, 99.0, False),
        (100.0, 99.89, False),
        (100.0, 100.5, False),
        (100.0, nextafter(100.0, 101.0), False),
        (100.0, nan, False),
        (100.0, None, False),
        (100.0, True, False),
        (-(2.0**53), -(2.0**53), True),
        (2.0**53, 2.0**53, True),
        (2**53, 2**53, True),
        (-(2.0**53), -(2.0**53) - 2, False),
    ],
)
def test_readings_are_neither_stale_nor_of_the_future(now: Any, time: Any, is_answered: bool) -> None:
    for measured in (readings(time), snapshot(time)):
        assert (ask(readings=measured, now=now) is not None) is is_answered


def test_each_reading_has_a_limit_of_its_own_age() -> None:
    old = {**readings(), "pressed": Reading(False, 99.5), "hand": Reading((0.0, 0.0, 0.0), 1.0)}
    assert ask(readings=old).kind is DecisionKind.ALLOW
    assert ask(readings={**old, "pressed": Reading(False, 98.5)}) is None
    assert ask(readings={**old, "distance": Reading(3.0, 99.5)}) is None


@pytest.mark.parametrize(
    "changed",
    [
        {"distance": nan},
        {"distance": 9.5},
        {"distance": None},
        {"pressed": 0},
        # Not required, and yet checked if it is there.
        {"hand": (0.0, 0.0, 2.5)},
        {"hand": (0.0, 0.0)},
        {"mood": 1.0},
    ],
)
def test_a_malformed_or_unknown_reading_has_no_answer(changed: dict[str, Any]) -> None:
    assert ask(readings=readings(**changed)) is None
    assert ask(readings=snapshot(**changed)) is None


def test_only_values_that_no_condition_reads_may_be_missing() -> None:
    for name, is_answered in (("hand", True), ("distance", False), ("pressed", False)):
        values = {key: value for key, value in VALUES.items() if key != name}
        measured = {key: Reading(value, NOW) for key, value in values.items()}
        order = ColumnNames(values)
        together = Snapshot(order, tuple(values[key] for key in order.names), NOW)
        assert (ask(readings=measured) is not None) is is_answered
        assert (ask(readings=together) is not None) is is_answered


@pytest.mark.parametrize(
    "odd",
    [
        None,
        [],
        Sly(readings()),
        dict([*readings().items(), (1, 2)]),
        {**readings(), "distance": 3.0},
        {**readings(), "distance": (3.0, NOW)},
        {**readings(), "distance": tuple.__new__(Reading, ())},
        object.__new__(Snapshot),
    ],
)
def test_readings_of_another_form_have_no_answer(odd: Any) -> None:
    assert usual()({"careful": True}, odd, WANTED, NOW, USAGE) is None


def test_a_reader_returns_the_scalars_of_required_readings_alone() -> None:
    state = value_checkers(STATE)
    read = compile_read_each(state, frozenset({"hand", "distance"}))
    assert read(readings(), NOW, NOW) == (3.0, 0.0, 0.0, 0.5)
    with pytest.raises(KeyError):
        read({"distance": Reading(1.0, NOW)}, NOW, NOW)
    nothing = compile_read_each(state, frozenset())
    assert nothing({}, NOW, NOW) == ()
    assert nothing({"mood": Reading(1.0, NOW)}, NOW, NOW) is None


# Finding the function of a request.


def test_a_request_is_decided_by_the_function_of_its_module_skill_and_kind() -> None:
    functions = {("handling", "lift", "move"): usual()}

    def decided(caller: Any = CALLER, action: Any = ACTION) -> Any:
        return decide_fast(functions, caller, readings(), action, NOW, USAGE)

    assert decided() == ask()
    assert decided(Caller("others", "lift", {"careful": True})) is None
    assert decided(Caller("handling", "drop", {"careful": True})) is None
    assert decided(action=Action("stop", {})) is None
    assert decided(Caller("handling", Name("lift"), {"careful": True})) is None
    assert decided(Caller(Name("handling"), "lift", {"careful": True})) is None
    assert decided(action=Action(Name("move"), ACTION.parameters)) is None
    assert decided(None) is None
    assert decided(object.__new__(Caller)) is None
    assert decided(action=("move", ACTION.parameters)) is None
    assert decided(action=tuple.__new__(Action, ("move",))) is None


# Caches.


def test_a_snapshot_with_the_same_values_is_unpacked_once() -> None:
    cache = SnapshotCache(value_checkers(STATE))
    one = snapshot()
    first = cache.scalars(one)
    assert first == {"distance": 3.0, "hand.x": 0.0, "hand.y": 0.0, "hand.z": 0.5, "pressed": False}
    assert cache.scalars(Snapshot(one.order, one.column, NOW + 1)) is first
    assert cache.scalars(Snapshot(ColumnNames(one.order.names), one.column, NOW)) is not first


def test_a_list_in_a_snapshot_is_never_kept() -> None:
    cache = SnapshotCache(value_checkers(STATE))
    assert cache.scalars(snapshot(hand=[0.0, 0.0, 0.5])) is None


def test_scalars_of_values_that_changed_replace_the_cached_ones() -> None:
    cache = SnapshotCache(value_checkers(STATE))
    one = snapshot()
    cached = cache.scalars(one)
    assert cached is not None
    before = dict(cached)
    nearer = Snapshot(one.order, tuple(0.5 if value == 3.0 else value for value in one.column), NOW)
    assert cache.scalars(nearer) == {**before, "distance": 0.5}
    assert cached == before
    broken = Snapshot(one.order, tuple(nan if value == 3.0 else value for value in one.column), NOW)
    assert cache.scalars(broken) is None
    assert cache.scalars(nearer) == {**before, "distance": 0.5}


@pytest.mark.parametrize("malformed", ["two", None, [True]])
def test_malformed_values_of_modules_are_left_out_and_the_rest_is_unpacked(malformed: Any) -> None:
    own = {name: declare(name, BOOL, t.VariableRole.STATE) for name in ("a.first", "b.second")}
    cache = SnapshotCache(value_checkers({**STATE, **own}), frozenset(own))
    order = ColumnNames([*own, *VALUES])

    def scalars(first: Any, second: Any) -> Any:
        values = {"a.first": first, "b.second": second, **VALUES}
        found = cache.scalars(Snapshot(order, tuple(values[name] for name in order.names), NOW))
        return found and {name: value for name, value in found.items() if "." in name and "hand" not in name}

    assert scalars(malformed, True) == {"b.second": True}
    assert scalars(False, True) == {"a.first": False, "b.second": True}
    assert scalars(malformed, False) == {"b.second": False}
    assert scalars(malformed, malformed) == {}
    assert cache.scalars(Snapshot(ColumnNames(["other"]), (True,), NOW)) is None
