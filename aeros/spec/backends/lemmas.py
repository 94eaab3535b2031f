"""Conditions that are always true, which help a solver where its own search ends in its budget.

Asserted beside a question they change no answer. They relate what a solver takes for unrelated: a product of
two different expressions and their squares, a count and the numbers that are compared in it, or an absolute
value and its operand.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import chain, islice
from types import MappingProxyType
from typing import Final

from aeros.spec.backends.length_lemmas import addends, length_lemmas, number
from aeros.spec.backends.square_lemmas import factors, square_lemmas
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower

MAX_LEMMAS: Final = 4000

Point = Mapping[str, float]
"""Value by scalar variable, in SI; of truths 1 or 0."""

Ranges = Mapping[str, tuple[Fraction, Fraction]]
"""Lowest and highest value of scalar variables, by name."""

_Bounds = Mapping[t.Term, Sequence[tuple[t.Term, bool, Fraction]]]
"""By expression, conditions that bound it: each with True for a bound from below, and the bound."""


def lemmas_for(
    terms: Sequence[t.Term], ranges: Ranges = MappingProxyType({}), near: Point = MappingProxyType({})
) -> list[t.Term]:
    """Write lemmas about the products and counts of a question.

    Args:
        terms: boolean terms of a question, without past-time operators.
        ranges: ranges of its scalar variables; a lemma that uses one has it as its premise.
        near: a point at which the terms are off by little, if one is known; some lemmas have numbers from it.

    Returns:
        Conditions that are true at every point, at most `MAX_LEMMAS`; none if nothing in the question calls
        for one. Their literals are bare numbers, whatever the dimensions are.
    """
    parts = [one for term in terms for one in t.walk([lower(term)])]
    return list(islice(chain(_bound_lemmas(parts), _relating_lemmas(terms, parts, ranges, near)), MAX_LEMMAS))


def relating_lemmas(
    terms: Sequence[t.Term], ranges: Ranges = MappingProxyType({}), near: Point = MappingProxyType({})
) -> list[t.Term]:
    """Write those lemmas that relate products or counts, without which a solver may search for minutes.

    Args:
        terms: boolean terms of a question, without past-time operators.
        ranges: as for `lemmas_for`.
        near: as for `lemmas_for`.

    Returns:
        As `lemmas_for`, but none for an absolute value or an extremum alone.
    """
    parts = [one for term in terms for one in t.walk([lower(term)])]
    return list(islice(_relating_lemmas(terms, parts, ranges, near), MAX_LEMMAS))


def _relating_lemmas(
    terms: Sequence[t.Term], parts: Sequence[t.Term], ranges: Ranges, near: Point
) -> Iterator[t.Term]:
    required = [one for term in terms for one in _conjuncts(lower(term))]
    bounds = _bounds_in(required, parts, ranges)
    return chain(
        _count_lemmas(required, parts, bounds),
        _product_lemmas(parts, bounds),
        length_lemmas(parts),
        square_lemmas(parts, near),
    )


def _bounds_in(required: Sequence[t.Term], parts: Sequence[t.Term], ranges: Ranges) -> _Bounds:
    """Collect the conditions that bound expressions: those that are required, and the ranges of variables."""
    bounds: dict[t.Term, list[tuple[t.Term, bool, Fraction]]] = {}
    for one in required:
        if (bound := _bound(one)) is not None:
            bounded, is_lower, limit = bound
            bounds.setdefault(bounded, []).append((one, is_lower, limit))
            sizes = [] if is_lower else list(addends(bounded))
            if len(sizes) > 1 and all(isinstance(size, t.Absolute) for size in sizes):
                for size in sizes:
                    bounds.setdefault(size, []).append((one, False, limit))
    for variable in dict.fromkeys(one for one in parts if isinstance(one, t.Variable) and one.name in ranges):
        low, high = ranges[variable.name]
        bounds.setdefault(variable, []).extend(
            (
                (t.Compare("<=", number(low), variable), True, low),
                (t.Compare("<=", variable, number(high)), False, high),
            )
        )
    return bounds


def _product_lemmas(parts: Sequence[t.Term], bounds: _Bounds) -> Iterator[t.Term]:
    """Yield `a * b <= K * abs(a)` and `-(a * b) <= K * abs(a)`, where `abs(a)` occurs and `abs(b) <= K`.

    And `a * a <= K * K`, where `abs(a)` occurs and `abs(a) <= K`.
    """
    sizes = dict.fromkeys(one for one in parts if isinstance(one, t.Absolute))
    products = dict.fromkeys(one for one in parts if isinstance(one, t.Multiply) and any(factors(one)))
    for one in products:
        for part, other in ((one.left, one.right), (one.right, one.left)):
            size = t.Absolute(part)
            for premise, limit in _size_bounds(other, bounds) if size in sizes else ():
                most = t.Multiply(number(limit), size)
                least = t.Multiply(number(Fraction(-1)), one)
                yield t.Implies(premise, t.And((t.Compare("<=", one, most), t.Compare("<=", least, most))))
    for size in sizes if products else ():
        for premise, limit in _size_bounds(size.operand, bounds):
            square = t.Multiply(size.operand, size.operand)
            yield t.Implies(premise, t.Compare("<=", square, number(limit * limit)))


def _size_bounds(term: t.Term, bounds: _Bounds) -> Iterator[tuple[t.Term, Fraction]]:
    """Yield conditions with the bound that each puts on the absolute value of an expression."""
    for condition, is_lower, limit in bounds.get(t.Absolute(term), ()):
        if not is_lower:
            yield condition, limit
    below = [one for one in bounds.get(term, ()) if one[1]]
    above = [one for one in bounds.get(term, ()) if not one[1]]
    for low, _, least in below:
        for high, _, most in above:
            yield t.And((low, high)), max(abs(least), abs(most))


def _bound_lemmas(parts: Sequence[t.Term]) -> Iterator[t.Term]:
    """Yield `x <= abs(x)` and `-x <= abs(x)`, and `a <= max(a, b)`, `min(a, b) <= a` and so on."""
    for one in dict.fromkeys(one for one in parts if isinstance(one, t.Absolute | t.Extremum)):
        match one:
            case t.Absolute(operand=operand):
                yield t.Compare("<=", operand, one)
                yield t.Compare("<=", t.Multiply(number(Fraction(-1)), operand), one)
            case t.Extremum(kind="max", left=left, right=right):
                yield from (t.Compare("<=", left, one), t.Compare("<=", right, one))
            case t.Extremum(left=left, right=right):
                yield from (t.Compare("<=", one, left), t.Compare("<=", one, right))


def _count_lemmas(required: Sequence[t.Term], parts: Sequence[t.Term], bounds: _Bounds) -> Iterator[t.Term]:
    """Yield for each counted comparison `x >= c` what it says of x beside each bound of x.

    Where `x >= k` is required, `x - k >= (c - k) * counted`; where `x <= k` is, `x - c <= (k - c) * counted`.
    And likewise for `<=`. A condition that is required to equal a comparison counts as that comparison.
    """
    equal = [one for one in required if isinstance(one, t.Compare) and one.op == "=="]
    for counted in dict.fromkeys(one for one in parts if isinstance(one, t.Conditional) and _counts(one)):
        meanings: list[tuple[t.Term, t.Term]] = [(counted.condition, t.TRUE)]
        for one in equal:
            meanings += [(one.right, one)] if one.left == counted.condition else []
            meanings += [(one.left, one)] if one.right == counted.condition else []
        for meaning, premise in meanings:
            if (bound := _bound(meaning)) is None:
                continue
            bounded, is_lower, limit = bound
            for condition, is_lower_too, least in bounds.get(bounded, ()):
                if is_lower is is_lower_too and (least <= limit if is_lower else limit <= least):
                    sign = Fraction(1 if is_lower else -1)
                    beyond = t.Multiply(number(sign), t.Add(bounded, number(-least)))
                    share = t.Multiply(number(abs(limit - least)), counted)
                    conclusion = t.Compare("<=", share, beyond)
                    yield t.Implies(t.And((premise, condition)), conclusion)
                elif is_lower is not is_lower_too and (limit <= least if is_lower else least <= limit):
                    sign = Fraction(1 if is_lower else -1)
                    beyond = t.Multiply(number(sign), t.Add(bounded, number(-limit)))
                    share = t.Multiply(number(abs(least - limit)), counted)
                    yield t.Implies(t.And((premise, condition)), t.Compare("<=", beyond, share))


def _conjuncts(term: t.Term) -> Iterator[t.Term]:
    if isinstance(term, t.And):
        for one in term.operands:
            yield from _conjuncts(one)
    else:
        yield term


def _bound(term: t.Term) -> tuple[t.Term, bool, Fraction] | None:
    """Return what a comparison with a number bounds, whether from below, and the number."""
    if not isinstance(term, t.Compare) or term.op == "==":
        return None
    match term.left, term.right:
        case t.Literal(value=Fraction() as limit), bounded:
            return bounded, True, limit
        case bounded, t.Literal(value=Fraction() as limit):
            return bounded, False, limit
    return None


def _counts(term: t.Conditional) -> bool:
    """Tell whether a conditional is 1 where its condition holds, and 0 elsewhere."""
    match term.then, term.otherwise:
        case t.Literal(value=Fraction() as one), t.Literal(value=Fraction() as zero):
            return one == 1 and zero == 0
    return False
