"""Cells of a quantity: ranges of a real number in which no condition of a loop changes, each as one value.

The conditions of a task compare a quantity with numbers.  These numbers, its breakpoints, cut the quantity's
range into cells: each breakpoint is one, and so is each open interval between two of them.  In a cell, no
condition changes.  So a loop over the cells does what the loop over the quantity does, and one value of each
cell stands for all of them.

Breakpoints are exact.  A comparison of terms that are piecewise linear in the quantity changes where one of
its pieces ends or where its two sides are equal.  A condition of any other form has no cells here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import pairwise, product
from math import prod
from typing import Any, Final, cast

from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import evaluate
from aeros.spec.expr.types import RealType

MAX_ENUMERATED: Final = 4096
"""Greatest number of values that the other variables of one comparison may have; all are tried."""


class NoCellsError(Exception):
    """A condition does not compare a quantity with numbers; the message says which."""


def cells(bounds: tuple[Fraction, Fraction], breakpoints: Iterable[Fraction]) -> tuple[Fraction, ...]:
    """List one value of each cell of a range.

    Args:
        bounds: closed range of the quantity, SI.
        breakpoints: numbers between which no condition changes, SI; those outside the range are left out.

    Returns:
        The values in increasing order: the breakpoints, and the middle of each interval between them.
    """
    low, high = bounds
    inside = sorted({one for one in breakpoints if low <= one <= high})
    values = list(inside)
    values += [(before + after) / 2 for before, after in pairwise(sorted({low, *inside, high}))]
    return tuple(sorted(values)) or (low,)


def values_between(values: Sequence[Fraction], low: Fraction, high: Fraction) -> tuple[Fraction, ...]:
    """List the cells that a closed range meets, where its bounds are breakpoints.

    Args:
        values: a value of each cell, in increasing order.
        low: least value of the range, SI.
        high: greatest value of the range, SI.

    Returns:
        The values that are in the range.
    """
    return tuple(one for one in values if low <= one <= high)


def breakpoints(
    term: t.Term, name: str, others: Mapping[str, Sequence[Any]], quantities: Iterable[str] = ()
) -> set[Fraction]:
    """Find numbers between which a condition does not change, whatever the other variables are.

    Args:
        term: lowered condition, whose inputs are constants.
        name: the quantity.
        others: values of each variable that has finitely many, by name.
        quantities: names of all quantities, of which no two may be compared.

    Returns:
        The breakpoints, SI; some of them may be needless.

    Raises:
        NoCellsError: a comparison is not piecewise linear in the quantity, or reads another one.
    """
    found: set[Fraction] = set()
    for compared in _comparisons(term, name):
        read = t.variables_of(compared).keys() - {name}
        second = next(iter(sorted(read & set(quantities))), None)
        if second is not None:
            raise NoCellsError(f"`{min(name, second)}` is compared with `{max(name, second)}`")
        unlisted = next(iter(sorted(read - others.keys())), None)
        if unlisted is not None:
            raise NoCellsError(f"`{name}` is compared with `{unlisted}`")
        if prod(len(others[one]) for one in read) > MAX_ENUMERATED:
            raise NoCellsError(f"`{name}` is compared with too many values")
        for chosen in product(*([(one, value) for value in others[one]] for one in read)):
            found |= _Pieces(name, dict(chosen)).switches(compared)
    return found


def _comparisons(term: t.Term, name: str) -> Iterator[t.Compare]:
    """Yield the outermost comparisons that read a quantity."""
    if name not in t.variables_of(term):
        return
    if isinstance(term, t.Compare):
        yield term
        return
    for child in t.children(term):
        yield from _comparisons(child, name)


class _Pieces:
    """Pieces of terms as functions of one quantity, where all other variables have fixed values."""

    def __init__(self, name: str, values: Mapping[str, Any]) -> None:
        self._name = name
        self._values = values

    def switches(self, condition: t.Term) -> set[Fraction]:
        """Find the numbers at which a condition may change.

        Raises:
            NoCellsError: it is not made of comparisons of piecewise linear terms.
        """
        match condition:
            case t.Compare(left=left, right=right) if _is_number(left):
                return self._bends(left) | self._bends(right) | self._crossings(left, right)
            case t.Literal() | t.Variable():
                return set()
            case t.Compare() | t.Not() | t.And() | t.Or() | t.Implies() | t.Conditional():
                return set().union(*map(self.switches, t.children(condition)))
            case _:
                raise NoCellsError(f"a condition on `{self._name}` is not a comparison with a number")

    def _bends(self, term: t.Term) -> set[Fraction]:
        """Find numbers between which a number is linear in the quantity.

        Raises:
            NoCellsError: there are no such numbers, or they are not found.
        """
        match term:
            case t.Literal() | t.Variable():
                return set()
            case t.Add(left=left, right=right):
                return self._bends(left) | self._bends(right)
            case t.Multiply(left=left, right=right):
                if self._reads(left) and self._reads(right):
                    raise NoCellsError(f"a condition multiplies `{self._name}` by itself")
                # The factor that does not read the quantity is a constant here.
                return self._bends(left) | self._bends(right)
            case t.Absolute(operand=operand):
                return self._bends(operand) | self._crossings(operand, None)
            case t.Extremum(left=left, right=right):
                return self._bends(left) | self._bends(right) | self._crossings(left, right)
            case t.Conditional(condition=condition, then=then, otherwise=otherwise):
                return self.switches(condition) | self._bends(then) | self._bends(otherwise)
            case _:
                raise NoCellsError(f"a condition on `{self._name}` is not linear in it")

    def _reads(self, term: t.Term) -> bool:
        return self._name in t.variables_of(term)

    def _crossings(self, left: t.Term, right: t.Term | None) -> set[Fraction]:
        """Find where two piecewise linear terms are equal; the right one is 0 if there is none."""
        bends = self._bends(left) | (set() if right is None else self._bends(right))
        found = set()
        for first, second in _samples(sorted(bends)):
            at_first, at_second = (
                self._value(left, at) - (0 if right is None else self._value(right, at))
                for at in (first, second)
            )
            if at_first != at_second:
                found.add(first - at_first * (second - first) / (at_second - at_first))
        return found

    def _value(self, term: t.Term, at: Fraction) -> Fraction:
        return cast("Fraction", evaluate(term, {**self._values, self._name: at}))


def _samples(bends: Sequence[Fraction]) -> Iterator[tuple[Fraction, Fraction]]:
    """Yield two numbers inside each interval between bends."""
    if not bends:
        yield Fraction(0), Fraction(1)
        return
    yield bends[0] - 2, bends[0] - 1
    for low, high in pairwise(bends):
        third = (high - low) / 3
        yield low + third, high - third
    yield bends[-1] + 1, bends[-1] + 2


def _is_number(term: t.Term) -> bool:
    match term:
        case t.Literal(type=type_) | t.Variable(type=type_):
            return isinstance(type_, RealType)
        case t.Conditional(then=then):
            return _is_number(then)
        case _:
            return isinstance(term, t.Add | t.Multiply | t.Extremum | t.Absolute)
