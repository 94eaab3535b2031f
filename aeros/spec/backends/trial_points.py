"""Search for a point at which a question's conditions hold, among the values that it names.

Counterexamples to claims on distances often lie on a line along an axis, with the bounds of the question as
coordinates. Such points are few, and a solver of polynomials may take long to come to them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import combinations, islice, product
from typing import Final

from aeros.spec.backends.lemmas import sizes_in
from aeros.spec.backends.solver_results import Question, ScalarValue
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import IntegerType, RealType

MAX_NUMBERS: Final = 15  # scalar variables of a question that is searched
MAX_VALUES: Final = 12  # values of one variable
MAX_POINTS: Final = 20_000  # under a second


def find_point(question: Question) -> Mapping[str, ScalarValue] | None:
    """Try points at which at most two numbers differ from 0 or from the bound that is nearest to 0.

    Args:
        question: the question.

    Returns:
        Value of each scalar variable where all conditions hold; None if none is found, or if there are other
        variables than real numbers, or too many.
    """
    scalars = [part for one in question.variables for part in scalar_variables(one)]
    if len(scalars) > MAX_NUMBERS or not all(_is_plain_number(one) for one in scalars):
        return None
    conditions = [lower(term) for term in question.terms]
    values = _values(conditions)
    for point in islice(_points(scalars, question.ranges, values), MAX_POINTS):
        if all(is_true(one, point) for one in conditions):
            return point
    return None


def _is_plain_number(scalar: t.Variable) -> bool:
    return isinstance(scalar.type, RealType) and not isinstance(scalar.type, IntegerType)


def _values(conditions: Sequence[t.Term]) -> list[Fraction]:
    """Return constants of the conditions, their rational roots and sums of two, roots before others."""
    sizes = sizes_in(conditions)
    roots = {one for one in sizes if one * one in sizes}
    simple = sorted(sizes, key=lambda one: (one not in roots, *_complexity(one)))[:4]
    sums = [a + b for a, b in combinations(simple, 2)]
    tried = list(dict.fromkeys([*simple, *sums]))[: MAX_VALUES // 2]
    return [sign * size for size in tried for sign in (1, -1)]


def _complexity(value: Fraction) -> tuple[int, Fraction]:
    return value.numerator + value.denominator, value


def _points(
    scalars: Sequence[t.Variable],
    ranges: Mapping[str, tuple[Fraction, Fraction]],
    values: Sequence[Fraction],
) -> Iterator[dict[str, Fraction]]:
    rest = {one.name: _nearest_to_zero(ranges.get(one.name)) for one in scalars}
    for count in (0, 1, 2):
        for chosen in combinations([one.name for one in scalars], count):
            for given in product(*([(name, value) for value in values] for name in chosen)):
                if all(_is_within(ranges.get(name), value) for name, value in given):
                    yield rest | dict(given)


def _nearest_to_zero(bounds: tuple[Fraction, Fraction] | None) -> Fraction:
    return Fraction(0) if bounds is None else min(max(Fraction(0), bounds[0]), bounds[1])


def _is_within(bounds: tuple[Fraction, Fraction] | None, value: Fraction) -> bool:
    return bounds is None or bounds[0] <= value <= bounds[1]
