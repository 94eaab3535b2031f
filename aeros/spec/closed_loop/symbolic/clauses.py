"""Sets of states as clauses, by the algorithm of Minato and Morreale for irredundant sums of products.

S. Minato, "Fast generation of irredundant sum-of-products forms from binary decision diagrams", SASIMI 1992.
The sum is one of the set's complement, and each product is the negation of a clause.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

Literal = tuple[str, bool]
"""A bit, and the value that it has."""

Clause = frozenset[Literal]
"""A disjunction: some bit has its value."""


class _TooManyError(Exception):
    """There are more products than are wanted."""


def clauses_of(bdd: Any, states: Any, valid: Any, limit: int) -> tuple[Clause, ...] | None:
    """List clauses that, among valid states, hold together exactly in a set.

    Args:
        bdd: the diagrams.
        states: the set.
        valid: all states that there are.
        limit: largest number of clauses that are wanted.

    Returns:
        The clauses; None if there are more.
    """
    try:
        outside, _ = _Sums(bdd, limit).between(valid & ~states, ~(valid & states))
    except _TooManyError:
        return None
    return tuple(frozenset((bit, not value) for bit, value in product) for product in _products(outside))


class _Sum(NamedTuple):
    """A sum of products: those of three sums, of which two have one more bit.

    Attributes:
        size: number of products.
        bit: the bit.
        where_unset, where_set, in_both: the sums; None for the empty one.
    """

    size: int
    bit: str = ""
    where_unset: _Sum | None = None
    where_set: _Sum | None = None
    in_both: _Sum | None = None


_ONE: Final = _Sum(1)
"""The sum of the empty product."""


def _products(sum_: _Sum | None) -> Iterator[tuple[Literal, ...]]:
    if sum_ is _ONE:
        yield ()
    elif sum_ is not None:
        yield from (((sum_.bit, False), *rest) for rest in _products(sum_.where_unset))
        yield from (((sum_.bit, True), *rest) for rest in _products(sum_.where_set))
        yield from _products(sum_.in_both)


class _Sums:
    """Sums of products between two sets, each computed once."""

    def __init__(self, bdd: Any, limit: int) -> None:
        self._bdd = bdd
        self._limit = limit
        self._known: dict[tuple[Any, Any], tuple[_Sum | None, Any]] = {}

    def between(self, least: Any, most: Any) -> tuple[_Sum | None, Any]:
        """Find products whose union contains the first set and is in the second, with that union.

        Raises:
            _TooManyError: there are more than the limit.
        """
        bdd = self._bdd
        if least == bdd.false:
            return None, bdd.false
        if most == bdd.true:
            return _ONE, bdd.true
        key = (least, most)
        if key not in self._known:
            bit = (least if least.level <= most.level else most).var
            (low, high), (low_most, high_most) = _halves(least, bit), _halves(most, bit)
            unset, in_low = self.between(low & ~high_most, low_most)
            set_, in_high = self.between(high & ~low_most, high_most)
            rest = (low & ~in_low) | (high & ~in_high)
            both, anywhere = self.between(rest, low_most & high_most)
            union = bdd.ite(bdd.var(bit), in_high, in_low) | anywhere
            size = sum(one.size for one in (unset, set_, both) if one is not None)
            if size > self._limit:
                raise _TooManyError
            self._known[key] = (_Sum(size, bit, unset, set_, both), union)
        return self._known[key]


def _halves(states: Any, bit: str) -> tuple[Any, Any]:
    """Split a set by a bit that is not below its first one."""
    if states.var != bit:
        return states, states
    return (~states.low, ~states.high) if states.negated else (states.low, states.high)
