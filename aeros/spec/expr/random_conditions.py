"""Test cases for the expression language: random well-typed conditions, each with ranges and values.

They contain every kind of node, every type, ranges from subnormal to near overflow, and values where deciding
is hard: ends of ranges, constants of the term and the doubles next to them, -0.0, subnormals, and comparisons
whose sides are equal or differ by less than a rounding error.

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
from aeros.spec.expr.semantics import Environment, Value, evaluate
from aeros.spec.expr.types import (
    BOOL,
    BoolType,
    EnumType,
    FamilyType,
    IntegerType,
    RealType,
    Type,
    VectorType,
)
from aeros.spec.expr.units import LENGTH, NUMBER, Dimension

Raw = float | bool | str | tuple[float, ...] | tuple[bool, ...]
"""A measured value: floats, not fractions; a tuple for a vector, or for a family in index order."""

Ranges = Mapping[str, tuple[Fraction, Fraction]]

JOINT = EnumType("Joint", ("j1", "j2", "j3"))
MODE = EnumType("Mode", ("idle", "move", "stop"))
_AREA = LENGTH * LENGTH
_TYPES: Mapping[str, Type] = {
    "a": BOOL,
    "b": BOOL,
    "mode": MODE,
    "arm": JOINT,
    "n": RealType(NUMBER),
    "laps": IntegerType(),
    "x": RealType(LENGTH),
    "y": RealType(LENGTH),
    "p": VectorType(LENGTH),
    "q": VectorType(LENGTH),
    "joint": FamilyType(JOINT, RealType(LENGTH)),
    "ready": FamilyType(JOINT, BOOL),
}
VARIABLES: Mapping[str, t.Variable] = {
    name: t.Variable(name, type_, t.VariableRole.STATE) for name, type_ in _TYPES.items()
}
_TABLE = t.ConstantTable(
    "limit", FamilyType(JOINT, RealType(LENGTH)), (Fraction(1, 10), Fraction(1, 3), Fraction(-2))
)
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
_CONSTANTS = tuple(
    Fraction(text)
    for text in (*["0", "1", "-1", "2", "1/10", "1/3", "-7/1000"] * 2, "1e16", "1e-320", "1e200", "-1e400")
)


@dataclass(frozen=True)
class ConditionCase:
    """Well-typed condition, ranges of its real scalars, and a value for each variable."""

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
    builder = _TermGenerator(draw)
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
    return _TermGenerator(draw).boolean(draw(st.integers(1, 4)))


@st.composite
def reals(draw: st.DrawFn) -> t.Term:
    """Generate well-typed real terms over `VARIABLES`, in metres.

    Args:
        draw: provided by hypothesis.

    Returns:
        A strategy for real terms.
    """
    return _TermGenerator(draw).real(draw(st.integers(1, 4)), LENGTH)


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


class _TermGenerator:
    """Generator of well-typed terms. `depth` is the number of levels that may still be nested."""

    def __init__(self, draw: st.DrawFn) -> None:
        self._draw = draw
        self._bound: list[t.BoundVariable] = []

    def _pick(self, *choices: Callable[[], t.Term]) -> t.Term:
        return self._draw(st.sampled_from(choices))()

    def _random_conditions(self, depth: int) -> tuple[t.Term, ...]:
        return tuple(self.boolean(depth) for _ in range(self._draw(st.integers(0, 3))))

    def boolean(self, depth: int) -> t.Term:
        """Draw a condition."""
        if depth <= 0:
            return self._pick(
                lambda: VARIABLES["a"],
                lambda: VARIABLES["b"],
                lambda: self._draw(st.sampled_from((t.TRUE, t.FALSE))),
                lambda: t.Select(VARIABLES["ready"], self.enum(0, JOINT)),
            )
        below = depth - 1
        return self._pick(
            lambda: self.comparison(below),
            lambda: self.comparison(below),
            lambda: t.Compare("==", self.vector(below), self.vector(below)),
            lambda: t.Compare("==", self.boolean(below), self.boolean(below)),
            lambda: t.Compare("==", self.enum(below, MODE), self.enum(below, MODE)),
            lambda: t.Compare("==", self.enum(below, JOINT), self.enum(below, JOINT)),
            lambda: t.Not(self.boolean(below)),
            lambda: t.And(self._random_conditions(below)),
            lambda: t.Or(self._random_conditions(below)),
            lambda: t.Implies(self.boolean(below), self.boolean(below)),
            lambda: t.Conditional(self.boolean(below), self.boolean(below), self.boolean(below)),
            lambda: t.Select(VARIABLES["ready"], self.enum(below, JOINT)),
            lambda: self._quantified("all", below),
            lambda: self._quantified("any", below),
        )

    def _quantified(self, kind: Any, depth: int) -> t.Term:
        index = t.BoundVariable(f"i{len(self._bound)}", self._draw(st.sampled_from((JOINT, JOINT, MODE))))
        self._bound.append(index)
        body = self.boolean(depth)
        self._bound.pop()
        return t.Quantified(kind, index, body)

    def _aggregate(self, depth: int, dimension: Dimension) -> t.Term:
        index = t.BoundVariable(f"i{len(self._bound)}", JOINT)
        self._bound.append(index)
        if dimension == NUMBER and self._draw(st.booleans()):
            body = t.Aggregate("count", index, self.boolean(depth))
        else:
            body = t.Aggregate("sum", index, self.real(depth, dimension))
        self._bound.pop()
        return body

    def comparison(self, depth: int) -> t.Term:
        """Draw a comparison of two reals."""
        dimension = self._draw(st.sampled_from((NUMBER, LENGTH, _AREA)))
        return t.Compare(self._op(), self.real(depth, dimension), self.real(depth, dimension))

    def _op(self) -> Any:
        return self._draw(st.sampled_from(("<", "<=", "==")))

    def near_tie(self, env: Environment) -> t.Term:
        """Draw a comparison whose sides are equal under `env`, or differ by less than rounding errors."""
        one, two, three = (self.real(self._draw(st.sampled_from((0, 0, 1))), LENGTH) for _ in range(3))
        factor = self.real(self._draw(st.sampled_from((0, 1))), NUMBER)
        sums = (t.Add(t.Add(one, two), three), t.Add(one, t.Add(two, three)))
        products = (
            t.Multiply(factor, t.Add(one, two)),
            t.Add(t.Multiply(factor, one), t.Multiply(factor, two)),
        )
        pairs: list[tuple[t.Term, t.Term]] = [sums, products, (one, one)]
        left, right = self._draw(st.sampled_from(pairs))
        if self._draw(st.integers(0, 3)) == 0:
            right = t.Literal(self._adjacent_value(cast("Fraction", evaluate(left, env))), RealType(LENGTH))
        elif self._draw(st.booleans()):
            tiny = self._draw(
                st.sampled_from((Fraction(1, 2**70), Fraction(-1, 2**54), Fraction(1, 2**1080)))
            )
            right = t.Add(right, t.Literal(tiny, RealType(LENGTH)))
        if self._draw(st.booleans()):
            left, right = right, left
        return t.Compare(self._op(), left, right)

    def _adjacent_value(self, value: Fraction) -> Fraction:
        """Draw `value`, or a number so near that rounding can hide the difference."""
        relative = self._draw(st.sampled_from((Fraction(0), Fraction(1, 2**53), Fraction(-1, 2**60))))
        return value + value * relative

    def real(self, depth: int, dimension: Dimension) -> t.Term:
        """Draw a real term of `dimension`: a number, a length or an area."""
        if depth <= 0:
            return self._pick(
                lambda: t.Literal(self._draw(st.sampled_from(_CONSTANTS)), RealType(dimension)),
                *self._leaves(dimension),
            )
        below = depth - 1
        return self._pick(
            lambda: self.real(0, dimension),
            lambda: t.Add(self.real(below, dimension), self.real(below, dimension)),
            lambda: self._product(below, dimension),
            lambda: self._product(below, dimension),
            lambda: self._aggregate(below, dimension),
            lambda: t.Extremum(
                self._draw(st.sampled_from(("min", "max"))),
                self.real(below, dimension),
                self.real(below, dimension),
            ),
            lambda: t.Absolute(self.real(below, dimension)),
            lambda: t.Conditional(
                self.boolean(below), self.real(below, dimension), self.real(below, dimension)
            ),
            *(
                (
                    lambda: t.Component(self.vector(below), self._draw(st.integers(0, 2))),
                    lambda: t.Select(VARIABLES["joint"], self.enum(below, JOINT)),
                    lambda: t.Select(_TABLE, self.enum(below, JOINT)),
                )
                if dimension == LENGTH
                else ()
            ),
        )

    def _leaves(self, dimension: Dimension) -> list[Callable[[], t.Term]]:
        names = {NUMBER: ("n", "laps"), LENGTH: ("x", "y")}.get(dimension, ())
        return [lambda name=name: VARIABLES[name] for name in names]  # type: ignore[misc]

    def _product(self, depth: int, dimension: Dimension) -> t.Term:
        if dimension == _AREA:
            return t.Multiply(self.real(depth, LENGTH), self.real(depth, LENGTH))
        return t.Multiply(self.real(depth, NUMBER), self.real(depth, dimension))

    def vector(self, depth: int) -> t.Term:
        """Draw a vector term in metres."""
        if depth <= 0:
            return self._draw(st.sampled_from((VARIABLES["p"], VARIABLES["q"])))
        below = depth - 1
        return self._pick(
            lambda: self.vector(0),
            lambda: t.Vector(*(self.real(below, LENGTH) for _ in range(3))),
            lambda: t.Add(self.vector(below), self.vector(below)),
            lambda: t.Multiply(self.real(below, NUMBER), self.vector(below)),
            lambda: t.Conditional(self.boolean(below), self.vector(below), self.vector(below)),
        )

    def enum(self, depth: int, enum: EnumType) -> t.Term:
        """Draw a member: a constant, a variable, an enclosing quantifier's index, or a choice of two."""
        leaves: list[t.Term] = [t.Literal(member, enum) for member in enum.members]
        leaves += [variable for variable in VARIABLES.values() if variable.type == enum] * 2
        leaves += [index for index in self._bound if index.type == enum] * 3
        if depth <= 0 or self._draw(st.booleans()):
            return self._draw(st.sampled_from(leaves))
        return t.Conditional(self.boolean(depth - 1), self.enum(depth - 1, enum), self.enum(depth - 1, enum))
