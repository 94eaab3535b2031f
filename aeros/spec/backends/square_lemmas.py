"""Squares that are at least 0, of sums that relate the products of a question.

`(r * a - b)² >= 0` says that `2 * a * b <= r * a² + b² / r`. With the right r, sums of these prove the
triangle inequality and that of Cauchy and Schwarz (Steele, The Cauchy-Schwarz Master Class, 2004, chapter 1).
A wrong r does no harm, as a square is never negative.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import combinations, product
from typing import Final

from aeros.spec.backends.length_lemmas import number, total
from aeros.spec.expr import terms as t

MAX_FACTORS: Final = 60  # of a question whose factors are paired
_FINENESS: Final = 10**4  # greatest denominator of a ratio
_TINY: Final = 1e-6

_Linear = tuple[tuple[str, Fraction], ...]
"""Coefficients by scalar variable, in order of their names; that of `` is the constant."""


def square_lemmas(parts: Sequence[t.Term], near: Mapping[str, float]) -> Iterator[t.Term]:
    """Yield squares of the factors of products, put together where the question has products of both.

    Args:
        parts: all terms of a lowered question.
        near: a point at which the question's conditions are off by little, if one is known: value by scalar
            variable. If no point meets them, the squares of a proof are small there.

    Yields:
        `(a + b)² >= 0` and `(a - b)² >= 0` of two factors, and the same of three; with the values that the
        factors have nearby, `(r * a - b)² >= 0` with their ratio r, and `(a - c)² >= 0` with the value c.
    """
    variables = {part.name: part for part in parts if isinstance(part, t.Variable)}
    for linear in dict.fromkeys(one for one in _squared_sums(parts, near) if one):
        weighted = [(number(factor), variables.get(name)) for name, factor in linear]
        summed = total(t.Multiply(factor, one) if one else factor for factor, one in weighted)
        yield t.Compare("<=", number(Fraction(0)), t.Multiply(summed, summed))


def _squared_sums(parts: Sequence[t.Term], near: Mapping[str, float]) -> Iterator[_Linear]:
    multiplied = [one for part in parts for one in factors(part)]
    linear = dict.fromkeys([*multiplied, *(one for part in parts for one in _in_absolute(part))])
    if not multiplied or len(linear) > MAX_FACTORS:
        return
    present = {pair for part in parts for pair in _products_in(part)}
    pairs = [pair for pair in combinations(linear, 2) if _products(*pair) <= present]
    yield from (_weighted({a: Fraction(1), b: sign}) for a, b in pairs for sign in _SIGNS)
    yield from _squares_that_vanish(linear, pairs, near)
    related = set(pairs)
    for a, b, c in combinations(linear, 3):
        if {(a, b), (a, c), (b, c)} <= related:
            yield from (
                _weighted({a: Fraction(1), b: one, c: other}) for one, other in product(_SIGNS, _SIGNS)
            )


def _squares_that_vanish(
    linear: Iterable[_Linear], pairs: Sequence[tuple[_Linear, _Linear]], near: Mapping[str, float]
) -> Iterator[_Linear]:
    """Yield `r * a - b` and `a - c` that are next to 0 at a point."""
    values = {one: _value(one, near) for one in linear} if near else {}
    for a, b in pairs:
        if near and abs(values[a]) > _TINY:
            ratio = values[b] / values[a]
            yield from (_weighted({a: one, b: Fraction(-1)}) for one in _nearby(ratio))
    for one, value in values.items():
        yield from (_weighted({one: Fraction(1), _ONE: -simple}) for simple in _nearby(value))


def _value(linear: _Linear, near: Mapping[str, float]) -> Fraction:
    return sum((factor * Fraction(near[name] if name else 1) for name, factor in linear), Fraction(0))


def _nearby(value: Fraction) -> list[Fraction]:
    """Return fractions near a number, simple ones first."""
    fractions = [value.limit_denominator(most) for most in (20, _FINENESS)]
    return list(dict.fromkeys(fractions))


_ONE: Final[_Linear] = (("", Fraction(1)),)
_SIGNS: Final = (Fraction(1), Fraction(-1))


def factors(term: t.Term) -> Iterator[_Linear]:
    """Yield the factors of a product of two linear expressions with variables.

    Args:
        term: a lowered term.

    Yields:
        Both factors; none of another term.
    """
    if isinstance(term, t.Multiply):
        sides = [linear_of(term.left), linear_of(term.right)]
        if all(side is not None and any(name for name, _ in side) for side in sides):
            yield from (side for side in sides if side is not None)


def _in_absolute(term: t.Term) -> Iterator[_Linear]:
    if isinstance(term, t.Absolute) and (linear := linear_of(term.operand)):
        yield linear


def _products_in(term: t.Term) -> set[tuple[str, str]]:
    """Return the pairs of variables that occur in a product, or in the square of an absolute value."""
    sides = list(factors(term)) or [*_in_absolute(term)] * 2
    return _products(*sides) if sides else set()


def _products(a: _Linear, b: _Linear) -> set[tuple[str, str]]:
    """Return the pairs of variables that occur in a product, multiplied out."""
    return {(min(x, y), max(x, y)) for (x, _), (y, _) in product(a, b) if x and y}


def _weighted(weights: Mapping[_Linear, Fraction]) -> _Linear:
    summed: _Linear = ()
    for linear, weight in weights.items():
        summed = _sum(summed, linear, weight)
    return summed


def _sum(left: _Linear, right: _Linear, weight: Fraction) -> _Linear:
    summed = dict(left)
    for name, factor in right:
        summed[name] = summed.get(name, Fraction(0)) + weight * factor
    return tuple(sorted((name, factor) for name, factor in summed.items() if factor))


def linear_of(term: t.Term) -> _Linear | None:
    """Write an expression as a sum of variables with coefficients.

    Args:
        term: a lowered number.

    Returns:
        The coefficients; None if it is not linear, or has other parts than variables.
    """
    match term:
        case t.Literal(value=Fraction() as value):
            return (("", value),) if value else ()
        case t.Variable(name=name):
            return ((name, Fraction(1)),)
        case t.Add(left=left, right=right):
            a, b = linear_of(left), linear_of(right)
            return None if a is None or b is None else _sum(a, b, Fraction(1))
        case (
            t.Multiply(left=t.Literal(value=Fraction() as factor), right=part)
            | t.Multiply(left=part, right=t.Literal(value=Fraction() as factor))
        ):
            linear = linear_of(part)
            return None if linear is None else _sum((), linear, factor)
    return None
