"""Random questions of the kind that bounds decide: few variables, few constants, sides that often tie.

A condition and its opposite often meet in one question, as they do in "may ask for, and not allowed".
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal, TypeVar, cast

from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import scalar_variables
from aeros.spec.expr.semantics import Value, evaluate
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
from aeros.spec.expr.units import NUMBER

_T = TypeVar("_T")

Ranges = Mapping[str, tuple[Fraction, Fraction]]

_REAL = RealType(NUMBER)
_TOOL = EnumType("Tool", ("hand", "knife", "pan"))
_LONE = EnumType("Lone", ("only",))
_PAIR = EnumType("Pair", ("left", "right"))
_TYPES: Mapping[str, Type] = {
    "a": BOOL,
    "b": BOOL,
    "tool": _TOOL,
    "other": _TOOL,
    "lone": _LONE,
    "x": _REAL,
    "y": _REAL,
    "n": IntegerType(),
    "p": VectorType(NUMBER),
    "side": _PAIR,
    "f": FamilyType(_PAIR, _REAL),
}
VARIABLES = {name: t.Variable(name, type_, t.VariableRole.STATE) for name, type_ in _TYPES.items()}
_FAMILY = VARIABLES["f"]
_EACH = t.BoundVariable("each", _PAIR)
_REALS = ("x", "x", "y", "y", "n")
_CONSTANTS = [Fraction(k, 2) for k in (-4, -2, -1, 0, 0, 1, 2, 2, 3, 4)] + [Fraction(1, 3)]
_HUGE = (-(10**400), 10**400)
_RANGES = [(-1, 1), (0, 2), (1, 1), (-2, 0), (-2, 2), (0, 1), _HUGE, None]
_WHOLE = [(0, 1), (-2, 2), (1, 1), (0, 2**62), None]
_GRID = [Fraction(k, 2) for k in range(-4, 5)] + [Fraction(1, 3)]


@dataclass(frozen=True)
class Asked:
    """Conditions that are to hold together, and the ranges of their variables; one without has no ends."""

    ranges: Ranges
    terms: tuple[t.Term, ...]

    @property
    def variables(self) -> list[t.Variable]:
        """Those that the conditions speak of, and one that they may not."""
        spoken = {name for term in self.terms for name in t.variables_of(term)} | {"n"}
        return [one for name, one in VARIABLES.items() if name in spoken]

    def points(self, most: int) -> Iterator[dict[str, Any]]:
        """Values of all scalar variables in their ranges, on a grid through all constants, thinned."""
        scalars = [scalar for one in self.variables for scalar in scalar_variables(one)]
        axes = [self._values(scalar) for scalar in scalars]
        size = 1
        for axis in axes:
            size *= len(axis)
        step = max(1, size // most) | 1
        for number in range(0, size, step):
            point, rest = {}, number
            for scalar, axis in zip(scalars, axes, strict=True):
                rest, at = divmod(rest, len(axis))
                point[scalar.name] = axis[at]
            yield point

    def _values(self, scalar: t.Variable) -> list[Any]:
        if scalar.type == BOOL:
            return [False, True]
        if isinstance(scalar.type, EnumType):
            return [*scalar.type.members]
        low, high = self.ranges.get(scalar.name, (min(_GRID), max(_GRID)))
        return [
            value
            for value in sorted({low, high, *_GRID})
            if low <= value <= high and (value.denominator == 1 or not isinstance(scalar.type, IntegerType))
        ]


class _Conditions:
    def __init__(self, draw: st.DrawFn, ranges: Ranges) -> None:
        self._draw = draw
        self._ranges = ranges

    def pick(self, choices: Sequence[_T]) -> _T:
        return self._draw(st.sampled_from(choices))

    def made(self, *makers: Callable[[], t.Term]) -> t.Term:
        return self.pick(makers)()

    def condition(self, depth: int) -> t.Term:
        leaves = [self.compared] * 4 + [self.named, self.at_a_corner, self.branching]
        if depth <= 0:
            return self.made(*leaves)
        below = depth - 1
        return self.made(
            *leaves,
            lambda: t.And(self.some(below)),
            lambda: t.Or(self.some(below)),
            lambda: t.Or(self.some(below)),
            lambda: t.Not(self.condition(below)),
            lambda: t.Implies(self.condition(below), self.condition(below)),
            lambda: t.Conditional(*(self.condition(below) for _ in range(3))),
            lambda: t.Compare("==", self.condition(below), self.condition(below)),
            lambda: t.Quantified("all", _EACH, self.of_each(below)),
            lambda: t.Quantified("any", _EACH, self.of_each(below)),
            lambda: t.And(tuple(self.chosen() for _ in range(5))),
            lambda: t.And(tuple(self.summed() for _ in range(3))),
            self.between,
        )

    def some(self, depth: int) -> tuple[t.Term, ...]:
        return tuple(self.condition(depth) for _ in range(self.pick((0, 1, 2, 2, 3))))

    def of_each(self, depth: int) -> t.Term:
        """A condition on one member of the family, as a quantifier has it."""
        term = t.Compare(self.op(), t.Select(_FAMILY, _EACH), self.literal())
        joined = (term, self.condition(depth))
        return self.made(lambda: term, lambda: t.Not(term), lambda: t.And(joined), lambda: t.Or(joined))

    def chosen(self) -> t.Term:
        """Alternatives that bounds do not settle; a few of these are more than are tried."""
        sides = (self.real(0), self.real(0), self.literal())
        apart = t.Compare("==", t.Multiply(sides[0], sides[1]), sides[2])
        return t.Or((apart, t.Compare("<", sides[0], sides[2]), t.Compare("<", sides[2], sides[1])))

    def summed(self) -> t.Term:
        """A bound of one of several sums of the same variables."""
        factors = [t.Literal(Fraction(self.pick((-2, -1, 1, 3))), _REAL) for _ in range(2)]
        sides = [t.Multiply(factor, VARIABLES[name]) for factor, name in zip(factors, "xy", strict=True)]
        return t.Compare(self.op(), t.Add(*sides), self.real(0))

    def branching(self) -> t.Term:
        """Alternatives of which each is possible by itself, but for a condition on two of its variables."""
        names = [self.pick(_REALS) for _ in range(2)]
        sides = [VARIABLES[name] for name in names]
        corners = []
        for _ in range(self.pick((2, 2, 3))):
            both = tuple(t.Compare("<=", *self.turned(side, self.literal())) for side in sides)
            corners.append(t.And((*both, *self.pick([(), (), (self.condition(1),)]))))
        join = self.made(lambda: t.Add(sides[0], sides[1]), lambda: t.Multiply(sides[0], sides[1]))
        bound = t.Compare(self.op(), *self.turned(join, self.literal()))
        return t.And((t.Or(tuple(corners)), bound))

    def turned(self, left: t.Term, right: t.Term) -> tuple[t.Term, t.Term]:
        return (left, right) if self.pick("ny") == "y" else (right, left)

    def between(self) -> t.Term:
        """That a whole number lies between two constants, of which there may be none."""
        ends = sorted((self.pick(_CONSTANTS), self.pick(_CONSTANTS)))
        op, whole = self.op(), VARIABLES["n"]
        low, high = (t.Literal(end, _REAL) for end in ends)
        return t.And((t.Compare(op, low, whole), t.Compare(op, whole, high)))

    def named(self) -> t.Term:
        members = [t.Literal(member, _TOOL) for member in _TOOL.members]
        tools: list[t.Term] = [VARIABLES["tool"], VARIABLES["other"], *members]
        return self.made(
            lambda: VARIABLES[self.pick("ab")],
            lambda: t.Compare("==", self.pick(tools), self.pick(tools)),
            lambda: t.Compare("==", VARIABLES["lone"], t.Literal("only", _LONE)),
            lambda: t.TRUE,
            lambda: t.FALSE,
        )

    def compared(self) -> t.Term:
        left, right = self.real(self.pick((0, 0, 1, 1, 2))), self.real(self.pick((0, 0, 0, 1)))
        return t.Compare(self.op(), *self.turned(left, right))

    def at_a_corner(self) -> t.Term:
        """A term compared with its value where variables are at ends of their ranges: often its extreme."""
        term = self.real(self.pick((1, 1, 2)))
        corner = {one.name: self.end_of(one) for one in t.variables_of(term).values()}
        there = t.Literal(cast("Fraction", evaluate(term, corner)), _REAL)
        compared = t.Compare(self.op(), *self.turned(term, there))
        return compared if self.pick("ny") == "y" else t.Not(compared)

    def end_of(self, variable: t.Variable) -> Value:
        match variable.type:
            case BoolType():
                return self.pick((False, True))
            case EnumType(members=members):
                return self.pick(members)
            case VectorType() | FamilyType():
                return tuple(cast("Fraction", self.end_of(one)) for one in scalar_variables(variable))
            case _:
                return self.pick(self._ranges.get(variable.name, (Fraction(0), Fraction(1))))

    def op(self) -> Literal["<", "<=", "=="]:
        return self._draw(st.sampled_from(("<", "<=", "<=", "==")))

    def literal(self) -> t.Term:
        return t.Literal(self.pick(_CONSTANTS), _REAL)

    def real(self, depth: int) -> t.Term:
        if depth <= 0:
            return self.made(
                self.literal,
                lambda: VARIABLES[self.pick(_REALS)],
                lambda: VARIABLES[self.pick(_REALS)],
                lambda: t.Component(VARIABLES["p"], self.pick((0, 1))),
                lambda: t.Select(_FAMILY, VARIABLES["side"]),
                lambda: t.Select(_FAMILY, t.Literal("left", _PAIR)),
            )
        below = depth - 1
        return self.made(
            lambda: t.Add(self.real(below), self.real(below)),
            lambda: t.Add(self.real(below), t.Multiply(self.literal(), self.real(below))),
            lambda: t.Multiply(self.literal(), self.real(below)),
            lambda: t.Multiply(self.real(below), self.real(below)),
            lambda: self.square(below),
            lambda: t.Absolute(self.real(below)),
            lambda: t.Extremum("min", self.real(below), self.real(below)),
            lambda: t.Extremum("max", self.real(below), self.real(below)),
            lambda: t.Conditional(self.condition(0), self.real(below), self.real(below)),
        )

    def square(self, depth: int) -> t.Term:
        root = self.real(depth)
        return t.Multiply(root, root)


@st.composite
def questions(draw: st.DrawFn) -> Asked:
    """One to five conditions, some of them the opposite of others."""
    ranges = {}
    for one in itertools.chain.from_iterable(map(scalar_variables, VARIABLES.values())):
        if isinstance(one.type, RealType):
            bounds = draw(st.sampled_from(_WHOLE if isinstance(one.type, IntegerType) else _RANGES))
            if bounds is not None:
                ranges[one.name] = (Fraction(bounds[0]), Fraction(bounds[1]))
    make = _Conditions(draw, ranges)
    terms: list[t.Term] = []
    for _ in range(make.pick((1, 1, 2, 3, 4, 5))):
        if terms and make.pick("nyn") == "y":
            terms.append(t.Not(make.pick(terms)))
        else:
            terms.append(make.condition(make.pick((0, 0, 1, 2))))
    return Asked(ranges, tuple(terms))
