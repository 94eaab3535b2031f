from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.lemmas import MAX_LEMMAS, lemmas_for, relating_lemmas
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import values_by_scalar
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_conditions import ConditionCase, cases, exact_environment
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL, EnumType, RealType
from aeros.spec.expr.units import LENGTH
from tests.hypothesis_profiles import examples

_JOINT = VARIABLES["arm"].type
assert isinstance(_JOINT, EnumType)
_SCOPE = Scope(VARIABLES, enums={"Joint": _JOINT})


def terms_of(*texts: str) -> list[t.Term]:
    return [check(parse(text), _SCOPE, BOOL) for text in texts]


@examples(60)
@given(cases())
def test_every_lemma_is_true_at_every_point(case: ConditionCase) -> None:
    point = values_by_scalar(VARIABLES, exact_environment(case.values))
    terms = [case.term, t.Not(case.term)]
    nearby = {name: float(value) for name, value in point.items() if isinstance(value, bool | Fraction)}
    for lemma in (*lemmas_for(terms), *lemmas_for(terms, near=nearby)):
        assert is_true(lemma, point)


@pytest.mark.parametrize("text", ["x <= y", "2 * x + y <= 4 m", "not x < y"])
def test_a_question_without_products_counts_and_absolute_values_needs_none(text: str) -> None:
    assert lemmas_for(terms_of(text)) == []


def test_an_absolute_value_bounds_its_operand_on_both_sides() -> None:
    assert len(lemmas_for(terms_of("abs(x) <= y"))) == 2
    assert relating_lemmas(terms_of("abs(x) <= y")) == []


def test_there_is_an_end_to_the_lemmas() -> None:
    (one,) = terms_of("abs(x) <= 4 m")
    assert isinstance(one, t.Compare)
    sizes = [
        t.Absolute(t.Add(one.left, t.Literal(Fraction(number), RealType(LENGTH))))
        for number in range(MAX_LEMMAS)
    ]
    assert len(lemmas_for([t.Compare("<=", size, size) for size in sizes])) == MAX_LEMMAS


def test_a_count_is_related_to_the_numbers_that_are_compared() -> None:
    at_least = terms_of("all(joint[j] >= 0 m for j in Joint)", "count(joint[j] >= 1 m for j in Joint) >= 2")
    assert len(relating_lemmas(at_least)) == 3  # one for each joint
    at_most = terms_of("all(joint[j] <= 3 m for j in Joint)", "count(joint[j] <= 1 m for j in Joint) >= 2")
    assert len(relating_lemmas(at_most)) == 3
    unrelated = terms_of("all(joint[j] <= 3 m for j in Joint)", "count(joint[j] >= 4 m for j in Joint) >= 2")
    assert relating_lemmas(unrelated) == []


def test_a_count_bounds_what_is_compared_from_the_other_side_too() -> None:
    most = terms_of("all(joint[j] <= 3 m for j in Joint)", "count(joint[j] > 1 m for j in Joint) <= 2")
    assert len(relating_lemmas(most)) == 3
    least = terms_of("count(joint[j] < 1 m for j in Joint) <= 2")
    ranges = dict.fromkeys(("joint[j1]", "joint[j2]", "joint[j3]"), (Fraction(-2), Fraction(0)))
    assert len(relating_lemmas(least, ranges)) == 3
    assert relating_lemmas(least) == []


def test_a_product_is_related_to_the_absolute_value_of_a_factor() -> None:
    by_condition = relating_lemmas(terms_of("abs(x) <= 4 m", "abs(y) <= 2 m", "x * y <= 8 m*m"))
    by_range = relating_lemmas(
        terms_of("x * y <= 8 m*m", "abs(x) <= 7 m * 7"), {"y": (Fraction(-3), Fraction(2))}
    )
    bounds = [one for one in (*by_condition, *by_range) if isinstance(one, t.Implies)]
    assert len(bounds) == 3 + 3  # of each factor, and of `y` by its range; and their squares
    point = {"x": Fraction(4), "y": Fraction(2)}
    assert all(is_true(one, point) for one in bounds)


@examples(60)
@given(cases(), st.tuples(st.fractions(-5, 5), st.fractions(0, 5)))
def test_a_lemma_with_a_range_is_true_in_and_out_of_it(
    case: ConditionCase, range_: tuple[Fraction, Fraction]
) -> None:
    point = values_by_scalar(VARIABLES, exact_environment(case.values))
    low, width = range_
    for lemma in lemmas_for([case.term, t.Not(case.term)], dict.fromkeys(point, (low, low + width))):
        assert is_true(lemma, point)


def test_a_counted_condition_may_be_named_by_another() -> None:
    named = terms_of(
        "all(joint[j] >= 0 m and ready[j] == (joint[j] >= 1 m) for j in Joint)",
        "count(ready[j] for j in Joint) >= 2",
    )
    assert len(relating_lemmas(named)) == 3


@pytest.mark.parametrize(
    "texts",
    [
        ("all(joint[j] >= 0 m for j in Joint)", "count(joint[j] >= 2 m for j in Joint) >= 2"),
        ("all(joint[j] >= -1 m for j in Joint)", "count(joint[j] <= 2 m for j in Joint) <= 2"),
        ("all(joint[j] <= 3 m for j in Joint)", "count(joint[j] <= 1 m for j in Joint) >= 2"),
        ("all(joint[j] <= 3 m for j in Joint)", "count(joint[j] >= 1 m for j in Joint) <= 2"),
        ("all(joint[j] <= 1 m for j in Joint)", "count(joint[j] <= 1 m for j in Joint) >= 2"),
    ],
)
def test_a_lemma_of_a_count_is_true_everywhere_and_as_sharp_as_can_be(texts: tuple[str, str]) -> None:
    points = [
        {f"joint[j{number}]": Fraction(half, 2) for number in (1, 2, 3)} for half in range(-12, 13)
    ]  # from -6 to 6
    lemmas = relating_lemmas(terms_of(*texts))
    assert len(lemmas) == 3
    for lemma in lemmas:
        assert all(is_true(lemma, point) for point in points)
        assert isinstance(lemma, t.Implies)
        assert isinstance(lemma.conclusion, t.Compare)
        sharper = t.Implies(lemma.premise, t.Compare("<", lemma.conclusion.left, lemma.conclusion.right))
        assert not all(is_true(sharper, point) for point in points)
