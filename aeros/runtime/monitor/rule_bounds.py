"""The bounds that a rule puts on single quantities, as the rest of what it reads is at one moment.

Of `human_distance < 1.2 m implies link_speed <= 0.25 m/s`, `link_speed` is bounded while somebody is near,
and `human_distance` is while a link is fast.  For plots and views: what decides is the gate.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple, cast

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment, evaluate, is_true
from aeros.spec.expr.types import RealType


class Bound(NamedTuple):
    """`quantity`, a real variable or the absolute value of one, is to be at most or at least `value`, SI."""

    quantity: t.Variable | t.Absolute
    is_upper: bool
    value: Fraction

    @property
    def variable(self) -> t.Variable:
        """What is measured, or asked for."""
        of = self.quantity.operand if isinstance(self.quantity, t.Absolute) else self.quantity
        return cast("t.Variable", of)

    def margin(self, values: Environment) -> Fraction:
        """How far the quantity is on the right side of its bound; negative where it is not."""
        value = cast("Fraction", evaluate(self.quantity, values))
        return self.value - value if self.is_upper else value - self.value


def rule_bounds(term: t.Term, values: Environment, *, wanted: bool = True) -> Iterator[Bound]:
    """The bounds that keep the quantities to `term`, a term of the scalar core, being as `wanted`.

    values: exact, by scalar variable; what depends on one that is missing is passed over.
    """
    match term:
        case t.Not(operand=operand):
            yield from rule_bounds(operand, values, wanted=not wanted)
        case t.And(operands=operands) | t.Or(operands=operands):
            if isinstance(term, t.And) is wanted:
                for operand in operands:
                    yield from rule_bounds(operand, values, wanted=wanted)
            else:
                yield from _sole_remaining_operand(operands, values, wanted=wanted)
        case t.Compare(op="<" | "<=", left=left, right=right):
            low, high = (left, right) if wanted else (right, left)
            yield from _bound(low, high, values, is_upper=True)
            yield from _bound(high, low, values, is_upper=False)


def _sole_remaining_operand(
    operands: tuple[t.Term, ...], values: Environment, *, wanted: bool
) -> Iterator[Bound]:
    """Where any one operand being as wanted is enough, it alone is bound whose fellows all are not."""
    for place, operand in enumerate(operands):
        others = operands[:place] + operands[place + 1 :]
        if all(_known(one, values) and is_true(one, values) is not wanted for one in others):
            yield from rule_bounds(operand, values, wanted=wanted)


def _bound(quantity: t.Term, limit: t.Term, values: Environment, *, is_upper: bool) -> Iterator[Bound]:
    if not _known(limit, values) or not _known(quantity, values):
        return
    match quantity:
        case t.Variable(type=RealType()) | t.Absolute(operand=t.Variable()):
            if t.variables_of(quantity).keys().isdisjoint(t.variables_of(limit)):
                yield Bound(quantity, is_upper, cast("Fraction", evaluate(limit, values)))


def _known(term: t.Term, values: Environment) -> bool:
    return t.variables_of(term).keys() <= values.keys()
