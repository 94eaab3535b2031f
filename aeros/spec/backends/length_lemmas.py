"""The inequality of Cauchy and Schwarz, for vectors whose lengths a question compares."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from functools import reduce
from itertools import combinations
from math import isqrt
from typing import Final

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER

MAX_LENGTHS: Final = 12  # of a question that are put beside each other


_Length = tuple[tuple[t.Term, ...], t.Term]
"""Elements of a vector, and the number that its length is compared with."""


def length_lemmas(parts: Sequence[t.Term]) -> Iterator[t.Term]:
    """Yield the inequality of Cauchy and Schwarz for each two vectors whose lengths are compared.

    Args:
        parts: all terms of a lowered question.

    Yields:
        `-r * s <= dot(a, b) <= r * s` where `norm(a) <= r` and `norm(b) <= s`; and `norm(a) <= r` where the
        sum of the sizes of a's elements is at most r.
    """
    lengths = {length: None for part in parts if (length := _length(part)) is not None}
    for summed in {length: None for part in parts if (length := _summed_sizes(part)) is not None}:
        vector, most = summed
        sizes = total(map(t.Absolute, vector))
        yield t.Implies(t.Compare("<=", sizes, most), t.And(_is_at_most(vector, most)))
        lengths.setdefault(summed)
    for (a, a_most), (b, b_most) in combinations(list(lengths)[:MAX_LENGTHS], 2):
        if len(a) == len(b):
            most = t.Multiply(a_most, b_most)
            least = t.Multiply(number(Fraction(-1)), most)
            scalar_product = _dot(a, b)
            within = t.And((t.Compare("<=", least, scalar_product), t.Compare("<=", scalar_product, most)))
            yield t.Implies(t.And((*_is_at_most(a, a_most), *_is_at_most(b, b_most))), within)


def _is_at_most(vector: Sequence[t.Term], most: t.Term) -> tuple[t.Term, t.Term]:
    squared = t.Compare("<=", _dot(vector, vector), t.Multiply(most, most))
    return t.Compare("<=", number(Fraction(0)), most), squared


def total(numbers: Iterable[t.Term]) -> t.Term:
    """Add numbers.

    Args:
        numbers: lowered numbers, at least one.

    Returns:
        Their sum.
    """
    return reduce(t.Add, numbers)


def _dot(a: Sequence[t.Term], b: Sequence[t.Term]) -> t.Term:
    return total(map(t.Multiply, a, b))


def _length(term: t.Term) -> _Length | None:
    """Return a vector of which a comparison compares the sum of the squares of its elements."""
    for most, summed in _sides(term):
        length, elements = _root_of(most), [_root_of(one) for one in addends(summed)]
        vector = tuple(one for one in elements if one is not None)
        if length is not None and 1 < len(vector) == len(elements):
            return vector, length
    return None


def _summed_sizes(term: t.Term) -> _Length | None:
    """Return a vector of which a comparison compares the sum of the sizes of its elements."""
    for most, summed in _sides(term):
        sizes = list(addends(summed))
        vector = tuple(one.operand for one in sizes if isinstance(one, t.Absolute))
        if 1 < len(vector) == len(sizes):
            return vector, most
    return None


def _sides(term: t.Term) -> Iterator[tuple[t.Term, t.Term]]:
    if isinstance(term, t.Compare) and term.op != "==":
        yield term.left, term.right
        yield term.right, term.left


def _root_of(term: t.Term) -> t.Term | None:
    """Return what is squared, or the root of a number, if it is rational."""
    if isinstance(term, t.Literal) and isinstance(term.value, Fraction) and term.value > 0:
        root = Fraction(isqrt(term.value.numerator), isqrt(term.value.denominator))
        return number(root) if root * root == term.value else None
    return term.left if isinstance(term, t.Multiply) and term.left == term.right else None


def addends(term: t.Term) -> Iterator[t.Term]:
    """Yield what a sum adds.

    Args:
        term: a lowered number.

    Yields:
        Its addends, none of them a sum; the number itself if it is none.
    """
    if isinstance(term, t.Add):
        yield from addends(term.left)
        yield from addends(term.right)
    else:
        yield term


def number(value: Fraction) -> t.Literal:
    """Write a number without a dimension.

    Args:
        value: the number.

    Returns:
        Its literal.
    """
    return t.Literal(value, RealType(NUMBER))
