"""Test cases for the expression language: random well-typed conditions, each with ranges and values.

`random_terms.py` generates the terms. The ranges go from subnormal to near overflow, and the values are those
where deciding is hard: ends of ranges, constants of the term and the doubles next to them, -0.0, subnormals.

Needs hypothesis, a test extra: in `aeros`, only the conformance suite imports this module.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any, cast

from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables, values_by_scalar
from aeros.spec.expr.random_terms import VARIABLES, TermGenerator
from aeros.spec.expr.semantics import Environment, Value
from aeros.spec.expr.types import BoolType, EnumType, IntegerType, RealType
from aeros.spec.expr.units import LENGTH

Raw = float | bool | str | tuple[float, ...] | tuple[bool, ...]
"""A measured value: floats, not fractions; a tuple for a vector, or for a family in index order."""

Ranges = Mapping[str, tuple[Fraction, Fraction]]

_RANGES = tuple(
    (Fraction(low), Fraction(high))
    for low, high in (
        ("-1", "1"),
        *[("9/10", "1"), ("-2/3", "2"), ("-1", "1")] * 3,
        ("0", "1/10"),
        ("1/3", "1e6"),
        ("-1e-310", "1e-310"),
        ("-1e200", "1e200"),
        ("-1e308", "1e308"),
    )
)
_WHOLE_RANGES = tuple((Fraction(low), Fraction(high)) for low, high in ((0, 1), (-3, 3), (0, 2**60)))


@dataclass(frozen=True)
class ConditionCase:
    """Well-typed condition with values at which it is evaluated.

    Attributes:
        term: the condition.
        ranges: range of each real scalar variable, SI.
        values: value of each variable, SI.
    """

    term: t.Term
    ranges: Ranges
    values: Mapping[str, Raw]


def exact_environment(values: Mapping[str, Raw]) -> Environment:
    """Convert measured values to the rationals that the doubles denote.

    Args:
        values: measured values by variable.

    Returns:
        Exact values by variable.
    """
    return {name: _exact(value) for name, value in values.items()}


def to_scalars(values: Mapping[str, Raw]) -> dict[str, float | bool | str]:
    """Split measured values into values of scalar variables.

    Args:
        values: measured value of each of `VARIABLES`.

    Returns:
        Value of each scalar variable by its name.
    """
    scalars = values_by_scalar(VARIABLES, cast("Environment", values))
    return cast("dict[str, float | bool | str]", scalars)


def _exact(value: Raw) -> Value:
    if isinstance(value, tuple):
        return cast("Value", tuple(_exact(part) for part in value))
    return Fraction(value) if isinstance(value, float) else value


@st.composite
def cases(draw: st.DrawFn) -> ConditionCase:
    """Generate conditions with values; half of them have a comparison made hard for these values.

    Args:
        draw: provided by hypothesis.

    Returns:
        A strategy for cases.
    """
    ranges = draw(vocabulary_ranges())
    builder = TermGenerator(draw)
    easy = builder.boolean(draw(st.integers(1, 4)))
    values = draw(environments(easy, ranges))
    if draw(st.booleans()):
        return ConditionCase(easy, ranges, values)
    hard = builder.near_tie(exact_environment(values))
    joins: list[Callable[[t.Term, t.Term], t.Term]] = [
        lambda hard, _: hard,
        lambda hard, easy: t.And((hard, easy)),
        lambda hard, easy: t.Or((easy, hard)),
        lambda hard, easy: t.Implies(hard, easy),
        lambda hard, easy: t.Conditional(hard, easy, t.Not(easy)),
    ]
    return ConditionCase(draw(st.sampled_from(joins))(hard, easy), ranges, values)


@st.composite
def conditions(draw: st.DrawFn) -> t.Term:
    """Generate well-typed boolean terms over `VARIABLES`.

    Args:
        draw: provided by hypothesis.

    Returns:
        A strategy for boolean terms.
    """
    return TermGenerator(draw).boolean(draw(st.integers(1, 4)))


@st.composite
def reals(draw: st.DrawFn) -> t.Term:
    """Generate well-typed real terms over `VARIABLES`, in metres.

    Args:
        draw: provided by hypothesis.

    Returns:
        A strategy for real terms.
    """
    return TermGenerator(draw).real(draw(st.integers(1, 4)), LENGTH)


@st.composite
def vocabulary_ranges(draw: st.DrawFn) -> Ranges:
    """Generate one range for each declared variable; its scalars share it, as in a vocabulary.

    Args:
        draw: provided by hypothesis.

    Returns:
        A strategy for closed ranges (SI) by name of the real scalar variable.
    """
    return {
        scalar.name: bounds
        for variable in VARIABLES.values()
        for whole in [isinstance(variable.type, IntegerType)]
        for bounds in [draw(st.sampled_from(_WHOLE_RANGES if whole else _RANGES))]
        for scalar in scalar_variables(variable)
        if isinstance(scalar.type, RealType)
    }


@st.composite
def environments(draw: st.DrawFn, term: t.Term, ranges: Ranges) -> Mapping[str, Raw]:
    """Generate values inside ranges, often at a boundary of a term or of double arithmetic.

    Args:
        draw: provided by hypothesis.
        term: its constants are drawn often, and the doubles next to them.
        ranges: closed range of each real scalar variable.

    Returns:
        A strategy for one measured value per variable.
    """
    special = _constants_of(term) | {Fraction(0), Fraction(1, 2**1074), Fraction(-1, 2**1022)}
    return {name: draw(_value(variable, ranges, special)) for name, variable in VARIABLES.items()}


def _value(variable: t.Variable, ranges: Ranges, special: set[Fraction]) -> st.SearchStrategy[Any]:
    parts = scalar_variables(variable)
    if len(parts) > 1:
        return st.tuples(*(_value(part, ranges, special) for part in parts))
    match variable.type:
        case BoolType():
            return st.booleans()
        case EnumType(members=members):
            return st.sampled_from(members)
        case IntegerType():
            return st.integers(*map(int, ranges[variable.name])).map(float)
        case _:
            return _double(*ranges[variable.name], special)


def _double(low: Fraction, high: Fraction, special: set[Fraction]) -> st.SearchStrategy[float]:
    """Generate doubles in the closed range: any, its ends, and those nearest to the special values."""
    least, greatest = _double_inside(low, math.inf), _double_inside(high, -math.inf)
    near = {double for value in (low, high, *special) for double in _neighbouring_doubles(value)}
    near = {double for double in near if least <= double <= greatest}
    zeros = [0.0, -0.0] if low <= 0 <= high else []
    spread = st.integers(0, 2**53).map(
        lambda k: min(greatest, max(least, float(low + (high - low) * k / 2**53)))
    )
    ends = [*sorted(near - {0.0}), *zeros, least, greatest]
    return st.one_of(spread, spread, st.floats(least, greatest), st.sampled_from(ends))


@cache
def _neighbouring_doubles(value: Fraction) -> tuple[float, ...]:
    """Return the double nearest to `value` and its two neighbours."""
    if abs(value) > Fraction(10) ** 308:
        return ()
    double = float(value)
    return double, math.nextafter(double, math.inf), math.nextafter(double, -math.inf)


@cache
def _double_inside(end: Fraction, inwards: float) -> float:
    """Return the double nearest to `end` that is not outside it."""
    nearest = float(end)
    outside = Fraction(nearest) < end if inwards > 0 else Fraction(nearest) > end
    return math.nextafter(nearest, inwards) if outside else nearest


def _constants_of(term: t.Term) -> set[Fraction]:
    constants: set[Fraction] = set()
    pending = [term]
    while pending:
        current = pending.pop()
        pending.extend(t.children(current))
        if isinstance(current, t.Literal) and isinstance(current.value, Fraction):
            constants.add(current.value)
        elif isinstance(current, t.ConstantTable):
            constants.update(current.values)
    return constants
