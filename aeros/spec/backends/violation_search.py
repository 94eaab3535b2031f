"""Search for a point at which a question's conditions hold, by steps that mend what does not hold.

What a comparison is off by is its residual. Of an `or` that does not hold, the alternative counts whose
squared residuals are least. Each step is that of Gauss and Newton: the shortest one that makes all residuals
0, if they were linear (Nocedal and Wright, Numerical Optimization, 2006, section 10.3). Starts are drawn
from a fixed seed. The semantics of the language judges what is found.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from heapq import nlargest
from itertools import cycle, product
from typing import Final, NamedTuple

from aeros.spec.backends.solver_results import Question, ScalarValue
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.semantics import is_true
from aeros.spec.expr.types import BOOL, EnumType, IntegerType

MAX_PARTS: Final = 5_000  # of the conditions of a question that is searched
_WORK: Final = 200_000  # parts and variables that are computed in all: half a second
_EVALUATIONS: Final = 3_000  # of the conditions
_STEPS: Final = 40  # from each start
_SPREADS: Final = (1.0, 0.3, 0.03, 10.0)  # of starts, as shares of the question's largest constant
_SLACKS: Final = (1e-2, 1e-4, 1e-8)  # by which comparisons should hold, so that rounding does not break them
_DIGITS: Final = (2, 3, 4, 6, 8, 10)  # after the point, to which the numbers of a point are rounded
_GAIN: Final = 0.999  # of the cost, that a step may leave
_SHARES: Final = (1.0, 0.3, 0.05)  # of a step that are tried
_DAMPINGS: Final = (1e-9, 1e-2)  # of the equations of a step, as shares of their largest coefficient
_ROWS: Final = 45  # residuals that one step mends, the largest
_CLOSE: Final = 1e-20  # cost at which a point is judged
_MOST: Final = 1e100  # of the largest constant, for starts
_TINY: Final = 1e-300  # for a coefficient of the equations of a step that is 0

_Point = dict[str, float]
"""Value of each scalar variable; 1 is true, 0 is false."""


class _Number(NamedTuple):
    """A value, and its derivatives by the variables that it depends on."""

    value: float
    slopes: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class _Repair:
    """Changes that make a condition hold: numbers that should become 0, values of truths, and the cost."""

    residuals: tuple[_Number, ...] = ()
    truths: tuple[tuple[str, float], ...] = ()
    cost: float = 0.0


_NOTHING: Final = _Repair()
_IMPOSSIBLE: Final = _Repair(cost=math.inf)


class SearchResult(NamedTuple):
    """Result of a search.

    Attributes:
        found: value of each scalar variable at a point where all conditions hold; None if none was found.
        nearest: the same where the conditions are off by least, in SI, truths as 1 or 0; empty if there was
            no search, because a variable is a member of an enum or the conditions are too long.
    """

    found: Mapping[str, ScalarValue] | None
    nearest: Mapping[str, float]


def search(question: Question) -> SearchResult:
    """Search for a point at which all conditions of a question hold.

    Args:
        question: the question.

    Returns:
        What was found.
    """
    scalars = [part for one in question.variables for part in scalar_variables(one)]
    condition = lower(t.And(tuple(question.terms)))
    nearest: _Point = {}
    least = math.inf
    for point, cost in _ends(condition, scalars, question.ranges):
        if not all(map(math.isfinite, point.values())):
            continue
        for digits in _DIGITS if cost <= _CLOSE else ():
            exact = {one.name: _exact(one, point[one.name], digits) for one in scalars}
            if _is_within(exact, question) and is_true(condition, exact):
                return SearchResult(exact, point)
        if cost < least:
            nearest, least = point, cost
    return SearchResult(None, nearest)


def _exact(scalar: t.Variable, value: float, digits: int) -> bool | Fraction:
    if scalar.type == BOOL:
        return value == 1.0
    return (
        Fraction(round(value))
        if isinstance(scalar.type, IntegerType)
        else Fraction(str(round(value, digits)))
    )


def _is_within(point: Mapping[str, bool | Fraction], question: Question) -> bool:
    return all(low <= point[name] <= high for name, (low, high) in question.ranges.items() if name in point)


def _ends(
    condition: t.Term, scalars: Sequence[t.Variable], ranges: Mapping[str, tuple[Fraction, Fraction]]
) -> Iterator[tuple[_Point, float]]:
    """Yield where the steps from each start end, and the cost of what is off there."""
    parts = list(t.walk([condition]))
    has_enums = any(
        isinstance(one, t.Literal | t.Variable) and isinstance(one.type, EnumType) for one in parts
    )
    if len(parts) > MAX_PARTS or has_enums:
        return
    draw = random.Random(0)  # noqa: S311 — no secret
    largest = max((abs(_double(one)) for one in t.constants_in([condition])), default=0.0) or 1.0
    largest = min(largest, _MOST)
    limits = {name: (_double(low), _double(high)) for name, (low, high) in ranges.items()}
    left = min(_WORK // (len(parts) + 4 * len(scalars) + 20), _EVALUATIONS)
    for spread, slack in cycle(product(_SPREADS, _SLACKS)):
        start = {
            one.name: float(draw.random() < 0.5)
            if one.type == BOOL
            else largest * draw.uniform(-spread, spread)
            for one in scalars
        }
        search = _Search(condition, limits, slack, left)
        yield search.descend(_clipped(start, limits))
        left = search.left
        if left <= 0:
            return


@dataclass(slots=True)
class _Search:
    """Steps from one start.

    Attributes:
        left: how often the conditions may still be evaluated.
    """

    _condition: t.Term
    _limits: Mapping[str, tuple[float, float]]
    _slack: float
    left: int

    def descend(self, point: _Point) -> tuple[_Point, float]:
        repair = self._evaluate(point)
        for _ in range(_STEPS):
            if repair.cost <= _CLOSE:
                break
            moved = self._better(point, repair)
            if moved is None:
                break
            point, repair = moved
        return point, repair.cost

    def _better(self, point: _Point, repair: _Repair) -> tuple[_Point, _Repair] | None:
        for damping, share in product(_DAMPINGS, _SHARES):
            if self.left <= 0:
                break
            step = _step(repair, damping)
            moved = {name: x + share * step.get(name, 0.0) for name, x in point.items()}
            tried = _clipped(moved | dict(repair.truths), self._limits)
            if (better := self._evaluate(tried)).cost < _GAIN * repair.cost:
                return tried, better
        return None

    def _evaluate(self, point: _Point) -> _Repair:
        self.left -= 1
        return _repair(self._condition, True, point, self._slack)


def _clipped(point: _Point, limits: Mapping[str, tuple[float, float]]) -> _Point:
    return {
        name: min(max(x, limits[name][0]), limits[name][1]) if name in limits else x
        for name, x in point.items()
    }


def _step(repair: _Repair, damping: float) -> dict[str, float]:
    """Compute the shortest change of the variables that makes all residuals 0, if they were linear."""
    rows = nlargest(
        _ROWS, (one for one in repair.residuals if any(one.slopes.values())), key=lambda one: abs(one.value)
    )
    weights = _weights(rows, damping)
    step: dict[str, float] = {}
    for weight, row in zip(weights, rows, strict=True):
        for name, slope in row.slopes.items():
            step[name] = step.get(name, 0.0) - weight * slope
    return step


def _weights(rows: Sequence[_Number], damping: float) -> list[float]:
    """Solve the equations of a step: products of slopes, damped on the diagonal, times weights are values."""
    equations = [[*(_dot(a.slopes, b.slopes) for b in rows), a.value] for a in rows]
    extra = damping * max((one[number] for number, one in enumerate(equations)), default=0.0)
    for number, equation in enumerate(equations):
        equation[number] += extra
    for number, pivot in enumerate(equations):
        pivot[number] = pivot[number] or _TINY  # a product of slopes may be too small for a double
        for other in equations[number + 1 :]:
            factor = other[number] / pivot[number]
            other[number:] = [x - factor * y for x, y in zip(other[number:], pivot[number:], strict=True)]
    weights: list[float] = []
    for number, pivot in reversed(list(enumerate(equations))):
        known = sum(x * y for x, y in zip(pivot[number + 1 : -1], weights, strict=True))
        weights.insert(0, (pivot[-1] - known) / pivot[number])
    return weights


def _dot(a: Mapping[str, float], b: Mapping[str, float]) -> float:
    return sum(x * b[name] for name, x in a.items() if name in b)


def _repair(term: t.Term, wanted: bool, point: _Point, slack: float) -> _Repair:
    match term:
        case t.Literal(value=value):
            return _NOTHING if value is wanted else _IMPOSSIBLE
        case t.Variable(name=name):
            truth = float(wanted)
            return _NOTHING if point[name] == truth else _Repair((), ((name, truth),), slack)
        case t.Not(operand=operand):
            return _repair(operand, not wanted, point, slack)
        case t.And(operands=operands) | t.Or(operands=operands):
            each = [_repair(one, wanted, point, slack) for one in operands]
            return _all_of(each) if isinstance(term, t.And) is wanted else _one_of(each)
        case t.Compare(op="==", left=left, right=right) if _is_condition(left):
            return _one_of(
                _all_of([_repair(left, it, point, slack), _repair(right, it is wanted, point, slack)])
                for it in (True, False)
            )
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            return _one_of(
                _all_of([_repair(condition, it, point, slack), _repair(chosen, wanted, point, slack)])
                for it, chosen in ((True, then), (False, otherwise))
            )
        case t.Compare(op=op, left=left, right=right):
            sign = 1.0 if wanted else -1.0
            off = _added(_scaled(_number(left, point), sign), _scaled(_number(right, point), -sign))
            if op == "==":
                apart = 0.0 if wanted else slack
                holds = (off.value == 0.0) is wanted
            else:
                apart, holds = slack, off.value <= -slack
            residual = off.value + apart
            # A product of doubles that is too large is infinite; a power would raise an error.
            return _NOTHING if holds else _Repair((_Number(residual, off.slopes),), (), residual * residual)
        case _:
            raise AssertionError(f"not a condition: {term}")


def _all_of(each: Sequence[_Repair]) -> _Repair:
    return _Repair(
        tuple(one for repair in each for one in repair.residuals),
        tuple(one for repair in each for one in repair.truths),
        sum(repair.cost for repair in each),
    )


def _one_of(each: Iterable[_Repair]) -> _Repair:
    return min(each, key=lambda one: one.cost, default=_IMPOSSIBLE)


def _number(term: t.Term, point: _Point) -> _Number:
    match term:
        case t.Literal(value=Fraction() as value):
            return _Number(_double(value), {})
        case t.Variable(name=name):
            return _Number(point[name], {name: 1.0})
        case t.Add(left=left, right=right):
            return _added(_number(left, point), _number(right, point))
        case t.Multiply(left=left, right=right):
            a, b = _number(left, point), _number(right, point)
            slopes = _added(_scaled(a, b.value), _scaled(b, a.value)).slopes
            return _Number(a.value * b.value, slopes)
        case t.Absolute(operand=operand):
            inside = _number(operand, point)
            return _scaled(inside, -1.0) if inside.value < 0.0 else inside
        case t.Extremum(kind=kind, left=left, right=right):
            a, b = _number(left, point), _number(right, point)
            return a if (a.value <= b.value) is (kind == "min") else b
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            holds = _repair(condition, True, point, 0.0).cost == 0.0
            return _number(then if holds else otherwise, point)
        case _:
            raise AssertionError(f"not a number: {term}")


def _double(value: Fraction) -> float:
    """Return the double next to a number; infinity beyond the largest."""
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def _scaled(number: _Number, factor: float) -> _Number:
    return _Number(number.value * factor, {name: x * factor for name, x in number.slopes.items()})


def _added(a: _Number, b: _Number) -> _Number:
    slopes = dict(a.slopes)
    for name, slope in b.slopes.items():
        slopes[name] = slopes.get(name, 0.0) + slope
    return _Number(a.value + b.value, slopes)


def _is_condition(term: t.Term) -> bool:
    match term:
        case t.Literal(type=type_) | t.Variable(type=type_):
            return type_ == BOOL
        case t.Conditional(then=then):
            return _is_condition(then)
        case _:
            return isinstance(term, t.Not | t.And | t.Or | t.Compare)
