"""Witnesses of differences that the gate can see: it gets doubles, and a solver's values are exact.

On a bound the two can differ: the double nearest to 1/5 is larger than 1/5, so `speed <= 0.2 m/s` denies it.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Final

from aeros.spec.expr.doubles import adjacent_doubles
from aeros.spec.expr.semantics import Value
from aeros.spec.verification.witness import Witness

_ATTEMPTS: Final = 200


def witness_of_doubles(witness: Witness, shows: Callable[[Mapping[str, Value]], bool]) -> Witness | None:
    """Find values near a witness that show the same when the gate gets them as doubles.

    Args:
        witness: exact values that show a difference.
        shows: tells if values show the difference.

    Returns:
        The same witness if its nearest doubles show it, too; else one whose numbers are decimals that do,
        both exactly and as doubles; None if no doubles next to the witness do.
    """
    if shows({name: _rounded(value, _nearest) for name, value in witness.values.items()}):
        return witness
    for attempt in range(_ATTEMPTS):
        neighbour = _random_neighbour(attempt)
        doubles = {name: _rounded(value, neighbour) for name, value in witness.values.items()}
        decimals = {name: _rounded(value, _shortest_decimal) for name, value in doubles.items()}
        if shows(doubles) and shows(decimals):
            return replace(witness, values=decimals)
    return None


def _nearest(part: Fraction) -> float:
    return float(part)


def _random_neighbour(seed: int) -> Callable[[Fraction], float]:
    chance = random.Random(seed)  # noqa: S311  picks neighbours, guards nothing
    return lambda part: chance.choice(adjacent_doubles(part))


def _shortest_decimal(part: Fraction) -> Fraction:
    return Fraction(repr(float(part)))


def _rounded(value: Value, rounding: Callable[[Fraction], float | Fraction]) -> Value:
    """Round each number of a value; others stay."""
    if isinstance(value, tuple):
        numbers = tuple(Fraction(rounding(part)) for part in value if isinstance(part, Fraction))
        return numbers or value  # a tuple of truth values has no numbers
    return Fraction(rounding(value)) if isinstance(value, Fraction) else value
