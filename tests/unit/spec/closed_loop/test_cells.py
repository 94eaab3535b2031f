"""Cells of quantities: conditions change at breakpoints and nowhere else."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.closed_loop import cells as cells_module
from aeros.spec.closed_loop.cells import NoCellsError, breakpoints, cells, values_between
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER
from tests.hypothesis_profiles import examples
from tests.unit.agent.dumplings import term

LEVEL = "fill_level"
UNIT = (Fraction(0), Fraction(1))
HALF = Fraction(1, 2)
X = t.Variable(LEVEL, RealType(NUMBER), t.VariableRole.STATE)

_PART = t.Component(t.Vector(X, X, X), 0)


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


@examples(60)
@given(_COMPARED)
def test_a_condition_changes_nowhere_between_breakpoints(compared: t.Compare) -> None:
    assert_constant_between_breakpoints(compared)


def assert_constant_between_breakpoints(compared: t.Compare) -> None:
    points = breakpoints(compared, LEVEL, {})
    tried = [(at, is_true(compared, {LEVEL: at})) for at in (Fraction(step, 24) for step in range(-72, 73))]
    for (first, before), (second, after) in pairwise(tried):
        assert before is after or any(first <= point <= second for point in points)


_BENT = t.Absolute(t.Add(X, number(-HALF)))
_IS_LOW, _IS_HIGH = (t.Compare("<", X, number(at)) for at in (-HALF, Fraction(3, 2)))


@pytest.mark.parametrize(
    "left",
    [
        t.Conditional(_IS_LOW, _BENT, number(1)),
        t.Conditional(_IS_HIGH, _BENT, number(1)),
        t.Conditional(_IS_LOW, number(1), _BENT),
        t.Conditional(_IS_LOW, t.Absolute(t.Add(X, number(1))), _BENT),
        t.Conditional(t.Compare("<", _BENT, number(1)), number(1), number(0)),
        t.Extremum("min", _BENT, t.Absolute(X)),
        t.Extremum("max", _BENT, number(Fraction(3, 4))),
        t.Add(number(Fraction(-1, 4)), t.Absolute(t.Add(_BENT, number(-1)))),
    ],
)
@pytest.mark.parametrize("right", [number(Fraction(1, 5)), number(Fraction(4, 5)), X, t.Absolute(X)])
def test_no_piece_of_a_condition_is_left_out(left: t.Term, right: t.Term) -> None:
    assert_constant_between_breakpoints(t.Compare("<", left, right))
    assert_constant_between_breakpoints(t.Compare("<", right, left))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("fill_level > 0.5", {HALF}),
        ("not (0.25 <= fill_level) or dumpling_cooked", {Fraction(1, 4)}),
        ("abs(fill_level - 0.5) < 0.25", {Fraction(1, 4), HALF, Fraction(3, 4)}),
        ("abs(fill_level - 0.5) + fill_level < 0.75", {HALF, Fraction(5, 8)}),
        ("2 * abs(fill_level - 0.5) < 0.25", {Fraction(3, 8), HALF, Fraction(5, 8)}),
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
        (t.Compare("<", X, t.Multiply(X, X)), {}, "a condition multiplies `fill_level` by itself"),
        (lower(term("fill_level < joint[j1]")), {}, "`fill_level` is compared with `joint\\[j1\\]`"),
        (
            lower(term("fill_level < joint[j1]")),
            {"joint[j1]": [0] * 4097},
            "`fill_level` is compared with too many values",
        ),
        (t.Compare("<", X, _PART), {}, "a condition on `fill_level` is not linear in it"),
        (t.Compare("==", t.TRUE, _PART), {}, "a condition on `fill_level` is not a comparison with a number"),
    ],
)
def test_a_comparison_without_cells_is_named(
    condition: t.Term, others: dict[str, list[int]], message: str
) -> None:
    with pytest.raises(NoCellsError, match=f"^{message}$"):
        breakpoints(condition, LEVEL, others)


def test_as_many_values_as_are_enumerated_are_all_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    values = {"joint[j1]": [Fraction(1, 4), HALF]}
    monkeypatch.setattr(cells_module, "MAX_ENUMERATED", 2)
    assert breakpoints(lower(term("fill_level < joint[j1]")), LEVEL, values) == {Fraction(1, 4), HALF}


def test_two_quantities_are_not_compared() -> None:
    with pytest.raises(NoCellsError, match="`fill_level` is compared with `joint"):
        breakpoints(lower(term("fill_level < joint[j1]")), LEVEL, {"joint[j1]": (HALF,)}, ["joint[j1]"])
