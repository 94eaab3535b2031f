"""Rules of monitors: the first that fails, and the fast check of ticks against them."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import nan, nextafter
from random import Random
from types import FrameType
from typing import Any

import pytest

from aeros.runtime.gate.compiled.rules import (
    CompiledRuleSet,
    FastTickCheck,
    MonitorRules,
    _split_interval_bounds,
)
from aeros.runtime.gate.conditions import CompiledCondition, ConditionValue
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.gate.value_check import ValueChecker
from aeros.runtime.gate.violation import RuleViolation
from aeros.spec.backends.compiled import compile_conditions
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, IntegerType
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.rules import Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import History, ranges_of
from aeros.spec.text.discovery import reference_site_path
from tests.unit.runtime.bench import PARAMETERS, STATE, unproved
from tests.unit.runtime.conftest import METRES, SPAN, declare
from tests.unit.runtime.together import configuration as cart
from tests.unit.runtime.together import move, roll


@cache
def bench_rules() -> MonitorRules:
    return MonitorRules(unproved().site)


def scalars(kind: str, **changed: Any) -> dict[str, Any]:
    """Scalars of the state and of the parameters that bench.py allows, some of them changed."""
    found: dict[str, Any] = {}
    for unpackers, values in (
        (bench_rules().unpackers, STATE),
        (bench_rules().parameters[kind], PARAMETERS[kind]),
    ):
        for name, value in {**values, **{n: v for n, v in changed.items() if n in values}}.items():
            found.update(unpackers[name](value) or {})
    return found


def broken(kind: str, **changed: Any) -> str | None:
    found = bench_rules().by_kind[kind].first_violation(scalars(kind, **changed))
    return found.rule if isinstance(found, RuleViolation) else found


# The rules of a kind.


def test_rules_read_the_state_variables_of_their_terms() -> None:
    assert bench_rules().by_kind["move"].reads == ("fitted", "hand", "human_distance", "stop_pressed")
    assert bench_rules().by_kind["stop"].reads == ()


def test_the_kind_for_backing_off_is_that_of_the_site() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    assert site.motion is not None
    backing = replace(site, motion=replace(site.motion, back_off="wait"))
    assert MonitorRules(backing).back_off == "wait"
    assert bench_rules().back_off is None


def test_a_malformed_value_has_no_scalars() -> None:
    assert bench_rules().unpackers["hand"]([0, 1, 2]) == {"hand.x": 0.0, "hand.y": 1.0, "hand.z": 2.0}
    assert bench_rules().unpackers["hand"]((0.0, 1.0)) is None
    assert bench_rules().unpackers["load"](nan) is None
    assert bench_rules().parameters["move"]["speed"](6.0) is None


@pytest.mark.parametrize(
    ("kind", "changed", "rule"),
    [
        ("move", {}, None),
        ("carry", {}, None),
        ("stop", {"stop_pressed": True}, None),
        ("move", {"stop_pressed": True}, "stop-button"),
        ("move", {"human_distance": 0.5}, None),
        ("move", {"human_distance": nextafter(0.5, 0.0)}, "separation"),
        ("move", {"speed": 0.3, "human_distance": 1.0}, "near-person"),
        ("carry", {"joint_ready": (False, False)}, "some-joint-ready"),
        # The first in the order of the site.
        ("move", {"speed": 0.6, "stop_pressed": True}, "stop-button"),
        ("move", {"speed": 0.6, "fitted": "knife"}, "knife-speed"),
    ],
)
def test_the_first_rule_that_fails_is_found(kind: str, changed: dict[str, Any], rule: str | None) -> None:
    assert broken(kind, **changed) == rule


def test_a_violation_has_the_rules_term_and_the_values_it_read() -> None:
    found = bench_rules().by_kind["move"].first_violation(scalars("move", human_distance=0.25))
    assert isinstance(found, RuleViolation)
    (rule,) = (one for one in unproved().site.rules if one.id == "separation")
    assert found == RuleViolation("separation", rule.terms["move"], {"human_distance": 0.25})


def test_a_missing_scalar_is_named_unless_an_earlier_rule_fails() -> None:
    rules = bench_rules().by_kind["move"]
    values = scalars("move")
    for name in ("hand.x", "hand.y"):
        del values[name]
    assert rules.first_violation(values) == "input:hand.x"
    failed = rules.first_violation({**values, "stop_pressed": True})
    assert isinstance(failed, RuleViolation)
    assert failed.rule == "stop-button"


def test_a_set_of_one_rule_is_evaluated_without_a_joint_function() -> None:
    gap = declare("gap", METRES, t.VariableRole.STATE, range=(Fraction(0), Fraction(9)))
    term = t.Compare("<=", t.Literal(Fraction(1), METRES), gap.variable)
    rules = CompiledRuleSet([("far", CompiledCondition(term, [gap]), term)], {"gap": "gap"})
    assert rules.reads == ("gap",)
    assert rules.first_violation({"gap": 1.0}) is None
    assert rules.first_violation({"gap": 0.5}) == RuleViolation("far", term, {"gap": 0.5})
    assert rules.first_violation({}) == "input:gap"


def test_rules_that_all_hold_are_decided_by_one_function() -> None:
    gap, load = (
        declare(name, METRES, t.VariableRole.STATE, range=(Fraction(0), Fraction(9)))
        for name in ("gap", "load")
    )
    terms = [t.Compare("<=", t.Literal(Fraction(1), METRES), one.variable) for one in (gap, load)]
    counted = [_CountedCondition(term, [gap, load]) for term in terms]
    rules = CompiledRuleSet(
        [("far", counted[0], terms[0]), ("full", counted[1], terms[1])],
        {"gap": "gap", "load": "load"},
        compile_conditions(terms, ranges_of([gap, load])),
    )
    assert rules.first_violation({"gap": 1.0, "load": 1.0}) is None
    assert [one.calls for one in counted] == [0, 0]
    assert rules.first_violation({"gap": 1.0, "load": 0.5}) == RuleViolation("full", terms[1], {"load": 0.5})
    assert [one.calls for one in counted] == [1, 1]


class _CountedCondition(CompiledCondition):
    """A condition that counts how often it is decided by itself."""

    calls = 0

    def decide(self, values: Any) -> ConditionValue:
        self.calls += 1
        return super().decide(values)


def test_joint_rules_come_with_the_parameters_that_they_read() -> None:
    rules = MonitorRules(cart().site)
    moving, rolling = ActiveAction(move(0.5), {}, 0.0, 1), ActiveAction(roll(0.75), {}, 0.0, 2)
    found = [
        (one.reads, values, one.first_violation({**values, "charge": 1.0, "hand": 2.0}))
        for one, values in rules.rules_for_pair(rolling, moving)
    ]
    assert [(reads, values) for reads, values, _ in found] == [
        ((), {"moving.speed": 0.5, "rolling.pace": 0.75}),
        (("charge",), {}),
        (("hand",), {"moving.speed": 0.5}),
    ]
    failed = [one.rule if isinstance(one, RuleViolation) else one for _, _, one in found]
    assert failed == ["not-fast-together", None, "hand-near-while-rolling"]


# The fast check of ticks.


def fast(kind: str = "carry", names: Any = STATE, **changed: Any) -> FastTickCheck:
    """A check of an action that was decided on the values of bench.py."""
    check = bench_rules().fast_check(kind, frozenset(names))
    assert check is not None
    check.decide(scalars(kind, **changed))
    return check


def test_a_violated_joint_rule_has_its_term_and_values() -> None:
    moving, rolling = ActiveAction(move(0.5), {}, 0.0, 1), ActiveAction(roll(0.75), {}, 0.0, 2)
    (rule,) = (one for one in cart().site.joint_rules if one.id == "not-fast-together")
    found = [
        rules.first_violation(values)
        for rules, values in MonitorRules(cart().site).rules_for_pair(rolling, moving)
    ]
    assert RuleViolation(rule.id, rule.term, {"moving.speed": 0.5, "rolling.pace": 0.75}) in found


def test_there_is_no_fast_check_of_unknown_variables() -> None:
    assert bench_rules().fast_check("move", frozenset({"mood"})) is None
    assert bench_rules().fast_check("move", frozenset()) is not None


def test_a_tick_of_other_variables_than_announced_does_not_hold() -> None:
    check = fast()
    assert check.holds(STATE)
    assert not check.holds({**STATE, "mood": 1})
    fewer = dict(STATE)
    assert fewer.pop("wind") == 0.0
    assert not check.holds(fewer)
    assert not check.holds({**fewer, "mood": 1})
    assert check.holds(dict(STATE))


def test_a_check_needs_every_parameter_that_the_rules_read() -> None:
    check = bench_rules().fast_check("carry", frozenset(STATE))
    assert check is not None
    values = scalars("carry")
    del values["gait"]
    with pytest.raises(KeyError):
        check.decide(values)


def test_the_state_that_is_not_measured_is_that_of_the_decision() -> None:
    names = [name for name in STATE if name != "human_distance"]
    measured = {name: STATE[name] for name in names}
    assert fast("move", names).holds(measured)
    assert not fast("move", names, human_distance=0.25).holds(measured)


def test_the_same_check_serves_another_action() -> None:
    check = fast("move")
    near = {**STATE, "human_distance": 1.0}
    assert check.holds(near)
    check.decide(scalars("move", speed=0.5))
    assert not check.holds(near)
    assert check.holds(STATE)


def test_a_rule_that_failed_fails_again_at_the_same_values() -> None:
    check = fast()
    bent = {**STATE, "joint_angle": (0.0, 2.125)}
    assert [check.holds(one) for one in (bent, bent, STATE, bent)] == [False, False, True, False]


def test_a_list_is_read_anew_every_tick() -> None:
    check, angles = fast(), [0.0, 0.0]
    measured = {**STATE, "joint_angle": angles}
    assert check.holds(measured)
    angles[1] = 2.125
    assert not check.holds(measured)
    angles[1] = nan
    assert not check.holds(measured)


def test_two_checks_share_nothing() -> None:
    one, other = fast("carry", gait=0.0625), fast("carry", gait=0.0)
    heavy = {**STATE, "load": 2.0}
    assert other.holds(heavy)
    assert not one.holds(heavy)
    assert other.holds(heavy)


_VALUES: tuple[Any, ...] = (
    0.0, 0.5, 1, 3.0, 1e9, nan, True, False, None, "brush", "knife", (0.25, -0.5), (0.25, nan), (3.5, 0.0),
    (True, False), (False, False), (0.25, 0.0, 0.25), [0.25, 0.75, 0.25],
)  # fmt: skip


@pytest.mark.parametrize("kind", ["move", "carry", "sweep", "stop"])
def test_a_fast_check_agrees_with_the_rules_at_every_tick(kind: str) -> None:
    chance = Random(5)  # noqa: S311 - a test, the same every time
    check, held = fast(kind), 0
    values = dict(STATE)
    for _ in range(400):
        values[chance.choice(list(STATE))] = chance.choice(_VALUES)
        if chance.random() < 0.4:
            values = dict(STATE)
        unpacked = [bench_rules().unpackers[name](value) for name, value in values.items()]
        if expected := None not in unpacked:
            merged = scalars(kind)
            for one in unpacked:
                merged.update(one or {})
            expected = bench_rules().by_kind[kind].first_violation(merged) is None
        assert check.holds(values) is expected, values
        held += expected
    assert 100 < held < 400


# Ranges that the rules imply are not checked twice.


def bounded(site: Site, *terms: t.Term, whole: bool = False) -> FastTickCheck:
    """The check of `gap`, from 0 to 9, under these rules."""
    type_ = IntegerType() if whole else METRES
    gap = declare("gap", type_, t.VariableRole.STATE, range=(Fraction(0), Fraction(9)))
    rules = tuple(
        Rule(f"rule{number}", "", "", "", {"move": term}, {}, SPAN, SPAN) for number, term in enumerate(terms)
    )
    check = MonitorRules(replace(site, state={"gap": gap}, rules=rules)).fast_check(
        "move", frozenset({"gap"})
    )
    assert check is not None
    check.decide({})
    return check


GAP = t.Variable("gap", METRES, t.VariableRole.STATE)


def literal(value: int) -> t.Term:
    return t.Literal(Fraction(value), METRES)


@pytest.mark.parametrize(
    ("terms", "inside", "outside"),
    [
        ([], [0.0, 9.0], [-0.5, 9.5]),
        ([t.Compare("<=", GAP, literal(5))], [0.0, 5.0], [-0.5, 5.5]),
        ([t.Compare("<=", literal(1), GAP)], [1.0, 9.0], [0.5, 9.5]),
        (
            [t.And((t.Compare("<=", GAP, literal(5)), t.Compare("<", literal(1), GAP)))],
            [1.5, 5.0],
            [1.0, 5.5],
        ),
        ([t.Compare("<=", t.Absolute(GAP), literal(5))], [0.0, 5.0], [-0.5, -5.0, 5.5]),
        ([t.Compare("<", GAP, literal(20)), t.Compare("<=", literal(-20), GAP)], [0.0, 9.0], [-1.0, 9.5]),
    ],
)
def test_values_beyond_the_declared_range_never_hold(
    site: Site, terms: list[t.Term], inside: list[float], outside: list[float]
) -> None:
    check = bounded(site, *terms)
    assert [value for value in inside if not check.holds({"gap": value})] == []
    doubtful = [*outside, nan, None, "1", True]
    assert [value for value in doubtful if check.holds({"gap": value})] == []


def test_a_whole_number_is_checked_even_if_rules_bound_it(site: Site) -> None:
    number = t.Variable("gap", IntegerType(), t.VariableRole.STATE)
    low, high = (t.Literal(Fraction(value), IntegerType()) for value in (1, 5))
    check = bounded(site, t.Compare("<=", low, number), t.Compare("<=", number, high), whole=True)
    assert check.holds({"gap": 2.0})
    assert not check.holds({"gap": 2.5})


def test_a_site_that_keeps_histories_has_no_fast_check(site: Site) -> None:
    assert MonitorRules(site).fast_check("move", frozenset()) is not None
    held = t.Variable("holding", BOOL, t.VariableRole.STATE)
    history = History(declare("was_held", BOOL, t.VariableRole.STATE), t.Since(t.TRUE, held, Fraction(1)))
    keeping = MonitorRules(replace(site, histories=(history,)))
    assert keeping.fast_check("move", frozenset()) is None


def test_a_check_is_generated_once_for_a_kind_and_its_measured_variables() -> None:
    rules = MonitorRules(unproved().site)
    one, other = (rules.fast_check("move", frozenset({"load"})) for _ in range(2))
    wind = rules.fast_check("move", frozenset({"wind"}))
    assert one is not None
    assert other is not None
    assert wind is not None
    assert one.holds is not other.holds
    assert one.holds.__code__ is other.holds.__code__
    assert wind.holds.__code__ is not one.holds.__code__


def test_the_cache_of_generated_checks_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.runtime.gate.compiled.rules._MAX_CACHED", 3)
    rules = MonitorRules(unproved().site)
    sizes = []
    for names in (["load"], ["load"], ["wind"], ["hand"], ["dirt"], ["load"]):
        assert rules.fast_check("move", frozenset(names)) is not None
        sizes.append(len(rules._quick))
    assert sizes == [1, 1, 2, 3, 1, 2]


# A tick at which little has changed takes little work.


def lines_run(check: FastTickCheck, measured: Mapping[str, Any]) -> int:
    """Count the lines of generated code that one tick runs."""
    count, before = 0, sys.gettrace()

    def trace(_frame: FrameType, event: str, _argument: Any) -> Any:
        nonlocal count
        count += event == "line"
        return trace

    sys.settrace(trace)
    try:
        assert check.holds(measured)
    finally:
        sys.settrace(before)
    return count


@pytest.mark.parametrize("kind", ["move", "carry"])
def test_rules_on_values_that_stay_the_same_objects_are_not_decided_again(kind: str) -> None:
    check = fast(kind)
    first, again = lines_run(check, STATE), lines_run(check, STATE)
    changed = {**STATE, "hand": (0.25, 0.0, 0.125), "load": 0.25}
    after = lines_run(check, changed)
    assert again < after < first
    assert lines_run(check, changed) == again
    lists = {name: list(value) if type(value) is tuple else value for name, value in changed.items()}
    assert lines_run(check, lists) == lines_run(check, lists) > again


def test_variables_that_rules_only_bound_differ_from_those_that_they_compute_with() -> None:
    declared = {
        name: declare(name, METRES, t.VariableRole.STATE, range=(Fraction(0), Fraction(9)))
        for name in ("a", "b", "c", "d")
    }
    whole = declare("n", IntegerType(NUMBER), t.VariableRole.STATE, range=(Fraction(0), Fraction(9)))
    free = declare("f", METRES, t.VariableRole.STATE)
    a, b, c, d = (one.variable for one in declared.values())

    def literal(value: int) -> t.Term:
        return t.Literal(Fraction(value), METRES)

    terms = [
        t.conjunction(t.Compare("<=", a, literal(8)), t.Compare("<=", literal(1), a)),
        t.Compare("<", a, literal(9)),
        t.Compare("<=", literal(0), a),
        t.Compare("<=", t.Absolute(b), literal(3)),
        t.Compare("<=", literal(0), b),
        t.Compare("<", literal(1), c),
        t.Compare("<", c, literal(10)),
        t.Compare("<=", t.Add(a, d), literal(9)),
        t.Compare("<=", whole.variable, literal(3)),
        t.Compare("<=", literal(1), whole.variable),
        t.Compare("<=", free.variable, literal(3)),
        t.Compare("<=", literal(1), free.variable),
    ]
    checkers = [ValueChecker(one) for one in (free, whole, *declared.values())]
    assert _split_interval_bounds(terms, checkers) == (frozenset({"b"}), frozenset({"a", "d"}))
    assert _split_interval_bounds(terms[:7], checkers) == (frozenset({"a", "b"}), frozenset())
    assert _split_interval_bounds(terms[1:3], checkers) == (frozenset({"a"}), frozenset())
    assert _split_interval_bounds(terms[1:2], checkers) == (frozenset(), frozenset())
    assert _split_interval_bounds(terms[3:4], checkers) == (frozenset(), frozenset())
