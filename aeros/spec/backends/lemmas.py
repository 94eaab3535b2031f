"""Conditions that are always true, which help a solver where its own search ends in its budget.

Asserted beside a question they change no answer. They relate what a solver takes for unrelated: a product of
two different expressions and their squares, a count and the numbers that are compared in it, or an absolute
value and its operand.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import chain, combinations, islice
from math import isqrt
from types import MappingProxyType
from typing import Final

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER

MAX_LEMMAS: Final = 4000
_MAX_RATIO: Final = 100  # greatest numerator and denominator of a ratio of constants

_Linear = Mapping[str, Fraction]
"""Coefficient of each scalar variable, and of `` for the constant."""

Ranges = Mapping[str, tuple[Fraction, Fraction]]
"""Lowest and highest value of scalar variables, by name."""

_Bounds = Mapping[t.Term, Sequence[tuple[t.Term, bool, Fraction]]]
"""By expression, conditions that bound it: each with True for a bound from below, and the bound."""


def lemmas_for(terms: Sequence[t.Term], ranges: Ranges = MappingProxyType({})) -> list[t.Term]:
    """Write lemmas about the products and counts of a question.

    Args:
        terms: boolean terms of a question, without past-time operators.
        ranges: ranges of its scalar variables; a lemma that uses one has it as its premise.

    Returns:
        Conditions that are true at every point, at most `MAX_LEMMAS`; none if nothing in the question calls
        for one. Their literals are bare numbers, whatever the dimensions are.
    """
    parts = [one for term in terms for one in t.walk([lower(term)])]
    return list(islice(chain(_bound_lemmas(parts), _relating_lemmas(terms, parts, ranges)), MAX_LEMMAS))


def relating_lemmas(terms: Sequence[t.Term], ranges: Ranges = MappingProxyType({})) -> list[t.Term]:
    """Write those lemmas that relate products or counts, without which a solver may search for minutes.

    Args:
        terms: boolean terms of a question, without past-time operators.
        ranges: as for `lemmas_for`.

    Returns:
        As `lemmas_for`, but none for an absolute value or an extremum alone.
    """
    parts = [one for term in terms for one in t.walk([lower(term)])]
    return list(islice(_relating_lemmas(terms, parts, ranges), MAX_LEMMAS))


def _relating_lemmas(terms: Sequence[t.Term], parts: Sequence[t.Term], ranges: Ranges) -> Iterator[t.Term]:
    required = [one for term in terms for one in _conjuncts(lower(term))]
    bounds = _bounds_in(required, parts, ranges)
    return chain(
        _count_lemmas(required, parts, bounds), _product_lemmas(parts, bounds), _square_lemmas(parts)
    )


def _bounds_in(required: Sequence[t.Term], parts: Sequence[t.Term], ranges: Ranges) -> _Bounds:
    """Collect the conditions that bound expressions: those that are required, and the ranges of variables."""
    bounds: dict[t.Term, list[tuple[t.Term, bool, Fraction]]] = {}
    for one in required:
        if (bound := _bound(one)) is not None:
            bounded, is_lower, limit = bound
            bounds.setdefault(bounded, []).append((one, is_lower, limit))
    for variable in dict.fromkeys(one for one in parts if isinstance(one, t.Variable) and one.name in ranges):
        low, high = ranges[variable.name]
        bounds.setdefault(variable, []).extend(
            (
                (t.Compare("<=", _number(low), variable), True, low),
                (t.Compare("<=", variable, _number(high)), False, high),
            )
        )
    return bounds


def _product_lemmas(parts: Sequence[t.Term], bounds: _Bounds) -> Iterator[t.Term]:
    """Yield `a * b <= K * abs(a)` and `-(a * b) <= K * abs(a)` where `abs(a)` occurs and `abs(b) <= K`."""
    present = {one for one in parts if isinstance(one, t.Absolute)}
    for one in dict.fromkeys(one for one in parts if isinstance(one, t.Multiply)):
        for part, other in ((one.left, one.right), (one.right, one.left)):
            size = t.Absolute(part)
            if size not in present or isinstance(other, t.Literal):
                continue
            for premise, limit in _size_bounds(other, bounds):
                most = t.Multiply(_number(limit), size)
                least = t.Multiply(_number(Fraction(-1)), one)
                yield t.Implies(premise, t.And((t.Compare("<=", one, most), t.Compare("<=", least, most))))


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
                yield t.Compare("<=", t.Multiply(_number(Fraction(-1)), operand), one)
            case t.Extremum(kind="max", left=left, right=right):
                yield from (t.Compare("<=", left, one), t.Compare("<=", right, one))
            case t.Extremum(left=left, right=right):
                yield from (t.Compare("<=", one, left), t.Compare("<=", one, right))


def _square_lemmas(parts: Sequence[t.Term]) -> Iterator[t.Term]:
    """Yield `(r * a + b)² >= 0` and `(r * a - b)² >= 0` for pairs of factors and ratios of constants.

    So `2 * a * b <= r * a² + b² / r`. With the right r, sums of these prove the triangle inequality and that
    of Cauchy and Schwarz.
    """
    factors: dict[tuple[tuple[str, Fraction], ...], t.Term] = {}
    for one in parts:
        if isinstance(one, t.Multiply):
            sides = [(side, _linear(side)) for side in (one.left, one.right)]
            if all(linear is not None and any(linear) for _, linear in sides):
                for side, linear in sides:
                    factors.setdefault(tuple(sorted((linear or {}).items())), side)
    ratios = _ratios(parts)
    for ratio in ratios:
        for a, b in combinations(factors.values(), 2):
            for sign in (1, -1):
                form = t.Add(t.Multiply(_number(ratio), a), t.Multiply(_number(Fraction(sign)), b))
                yield t.Compare("<=", _number(Fraction(0)), t.Multiply(form, form))


def _ratios(parts: Sequence[t.Term]) -> list[Fraction]:
    """Return the simple ratios of the question's constants and of their roots, 1 first."""
    sizes = sizes_in(parts)
    found = {a / b for a in sizes for b in sizes} | {Fraction(1)}
    simple = [one for one in found if max(one.numerator, one.denominator) <= _MAX_RATIO]
    return sorted(simple, key=lambda one: (max(one.numerator, one.denominator), one))


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
                    beyond = t.Multiply(_number(sign), t.Add(bounded, _number(-least)))
                    share = t.Multiply(_number(abs(limit - least)), counted)
                    conclusion = t.Compare("<=", share, beyond)
                    yield t.Implies(t.And((premise, condition)), conclusion)
                elif is_lower is not is_lower_too and (limit <= least if is_lower else least <= limit):
                    sign = Fraction(1 if is_lower else -1)
                    beyond = t.Multiply(_number(sign), t.Add(bounded, _number(-limit)))
                    share = t.Multiply(_number(abs(least - limit)), counted)
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


