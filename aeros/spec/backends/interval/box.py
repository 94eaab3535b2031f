"""Boxes: sets of values that scalar variables, and sums of them, may still have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from fractions import Fraction
from typing import TypeAlias

from aeros.spec.backends.interval.interval import End, Interval
from aeros.spec.backends.solver_results import ScalarValue
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BoolType, EnumType, IntegerType

LinearSum: TypeAlias = tuple[tuple[str, Fraction], ...]
"""Two or more scalar variables by name, each with a factor, the first of which is 1."""

ValueSet: TypeAlias = Interval | frozenset[bool] | frozenset[str]
Box: TypeAlias = dict[str | LinearSum, ValueSet]


def declared_interval(scalar: t.Variable, ranges: Mapping[str, tuple[Fraction, Fraction]]) -> ValueSet:
    """Return the values that a variable may have before any condition.

    Args:
        scalar: scalar variable.
        ranges: closed range (SI) of each real scalar variable; one without a range is unbounded.

    Returns:
        An interval for a real; else both truth values or all members.
    """
    match scalar.type:
        case BoolType():
            return frozenset((False, True))
        case EnumType(members=members):
            return frozenset(members)
        case _:
            return Interval(*ranges.get(scalar.name, (None, None)))


def pick_value(scalar: t.Variable, values: ValueSet, end: End = None) -> ScalarValue:
    """Pick one of the values.

    Args:
        scalar: variable that is to have the value.
        values: values to pick from; not empty.
        end: end of an interval to stay near; None for its middle.

    Returns:
        The value. For an integer variable, a real if there is no whole number next to the point picked.
    """
    if isinstance(values, Interval):
        return values.pick_integer(end) if isinstance(scalar.type, IntegerType) else values.pick_near(end)
    if isinstance(scalar.type, EnumType):
        return next(member for member in scalar.type.members if member in values)
    return False not in values


def propagate_sums(box: Box) -> bool:
    """Narrow each variable of a sum to the values that the others leave for it.

    Args:
        box: box to narrow, in place.

    Returns:
        False if some variable has no value left.
    """
    sums = [of for of in box if isinstance(of, tuple)]
    occurs = Counter(name for of in sums for name, _ in of)
    for _ in sums:  # at most this often: narrowing one sum may narrow another that shares a variable
        again = False
        for of in sums:
            whole = box[of] = _interval(box[of]).intersect(_sum_interval(of, box))
            for place, (name, factor) in enumerate(of):
                rest, before = _sum_interval(of, box, without=place), box[name]
                box[name] = intersect(
                    before, whole.subtract(rest).scale(factor if factor in (1, -1) else 1 / factor)
                )
                if is_empty(box[name]):
                    return False
                again |= occurs[name] > 1 and box[name] != before
        if not again:
            break
    return True


def intersect(one: ValueSet, other: ValueSet) -> ValueSet:
    """Intersect two sets of values of the same kind.

    Args:
        one: a set.
        other: another set.

    Returns:
        The values in both.
    """
    if isinstance(one, Interval):
        return one.intersect(_interval(other))
    return one & other  # type: ignore[operator]


def _interval(values: ValueSet) -> Interval:
    assert isinstance(values, Interval)  # noqa: S101  terms are well typed
    return values


def values_in_box(of: str | LinearSum, box: Box) -> ValueSet:
    """Return the values that a variable or a sum may have in a box.

    Args:
        of: name of a scalar variable, or a linear sum.
        box: values of all variables, and of some sums.

    Returns:
        The values; for a sum that the box does not list, the interval sum of its variables.
    """
    if isinstance(of, str):
        return box[of]
    kept = box.get(of)
    return _sum_interval(of, box) if kept is None else kept


def _sum_interval(of: LinearSum, box: Box, *, without: int | None = None) -> Interval:
    """Return the values of a sum, as its variables leave them, with or without one of its parts."""
    total: Interval | None = None
    for place, (name, factor) in enumerate(of):
        if place != without:
            part = _interval(box[name]).scale(factor)
            total = part if total is None else total.add(part)
    assert total is not None  # noqa: S101  a sum has two parts or more
    return total


def is_empty(values: ValueSet) -> bool:
    """Say if a set has no values.

    Args:
        values: set of values.

    Returns:
        True if it is empty.
    """
    return values.is_empty if isinstance(values, Interval) else not values
