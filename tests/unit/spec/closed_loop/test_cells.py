"""Cells of quantities: conditions change at breakpoints and nowhere else."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.closed_loop.cells import NoCellsError, breakpoints, cells, values_between
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from tests.unit.agent.dumplings import term

LEVEL = "fill_level"
UNIT = (Fraction(0), Fraction(1))
HALF = Fraction(1, 2)
X = t.Variable(LEVEL, RealType(NUMBER), t.VariableRole.STATE)


def number(value: Fraction | int) -> t.Term:
    return t.Literal(Fraction(value), RealType(NUMBER))


_NUMBERS = st.builds(number, st.fractions(-2, 2, max_denominator=6))
_SUMS = st.recursive(
    st.one_of(_NUMBERS, st.just(X), st.just(X)),
    lambda inner: st.one_of(
        st.builds(t.Add, inner, inner),
        st.builds(t.Multiply, _NUMBERS, inner),
        st.builds(t.Absolute, inner),
        st.builds(t.Extremum, st.sampled_from(["min", "max"]), inner, inner),
        st.builds(t.Conditional, st.builds(t.Compare, st.just("<"), inner, inner), inner, inner),
    ),
    max_leaves=8,
)
_COMPARED = st.builds(t.Compare, st.sampled_from(["<", "<=", "=="]), _SUMS, _SUMS)


def test_cells_are_the_breakpoints_and_what_is_between_them() -> None:
    assert cells(UNIT, []) == (HALF,)
    assert cells(UNIT, [HALF, Fraction(3)]) == (Fraction(1, 4), HALF, Fraction(3, 4))
    assert cells(UNIT, [Fraction(0), Fraction(1)]) == (Fraction(0), HALF, Fraction(1))
    assert cells((HALF, HALF), []) == (HALF,)


def test_values_between_are_those_of_a_closed_range() -> None:
    values = cells(UNIT, [Fraction(1, 4), HALF])
    assert values_between(values, Fraction(1, 4), HALF) == (Fraction(1, 4), Fraction(3, 8), HALF)
    assert values_between(values, HALF, HALF) == (HALF,)


@given(_COMPARED, st.lists(st.fractions(-4, 4, max_denominator=30), min_size=2, max_size=6))
def test_a_condition_changes_nowhere_between_breakpoints(compared: t.Compare, tried: list[Fraction]) -> None:
    points = breakpoints(compared, LEVEL, {})
    for first, second in pairwise(sorted(tried)):
        if not any(first <= point <= second for point in points):
            assert is_true(compared, {LEVEL: first}) is is_true(compared, {LEVEL: second})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("fill_level > 0.5", {HALF}),
        ("not (0.25 <= fill_level) or dumpling_cooked", {Fraction(1, 4)}),
        ("abs(fill_level - 0.5) < 0.25", {Fraction(1, 4), HALF, Fraction(3, 4)}),
        ("dumpling_cooked", set()),
    ],
)
def test_breakpoints_are_found_in_any_condition(text: str, expected: set[Fraction]) -> None:
    assert breakpoints(lower(term(text)), LEVEL, {"dumpling_cooked": (False, True)}) == expected


def test_another_variable_is_tried_with_all_its_values() -> None:
    chosen = t.Conditional(term("area == pot"), number(1), number(0))
    compared = t.Compare("<", X, chosen)
    assert breakpoints(compared, LEVEL, {"area": ("table", "pot")}) == {Fraction(0), Fraction(1)}


@pytest.mark.parametrize(
    ("condition", "others", "message"),
    [
        (t.Compare("<", X, t.Multiply(X, X)), {}, "multiplies `fill_level` by itself"),
        (lower(term("fill_level < joint[j1]")), {}, "`fill_level` is compared with `joint\\[j1\\]`"),
        (lower(term("fill_level < joint[j1]")), {"joint[j1]": [0] * 5000}, "too many values"),
    ],
)
def test_a_comparison_without_cells_is_named(
    condition: t.Term, others: dict[str, list[int]], message: str
) -> None:
    with pytest.raises(NoCellsError, match=message):
        breakpoints(condition, LEVEL, others)


def test_two_quantities_are_not_compared() -> None:
    with pytest.raises(NoCellsError, match="`fill_level` is compared with `joint"):
        breakpoints(lower(term("fill_level < joint[j1]")), LEVEL, {"joint[j1]": (HALF,)}, ["joint[j1]"])
