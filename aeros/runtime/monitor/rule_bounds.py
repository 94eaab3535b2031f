"""Bounds that a rule puts on single quantities, given the current values of the other variables it reads.

For `human_distance < 1.2 m implies link_speed <= 0.25 m/s`, `link_speed` is bounded while a person is near,
and `human_distance` is bounded while a link is fast. For plots and views only; the gate decides.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple, cast

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, evaluate, is_true
from aeros.spec.expr.types import RealType


class Bound(NamedTuple):
    """An upper or lower bound on a quantity.

    Attributes:
        quantity: a real variable, or its absolute value.
        is_upper: True if the quantity must be at most `value`, False if at least.
        value: the bound, SI.
    """

    quantity: t.Variable | t.Absolute
    is_upper: bool
    value: Fraction

    @property
    def variable(self) -> t.Variable:
        """The state variable or parameter that the bound is on."""
        of = self.quantity.operand if isinstance(self.quantity, t.Absolute) else self.quantity
        return cast("t.Variable", of)

    def margin(self, values: Environment) -> Fraction:
        """Compute the distance of the quantity from its bound, positive on the allowed side.

        Args:
            values: exact values by scalar variable.

        Returns:
            The distance, SI; negative if the bound is broken.
        """
        value = cast("Fraction", evaluate(self.quantity, values))
        return self.value - value if self.is_upper else value - self.value


def rule_bounds(term: t.Term, values: Environment, *, truth_value: bool = True) -> Iterator[Bound]:
    """Find the bounds on single quantities that keep a condition true (or false).

    Args:
        term: a condition of the scalar core.
        values: exact values by scalar variable; parts that read a missing variable are skipped.
        truth_value: the truth value that the bounds keep.

    Yields:
        Each bound.
    """
    match term:
        case t.Not(operand=operand):
            yield from rule_bounds(operand, values, truth_value=not truth_value)
        case t.And(operands=operands) | t.Or(operands=operands):
            if isinstance(term, t.And) is truth_value:
                for operand in operands:
                    yield from rule_bounds(operand, values, truth_value=truth_value)
            else:
                yield from _sole_remaining_operand(operands, values, truth_value=truth_value)
        case t.Compare(op="<" | "<=", left=left, right=right):
            low, high = (left, right) if truth_value else (right, left)
            yield from _bound(low, high, values, is_upper=True)
            yield from _bound(high, low, values, is_upper=False)


def _sole_remaining_operand(
    operands: tuple[t.Term, ...], values: Environment, *, truth_value: bool
) -> Iterator[Bound]:
    """Yield the bounds of an operand on which the condition depends, because all other operands fail."""
    for place, operand in enumerate(operands):
        others = operands[:place] + operands[place + 1 :]
        if all(_known(other, values) and is_true(other, values) is not truth_value for other in others):
            yield from rule_bounds(operand, values, truth_value=truth_value)


def _bound(quantity: t.Term, limit: t.Term, values: Environment, *, is_upper: bool) -> Iterator[Bound]:
    if not _known(limit, values) or not _known(quantity, values):
        return
    match quantity:
        case t.Variable(type=RealType()) | t.Absolute(operand=t.Variable()):
            if t.variables_of(quantity).keys().isdisjoint(t.variables_of(limit)):
                yield Bound(quantity, is_upper, cast("Fraction", evaluate(limit, values)))


def _known(term: t.Term, values: Environment) -> bool:
    return t.variables_of(term).keys() <= values.keys()
