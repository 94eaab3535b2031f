"""Generated cases are well formed, of every kind, and hard."""

from __future__ import annotations

import math
from collections import Counter
from fractions import Fraction
from functools import cache
from typing import Any

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.random_conditions import (
    ConditionCase,
    cases,
    conditions,
    exact_environment,
    reals,
    to_scalars,
    vocabulary_ranges,
)
from aeros.spec.expr.random_terms import JOINT, MODE, VARIABLES
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.types import IntegerType, RealType


def drawn(strategy: st.SearchStrategy[Any], count: int) -> list[Any]:
    """As many examples, the same on every run."""
    found: list[Any] = []

    @settings(
        max_examples=count,
        derandomize=True,
        database=None,
        phases=(Phase.generate,),
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def note(one: Any) -> None:
        found.append(one)

    note()
    return found


@cache
def drawn_cases() -> list[ConditionCase]:
    return drawn(cases(), 40)


@cache
def drawn_conditions() -> list[t.Term]:
    return drawn(conditions(), 300)


def nodes(term: t.Term) -> list[t.Term]:
    return [term, *(inner for child in t.children(term) for inner in nodes(child))]


def test_every_kind_of_term_but_those_about_the_past_is_generated() -> None:
    met = {type(node) for term in drawn_conditions() for node in nodes(term)}
    assert met == {*t._FIELDS} - {t.Previously, t.Since, t.Occurrences}


def test_every_operator_and_kind_is_generated() -> None:
    every = [node for term in drawn_conditions() for node in nodes(term)]
    assert {node.op for node in every if isinstance(node, t.Compare)} == {"<", "<=", "=="}
    kinds = {node.kind for node in every if isinstance(node, t.Extremum | t.Quantified | t.Aggregate)}
    assert kinds == {"min", "max", "all", "any", "sum", "count"}
    assert {node.index.type for node in every if isinstance(node, t.Quantified)} == {JOINT, MODE}
    assert {name for term in drawn_conditions() for name in t.variables_of(term)} == {*VARIABLES}


def _is_bound(term: t.Term, indices: tuple[t.BoundVariable, ...] = ()) -> bool:
    if isinstance(term, t.BoundVariable):
        return term in indices
    if isinstance(term, t.Quantified | t.Aggregate):
        assert term.index not in indices
        return _is_bound(term.body, (*indices, term.index))
    return all(_is_bound(child, indices) for child in t.children(term))


def test_an_index_stands_only_inside_its_quantifier() -> None:
    assert all(map(_is_bound, drawn_conditions()))


def test_every_term_can_be_evaluated_as_its_type_says() -> None:
    env = exact_environment(drawn_cases()[0].values)
    assert all(type(evaluate(term, env)) is bool for term in drawn_conditions())
    assert all(type(evaluate(term, env)) is Fraction for term in drawn(reals(), 30))


def test_every_real_value_is_inside_its_range_and_whole_where_it_must_be() -> None:
    for case in drawn_cases():
        assert case.values.keys() == VARIABLES.keys()
        scalars = to_scalars(case.values)
        assert scalars.keys() == {one.name for of in VARIABLES.values() for one in scalar_variables(of)}
        for name, (low, high) in case.ranges.items():
            value = scalars[name]
            assert isinstance(value, float)
            assert low <= Fraction(value) <= high
        assert case.values["laps"] == int(case.values["laps"])  # type: ignore[arg-type]


def test_values_are_often_hard_to_decide_at() -> None:
    met = Counter[str]()
    for case in drawn_cases():
        for name, value in to_scalars(case.values).items():
            if isinstance(value, float) and name in case.ranges:
                low, high = case.ranges[name]
                met["end"] += Fraction(value) in (low, high)
                met["nearest inside"] += value in (float(low), float(high)) and Fraction(value) not in (
                    low,
                    high,
                )
                met["minus zero"] += value == 0 and math.copysign(1, value) < 0
                met["subnormal"] += 0 < abs(value) < 2.0**-1022
                met["near one"] += value in (math.nextafter(1, 0), math.nextafter(1, 2))
    assert min(met[name] for name in ("end", "nearest inside", "minus zero", "subnormal", "near one")) > 0


def test_there_is_one_range_for_each_real_variable_and_its_parts() -> None:
    reals_ = {
        one.name
        for of in VARIABLES.values()
        for one in scalar_variables(of)
        if isinstance(one.type, RealType)
    }
    for ranges in drawn(vocabulary_ranges(), 20):
        assert ranges.keys() == reals_
        assert ranges["p.x"] == ranges["p.y"] == ranges["p.z"]
        assert ranges["joint[j1]"] == ranges["joint[j3]"]
        assert all(low < high for low, high in ranges.values())
        assert isinstance(VARIABLES["laps"].type, IntegerType)
        assert all(end.denominator == 1 for end in ranges["laps"])


def test_measured_values_are_read_exactly() -> None:
    assert exact_environment({"x": 0.1, "a": True, "mode": "idle", "p": (0.5, -0.0, 2.0)}) == {
        "x": Fraction(3602879701896397, 2**55),
        "a": True,
        "mode": "idle",
        "p": (Fraction(1, 2), Fraction(0), Fraction(2)),
    }
    assert exact_environment({"ready": (True, False)}) == {"ready": (True, False)}


def test_vectors_and_families_are_split_into_their_parts() -> None:
    scalars = to_scalars(drawn_cases()[0].values)
    p, ready = drawn_cases()[0].values["p"], drawn_cases()[0].values["ready"]
    assert (scalars["p.x"], scalars["p.y"], scalars["p.z"]) == p
    assert tuple(scalars[f"ready[{member}]"] for member in JOINT.members) == ready
