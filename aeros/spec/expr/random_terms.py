"""Generator of random well-typed terms over a small vocabulary, for tests of the expression language.

They contain every kind of node, every type, and comparisons whose sides are equal or differ by less than a
rounding error.

Needs hypothesis, a test extra: in `aeros`, only `random_conditions.py` and the conformance suite import this.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any, cast

from hypothesis import strategies as st

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, evaluate
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, IntegerType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER, Dimension

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
    # of a module
    "kettle.hot": BOOL,
    "kettle.level": RealType(LENGTH),
    "kettle.spout": VectorType(LENGTH),
}
VARIABLES: Mapping[str, t.Variable] = {
    name: t.Variable(name, type_, t.VariableRole.STATE) for name, type_ in _TYPES.items()
}
_TABLE = t.ConstantTable(
    "limit", FamilyType(JOINT, RealType(LENGTH)), (Fraction(1, 10), Fraction(1, 3), Fraction(-2))
)
_CONSTANTS = tuple(
    Fraction(text)
    for text in (*["0", "1", "-1", "2", "1/10", "1/3", "-7/1000"] * 2, "1e16", "1e-320", "1e200", "-1e400")
)


class TermGenerator:
    """Generator of well-typed terms."""

    def __init__(self, draw: st.DrawFn) -> None:
        self._draw = draw
        self._bound: list[t.BoundVariable] = []

    def _pick(self, *choices: Callable[[], t.Term]) -> t.Term:
        return self._draw(st.sampled_from(choices))()

    def _operands(self, depth: int) -> tuple[t.Term, ...]:
        return tuple(self.boolean(depth) for _ in range(self._draw(st.integers(0, 3))))

    def boolean(self, depth: int) -> t.Term:
        """Draw a condition.

        Args:
            depth: number of levels that may be nested.

        Returns:
            Boolean term.
        """
        if depth <= 0:
            return self._pick(
                lambda: VARIABLES["a"],
                lambda: VARIABLES["b"],
                lambda: VARIABLES["kettle.hot"],
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
            lambda: t.And(self._operands(below)),
            lambda: t.Or(self._operands(below)),
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
        """Draw a comparison of two reals.

        Args:
            depth: number of levels that may be nested.

        Returns:
            Boolean term.
        """
        dimension = self._draw(st.sampled_from((NUMBER, LENGTH, _AREA)))
        return t.Compare(self._op(), self.real(depth, dimension), self.real(depth, dimension))

    def _op(self) -> Any:
        return self._draw(st.sampled_from(("<", "<=", "==")))

    def near_tie(self, env: Environment) -> t.Term:
        """Draw a comparison whose sides are equal, or differ by less than rounding errors.

        Args:
            env: exact value of each variable.

        Returns:
            Boolean term, over lengths.
        """
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
        """Draw a real term.

        Args:
            depth: number of levels that may be nested.
            dimension: a number, a length or an area.

        Returns:
            Real term of that dimension.
        """
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
        names = {NUMBER: ("n", "laps"), LENGTH: ("x", "y", "kettle.level")}.get(dimension, ())
        return [lambda name=name: VARIABLES[name] for name in names]  # type: ignore[misc]

    def _product(self, depth: int, dimension: Dimension) -> t.Term:
        if dimension == _AREA:
            return t.Multiply(self.real(depth, LENGTH), self.real(depth, LENGTH))
        return t.Multiply(self.real(depth, NUMBER), self.real(depth, dimension))

    def vector(self, depth: int) -> t.Term:
        """Draw a vector term.

        Args:
            depth: number of levels that may be nested.

        Returns:
            Vector term in metres.
        """
        if depth <= 0:
            return self._draw(st.sampled_from((VARIABLES["p"], VARIABLES["q"], VARIABLES["kettle.spout"])))
        below = depth - 1
        return self._pick(
            lambda: self.vector(0),
            lambda: t.Vector(*(self.real(below, LENGTH) for _ in range(3))),
            lambda: t.Add(self.vector(below), self.vector(below)),
            lambda: t.Multiply(self.real(below, NUMBER), self.vector(below)),
            lambda: t.Conditional(self.boolean(below), self.vector(below), self.vector(below)),
        )

    def enum(self, depth: int, enum: EnumType) -> t.Term:
        """Draw a member: a constant, a variable, an enclosing quantifier's index, or a choice of two.

        Args:
            depth: number of levels that may be nested.
            enum: enum of the member.

        Returns:
            Term of that enum.
        """
        leaves: list[t.Term] = [t.Literal(member, enum) for member in enum.members]
        leaves += [variable for variable in VARIABLES.values() if variable.type == enum] * 2
        leaves += [index for index in self._bound if index.type == enum] * 3
        if depth <= 0 or self._draw(st.booleans()):
            return self._draw(st.sampled_from(leaves))
        return t.Conditional(self.boolean(depth - 1), self.enum(depth - 1, enum), self.enum(depth - 1, enum))
