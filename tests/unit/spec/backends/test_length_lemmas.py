from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.backends.length_lemmas import MAX_LENGTHS, length_lemmas
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.parser import parse
from aeros.spec.expr.random_terms import VARIABLES
from aeros.spec.expr.scope import Scope
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.typecheck.check import check
from aeros.spec.expr.types import BOOL
from tests.hypothesis_profiles import examples

_SIX = [f"{one}.{axis}" for one in "pq" for axis in "xyz"]


def lemmas(text: str) -> list[t.Implies]:
    lowered = lower(check(parse(text), Scope(VARIABLES), BOOL))
    return [one for one in length_lemmas(list(t.walk([lowered]))) if isinstance(one, t.Implies)]


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("norm(p) <= 1 m and norm(q) <= 3/2 * 1 m", 1),
        ("norm(p) <= x and norm(q) <= y", 1),
        ("norm(p) <= x and norm(p) <= y", 1),
        ("norm(p) <= 1 m", 0),
        ("dot(p, p) <= 2 m*m and norm(q) <= 1 m", 0),  # the root of 2 is irrational
        ("norm(p) <= 1 m and x * x + y * y <= 1 m*m", 0),  # not as many elements
        ("abs(p.x) + abs(p.y) + abs(p.z) <= x and norm(q) <= y", 2),
        ("abs(x) <= 1 m and norm(q) <= y", 0),
    ],
)
def test_each_two_lengths_have_a_lemma(text: str, count: int) -> None:
    assert len(lemmas(text)) == count


@examples(100)
@given(st.lists(st.integers(-3, 3), min_size=6, max_size=6), st.integers(-2, 6), st.integers(-2, 6))
def test_a_lemma_is_true_at_every_length(elements: list[int], x: int, y: int) -> None:
    point = {**dict(zip(_SIX, map(Fraction, elements), strict=True)), "x": Fraction(x), "y": Fraction(y)}
    for text in ("norm(p) <= x and norm(q) <= y", "abs(p.x) + abs(p.y) + abs(p.z) <= x and norm(q) <= y"):
        assert all(is_true(one, point) for one in lemmas(text))


def test_a_lemma_is_as_sharp_as_can_be() -> None:
    (lemma,) = lemmas("norm(p) <= x and norm(q) <= y")
    along = dict(zip(_SIX, map(Fraction, (2, 4, 4, 1, 2, 2)), strict=True))
    point = {**along, "x": Fraction(6), "y": Fraction(3)}
    assert is_true(lemma.premise, point)
    assert isinstance(lemma.conclusion, t.And)
    _, most = lemma.conclusion.operands
    assert isinstance(most, t.Compare)
    assert not is_true(t.Compare("<", most.left, most.right), point)  # both sides are 18


def test_of_many_lengths_the_first_are_related() -> None:
    many = " and ".join(f"norm(p) <= {number} m" for number in range(1, 2 * MAX_LENGTHS))
    assert len(lemmas(many)) == MAX_LENGTHS * (MAX_LENGTHS - 1) // 2