def _linear(term: t.Term) -> _Linear | None:
    """Return the coefficients of a linear expression; None for another."""
    match term:
        case t.Literal(value=Fraction() as value):
            return {"": value}
        case t.Variable(name=name):
            return {name: Fraction(1)}
        case t.Add(left=left, right=right):
            a, b = _linear(left), _linear(right)
            if a is None or b is None:
                return None
            summed = {name: a.get(name, Fraction(0)) + b.get(name, Fraction(0)) for name in (*a, *b)}
            return {name: value for name, value in summed.items() if value}
        case t.Multiply(left=t.Literal(value=Fraction() as factor), right=part):
            linear = _linear(part)
            if linear is None:
                return None
            return {name: factor * value for name, value in linear.items() if factor}
        case t.Multiply(left=part, right=t.Literal(value=Fraction() as factor)):
            return _linear(t.Multiply(_number(factor), part))
    return None


def sizes_in(terms: Iterable[t.Term]) -> set[Fraction]:
    """Collect the absolute values of a question's constants, and those of their roots that are rational.

    Args:
        terms: conditions of the question.

    Returns:
        The sizes, all above 0.
    """
    sizes = {abs(one) for one in t.constants_in(terms) if one}
    return sizes | {root for root in map(rational_root, sizes) if root is not None}


def rational_root(value: Fraction) -> Fraction | None:
    """Return the square root of a number, if it is rational.

    Args:
        value: the number, at least 0.

    Returns:
        The root; None if it is irrational.
    """
    above, below = isqrt(value.numerator), isqrt(value.denominator)
    root = Fraction(above, below)
    return root if root * root == value else None


def _number(value: Fraction) -> t.Literal:
    return t.Literal(value, RealType(NUMBER))
