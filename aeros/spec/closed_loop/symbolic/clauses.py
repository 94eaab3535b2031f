"""Sets of states as clauses, by the algorithm of Minato and Morreale for irredundant sums of products.

S. Minato, "Fast generation of irredundant sum-of-products forms from binary decision diagrams", SASIMI 1992.
The sum is one of the set's complement, and each product is the negation of a clause.
"""

from __future__ import annotations

from typing import Any

Literal = tuple[str, bool]
"""A bit, and the value that it has."""

Clause = frozenset[Literal]
"""A disjunction: some bit has its value."""


class _TooManyError(Exception):
    """There are more products than are wanted."""


def clauses_of(bdd: Any, states: Any, limit: int) -> tuple[Clause, ...] | None:
    """List clauses that hold together exactly in a set.

    Args:
        bdd: the diagrams.
        states: the set.
        limit: largest number of clauses that are wanted.

    Returns:
        The clauses; None if there are more.
    """
    outside = ~states
    try:
        products, _ = _Sums(bdd, limit).between(outside, outside)
    except _TooManyError:
        return None
    return tuple(frozenset((bit, not value) for bit, value in product) for product in products)


class _Sums:
    """Sums of products between two sets, each computed once."""

    def __init__(self, bdd: Any, limit: int) -> None:
        self._bdd = bdd
        self._limit = limit
        self._known: dict[tuple[Any, Any], tuple[tuple[Clause, ...], Any]] = {}

    def between(self, least: Any, most: Any) -> tuple[tuple[Clause, ...], Any]:
        """Find products whose union contains the first set and is in the second, with that union.

        Raises:
            _TooManyError: there are more than the limit.
        """
        bdd = self._bdd
        if least == bdd.false:
            return (), bdd.false
        if most == bdd.true:
            return (frozenset(),), bdd.true
        key = (least, most)
        if key not in self._known:
            bit = min((one.var for one in key if one.var is not None), key=bdd.level_of_var)
            low, high = ([bdd.let({bit: value}, one) for one in key] for value in (False, True))
            negative, in_low = self.between(low[0] & ~high[1], low[1])
            positive, in_high = self.between(high[0] & ~low[1], high[1])
            rest = (low[0] & ~in_low) | (high[0] & ~in_high)
            both, anywhere = self.between(rest, low[1] & high[1])
            union = bdd.ite(bdd.var(bit), in_high, in_low) | anywhere
            products = (
                *(one | {(bit, False)} for one in negative),
                *(one | {(bit, True)} for one in positive),
                *both,
            )
            if len(products) > self._limit:
                raise _TooManyError
            self._known[key] = (products, union)
        return self._known[key]
