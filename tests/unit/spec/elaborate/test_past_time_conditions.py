"""Past-time conditions and the histories that stand for them mean the same at every moment."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.past_time import HistoryCollector
from aeros.spec.expr import terms as t
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import JOINT
from aeros.spec.expr.semantics import TimedState, evaluate
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, IntegerType
from aeros.spec.expr.unparse import unparse
from tests.unit.spec.expr.scope import SCOPE

PAST = replace(SCOPE, past=True)
SPAN = Source("site.yaml", "text").span(0, 4)
A = "#.##..#....#"
READY = ("#...#.", ".#..#.", "......")


def _snapshots() -> list[dict[str, Any]]:
    return [
        {
            "a": A[second] == "#",
            "b": second % 3 == 0,
            "x": Fraction(second % 5),
            "ready": tuple(one[second % 6] == "#" for one in READY),
        }
        for second in range(len(A))
    ]


@pytest.mark.parametrize(
    "text",
    [
        "a and x <= 3 m",
        "previously a",
        "not previously previously a",
        "once within 2 s (a and x > 1 m)",
        "historically within 2 s (a or b)",
        "a since b",
        "a since within 1 s previously b",
        "count within 4 s (a) <= 2",
        "count within 4 s (a and not previously a) == 1",
        "(if once b then x else 0 m) <= 2 m",
        "all(once within 2 s ready[j] for j in Joint)",
        "any(previously ready[j] for j in Joint)",
        "sum(if once ready[j] then 1 else 0 for j in Joint) == 2",
        "count(once within 1 s ready[j] for j in Joint) >= 1",
        "previously all(ready[j] for j in Joint) or once any(ready[j] for j in Joint)",
        "once a and previously once a and b implies once a",
    ],
)
def test_a_condition_with_histories_agrees_with_the_trace(text: str) -> None:
    term = check(parse(text), PAST, BOOL)
    histories = HistoryCollector()
    flat = histories.replace_past_terms(term, SPAN)
    names = [one.declared.name for one in histories.collected]
    assert len(set(names)) == len(names)
    measured: list[TimedState] = []
    kept: list[TimedState] = []
    for second, values in enumerate(_snapshots()):
        measured.append(TimedState(Fraction(second), values))
        now = dict(values)
        kept.append(TimedState(Fraction(second), now))
        for one in histories.collected:
            now[one.declared.name] = evaluate(one.term, now, kept)
            assert all(evaluate(fact, now) for fact in one.declared.known_facts)
            assert one.declared.range is None or one.declared.range[0] <= now[one.declared.name]
        assert evaluate(flat, now) == evaluate(term, values, measured)


def test_equal_past_time_conditions_share_one_history() -> None:
    histories = HistoryCollector()
    for text in ("once a and not once a", "previously once a", "count within 5 s (a) <= 1"):
        histories.replace_past_terms(check(parse(text), PAST, BOOL), SPAN)
    assert [one.declared.name for one in histories.collected] == [
        "once a",
        "previously (once a)",
        "count within 5 s (a)",
    ]
    assert {one.declared.max_age for one in histories.collected} == {Fraction(0)}
    assert {one.declared.span for one in histories.collected} == {SPAN}


@pytest.mark.parametrize(
    ("text", "facts", "most"),
    [
        ("previously a", [], None),
        ("a since b", ["b implies `{}`", "`{}` implies (b or a)"], None),
        ("count within 5 s (a)", ["a implies (1 <= `{}`)"], 4096),
    ],
)
def test_the_facts_that_proofs_may_use_of_a_history(text: str, facts: list[str], most: int | None) -> None:
    histories = HistoryCollector()
    condition = f"{text} <= 1" if most else text
    histories.replace_past_terms(check(parse(condition), PAST, BOOL), SPAN)
    (one,) = histories.collected
    name = one.declared.name
    assert [unparse(fact).replace(name, f"`{name}`") for fact in one.declared.known_facts] == [
        fact.format(name) for fact in facts
    ]
    for fact in one.declared.known_facts:
        assert all(part.op == "<=" for part in fact_comparisons(fact))
    assert one.declared.variable.role is t.VariableRole.STATE
    assert one.declared.range == (None if most is None else (Fraction(0), Fraction(most)))
    assert one.declared.variable.type == (BOOL if most is None else IntegerType())


def fact_comparisons(term: t.Term) -> list[t.Compare]:
    below = [found for child in t.children(term) for found in fact_comparisons(child)]
    return [term, *below] if isinstance(term, t.Compare) else below


def test_each_member_of_an_index_has_a_history_at_the_place_of_the_rule() -> None:
    histories = HistoryCollector()
    histories.replace_past_terms(check(parse("all(previously ready[j] for j in Joint)"), PAST, BOOL), SPAN)
    ready = SCOPE.variables["ready"]
    assert [one.term for one in histories.collected] == [
        t.Previously(t.Select(ready, t.Literal(member, JOINT))) for member in JOINT.members
    ]
    assert {one.declared.span for one in histories.collected} == {SPAN}
