"""Boxes: for each scalar variable, and for sums of some, the values that it may still have."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import reduce
from typing import TypeAlias

from aeros.spec.backends.answers import Scalar
from aeros.spec.backends.bounds.interval import Interval
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, IntegerType

Sum: TypeAlias = tuple[tuple[str, Fraction], ...]
"""Two or more scalar variables by name, each with a factor, the first of which is 1."""

Values: TypeAlias = Interval | frozenset[bool] | frozenset[str]
Box: TypeAlias = dict[str | Sum, Values]


def values_of(scalar: t.Variable, ranges: Mapping[str, tuple[Fraction, Fraction]]) -> Values:
    """What a variable may be before anything is asked of it."""
    match scalar.type:
        case BoolType():
            return frozenset((False, True))
        case EnumType(members=members):
            return frozenset(members)
        case _:
            return Interval(*ranges.get(scalar.name, (None, None)))


def first_of(scalar: t.Variable, values: Values) -> Scalar:
    """One of the values; a real where there is no whole number near the middle."""
    if isinstance(values, Interval):
        return values.whole() if isinstance(scalar.type, IntegerType) else values.middle()
    if isinstance(scalar.type, EnumType):
        return next(one for one in scalar.type.members if one in values)
    return False not in values


def propagated(box: Box) -> bool:
    """Narrow each variable of a sum to what the others leave it; whether values are left."""
    for of in [of for of in box if isinstance(of, tuple)]:
        whole = box[of] = _interval(box[of]).meet(_total(of, box))
        for place, (name, factor) in enumerate(of):
            rest = _total((*of[:place], *of[place + 1 :]), box)
            box[name] = meet(box[name], whole.plus(rest.times(Fraction(-1))).times(1 / factor))
            if is_empty(box[name]):
                return False
    return True


def meet(one: Values, other: Values) -> Values:
    """What is in both."""
    if isinstance(one, Interval):
        return one.meet(_interval(other))
    return one & other  # type: ignore[operator]


def _interval(values: Values) -> Interval:
    assert isinstance(values, Interval)  # noqa: S101  terms are well typed
    return values


def known(of: str | Sum, box: Box) -> Values:
    """The values that a variable or a sum may have, as far as `box` tells."""
    if isinstance(of, str):
        return box[of]
    kept = box.get(of)
    return _total(of, box) if kept is None else kept


def _total(of: Sum, box: Box) -> Interval:
    return reduce(Interval.plus, (_interval(box[name]).times(factor) for name, factor in of))


def is_empty(values: Values) -> bool:
    """Whether no value is left."""
    return values.is_empty if isinstance(values, Interval) else not values
