"""Questions that are decided by bounds alone, exactly and without a solver; most of them are.

A box gives each scalar variable the interval, truth or members that it may still have.  What bounds one
variable, or a sum of several, narrows the box, alternatives are tried one after another, and everything
else narrows the one variable that it compares with something, or is refuted, by interval arithmetic.  So

- UNSAT is answered only if each choice of alternatives leaves some variable without a value, or refutes
  a condition for every value in the box: what was not understood was assumed to hold;
- SAT is answered with a model, which whoever relies on it replays through `semantics.py`;
- anything else is left to the solver.

An answer depends on the question alone.  A differential test compares with Z3.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import islice, product
from math import ceil, floor
from typing import Final, Literal, TypeAlias

from aeros.spec.backends.answers import Answer, Result, Scalar
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower, scalar_variables
from aeros.spec.expr.semantics import holds
from aeros.spec.expr.types import BoolType, EnumType, IntegerType, RealType

MOST_BOXES: Final = 24
"""Boxes looked at for one question; what needs more is what solvers are good at."""

MOST_CORNERS: Final = 16
"""Points of a box that are tried near its corners, where conditions of other kinds fail in its middle."""

MOST_KEPT: Final = 20_000
"""Answers about parts of questions that are remembered; then all are forgotten, which only costs time."""

_ZERO = Fraction(0)


_End: TypeAlias = Literal["low", "high"] | None
"""Where in an interval a number is taken from; None: from its middle."""

_ENDS: Final[tuple[_End, ...]] = ("low", "high")


@dataclass(frozen=True, slots=True)
class Interval:
    """The reals between two ends, either of which may be open, or None for endless."""

    low: Fraction | None = None
    high: Fraction | None = None
    low_open: bool = False
    high_open: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether no real is in it."""
        if self.low is None or self.high is None:
            return False
        return self.low > self.high or (self.low == self.high and (self.low_open or self.high_open))

    def meet(self, other: Interval) -> Interval:
        """What is in both."""
        low, low_open = self.low, self.low_open
        if other.low is not None and (low is None or other.low >= low):
            low, low_open = other.low, other.low_open or (low == other.low and low_open)
        high, high_open = self.high, self.high_open
        if other.high is not None and (high is None or other.high <= high):
            high, high_open = other.high, other.high_open or (high == other.high and high_open)
        return Interval(low, high, low_open, high_open)

    def middle(self) -> Fraction:
        """One of its reals, halfway between the ends where there are two."""
        if self.low is None:
            return Fraction(0) if self.high is None else self.high - 1
        return self.low + 1 if self.high is None else (self.low + self.high) / 2

    def near(self, end: _End) -> Fraction:
        """One of its reals: that end if it is in it, else one an eighth of the way to the other end."""
        if self.low is None or self.high is None or end is None:
            return self.middle()
        if end == "low":
            return self.low + (self.high - self.low) / 8 if self.low_open else self.low
        return self.high - (self.high - self.low) / 8 if self.high_open else self.high

    def whole(self, end: _End = None) -> Fraction:
        """One of its whole numbers; if there is none where a real is taken from, that real."""
        middle = self.near(end)
        near = (Fraction(floor(middle)), Fraction(ceil(middle)))
        return next((one for one in near if not self.meet(Interval(one, one)).is_empty), middle)

    def plus(self, other: Interval) -> Interval:
        """The sums of one of its reals and one of the other's."""
        low = None if self.low is None or other.low is None else self.low + other.low
        high = None if self.high is None or other.high is None else self.high + other.high
        return Interval(low, high, self.low_open or other.low_open, self.high_open or other.high_open)

    def minus(self, other: Interval) -> Interval:
        """The differences of one of its reals and one of the other's."""
        low = None if self.low is None or other.high is None else self.low - other.high
        high = None if self.high is None or other.low is None else self.high - other.low
        return Interval(low, high, self.low_open or other.high_open, self.high_open or other.low_open)

    def times(self, factor: Fraction) -> Interval:
        """Each of its reals times `factor`, which is not 0."""
        if factor == 1:  # as most are, and fractions are slow
            return self
        low = None if self.low is None else self.low * factor
        high = None if self.high is None else self.high * factor
        if factor > 0:
            return Interval(low, high, self.low_open, self.high_open)
        return Interval(high, low, self.high_open, self.low_open)


Sum: TypeAlias = tuple[tuple[str, Fraction], ...]
"""Two or more scalar variables by name, each with a factor, the first of which is 1."""

_Range: TypeAlias = tuple[Fraction, Fraction]

Values: TypeAlias = Interval | frozenset[bool] | frozenset[str]
Box: TypeAlias = dict[str | Sum, Values]


@dataclass(frozen=True, slots=True)
class Within:
    """A condition on one scalar variable, or on one sum of several: that its value is one of these."""

    of: str | Sum
    values: Values


@dataclass(frozen=True, slots=True)
class Other:
    """A condition of any other kind: that the term is, or is not, true."""

    term: t.Term
    is_true: bool


@dataclass(frozen=True, slots=True)
class Every:
    """All of these hold."""

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class Some:
    """One of these holds."""

    parts: tuple[Formula, ...]


Formula: TypeAlias = Within | Other | Every | Some
_Status: TypeAlias = bool | None
"""Whether a formula holds in all of a box (True), in none of it (False), or neither is known."""


@dataclass(frozen=True, slots=True)
class _Part:
    """One of the conditions that a question is the conjunction of; equal ones have one number."""

    number: int
    formula: Formula
    names: frozenset[str]


class Boxes:
    """Decides questions part by part: conditions that share no variable have nothing to do with each other.

    Remembers how terms read and how parts were decided, as most questions share most of their parts.
    """

    def __init__(self) -> None:
        self._read: dict[tuple[int, bool], tuple[t.Term, Formula]] = {}  # by identity: terms are large
        self._parts: dict[tuple[int, bool], tuple[t.Term, tuple[_Part, ...]]] = {}
        self._numbers: dict[Formula, int] = {}
        self._ranges: dict[int, tuple[_Range | None, int]] = {}
        self._numbers_of_ranges: dict[_Range | None, int] = {}
        self._decided: dict[object, Answer | None] = {}

    def decide(
        self,
        variables: Sequence[t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
        terms: Sequence[t.Term],
    ) -> Answer | None:
        """Whether all `terms` can hold together, as `Oracle.ask` has it; None where bounds do not tell."""
        if len(self._decided) > MOST_KEPT:
            for kept in (
                self._read,
                self._parts,
                self._numbers,
                self._ranges,
                self._numbers_of_ranges,
                self._decided,
            ):
                kept.clear()
        scalars = {scalar.name: scalar for one in variables for scalar in scalar_variables(one)}
        model: dict[str, Scalar] = {}
        is_known = True
        parts = {part.number: part for term in terms for part in self._parts_of(term)}
        for group in _connected(parts.values()):
            answer = self._of_group(group, scalars, ranges)
            if answer is None:
                is_known = False
            elif answer.result is Result.UNSAT:
                return answer
            else:
                model |= answer.model
        rest = {name: _first(one, _values(one, ranges)) for name, one in scalars.items() if name not in model}
        return Answer(Result.SAT, model | rest) if is_known else None

    def _of_group(
        self,
        group: Sequence[_Part],
        scalars: Mapping[str, t.Variable],
        ranges: Mapping[str, tuple[Fraction, Fraction]],
    ) -> Answer | None:
        names = sorted(frozenset[str]().union(*(part.names for part in group)))
        own = [scalars[name] for name in names]
        numbers = [part.number for part in group]
        key = (*numbers, *own, *(self._number_of(ranges.get(name)) for name in names))
        if key not in self._decided:
            box: Box = {one.name: _values(one, ranges) for one in own}
            self._decided[key] = _Search(own).run([part.formula for part in group], box)
        return self._decided[key]

    def _number_of(self, range_: _Range | None) -> int:
        """A number for each range: to hash a fraction takes longer than to find most answers."""
        known = self._ranges.get(id(range_))
        if known is None:
            number = self._numbers_of_ranges.setdefault(range_, len(self._numbers_of_ranges))
            known = self._ranges[id(range_)] = (range_, number)
        return known[1]

    def _parts_of(self, term: t.Term) -> tuple[_Part, ...]:
        is_true = True
        while isinstance(term, t.Not):
            term, is_true = term.operand, not is_true
        key = (id(term), is_true)
        if key not in self._parts:
            conjuncts = _conjuncts(self._formula(term, is_true=is_true))
            parts = tuple(
                _Part(self._numbers.setdefault(one, len(self._numbers)), one, _names(one))
                for one in conjuncts
            )
            self._parts[key] = (term, parts)
        return self._parts[key][1]

    def _formula(self, term: t.Term, *, is_true: bool) -> Formula:
        key = (id(term), is_true)
        if key not in self._read:
            self._read[key] = (term, self._reading(term, is_true=is_true))
        return self._read[key][1]

    def _reading(self, term: t.Term, *, is_true: bool) -> Formula:
        match term:
            case t.Not(operand=operand):
                return self._formula(operand, is_true=not is_true)
            case t.And(operands=operands) | t.Or(operands=operands):
                parts = tuple(self._formula(operand, is_true=is_true) for operand in operands)
                return Every(parts) if isinstance(term, t.And) is is_true else Some(parts)
            case t.Implies(premise=premise, conclusion=conclusion):
                sides = (
                    self._formula(premise, is_true=not is_true),
                    self._formula(conclusion, is_true=is_true),
                )
                return Some(sides) if is_true else Every(sides)
            case _:
                return _scalar_formula(lower(term), is_true=is_true)


def _conjuncts(formula: Formula) -> list[Formula]:
    return (
        [one for part in formula.parts for one in _conjuncts(part)]
        if isinstance(formula, Every)
        else [formula]
    )


def _names(formula: Formula) -> frozenset[str]:
    match formula:
        case Within(of=of):
            return frozenset((of,)) if isinstance(of, str) else frozenset(name for name, _ in of)
        case Other(term=term):
            return frozenset(t.variables_of(term))
        case Every(parts=parts) | Some(parts=parts):
            return frozenset[str]().union(*map(_names, parts))


def _connected(parts: Iterable[_Part]) -> list[list[_Part]]:
    """The parts in groups, so that those which share a variable, also by way of others, are together."""
    groups: list[tuple[frozenset[str], list[_Part]]] = []
    for part in parts:
        apart, names, joined = [], part.names, []
        for group in groups:
            if group[0].isdisjoint(part.names):
                apart.append(group)
            else:
                names |= group[0]
                joined += group[1]
        groups = [*apart, (names, [*joined, part])]
    return [group for _, group in groups]


def _values(scalar: t.Variable, ranges: Mapping[str, tuple[Fraction, Fraction]]) -> Values:
    match scalar.type:
        case BoolType():
            return frozenset((False, True))
        case EnumType(members=members):
            return frozenset(members)
        case _:
            return Interval(*ranges.get(scalar.name, (None, None)))


def _scalar_formula(term: t.Term, *, is_true: bool) -> Formula:
    """As `Boxes._formula`, of the scalar core."""
    match term:
        case t.Literal(value=value):
            return Every(()) if value is is_true else Some(())
        case t.Variable(name=name):
            return Within(name, frozenset((is_true,)))
        case t.Not(operand=operand):
            return _scalar_formula(operand, is_true=not is_true)
        case t.And(operands=operands) | t.Or(operands=operands):
            parts = tuple(_scalar_formula(operand, is_true=is_true) for operand in operands)
            return Every(parts) if isinstance(term, t.And) is is_true else Some(parts)
        case t.Compare():
            return _comparison(term, is_true=is_true)
        case _:
            return Other(term, is_true)


def _comparison(term: t.Compare, *, is_true: bool) -> Formula:
    match term.left, term.right:
        case (t.Variable(name=name, type=EnumType(members=members)), t.Literal(value=value)) | (
            t.Literal(value=value),
            t.Variable(name=name, type=EnumType(members=members)),
        ):
            return Within(name, frozenset(one for one in members if (one == value) is is_true))
        case t.Absolute(operand=inner), t.Literal(value=Fraction() as bound) if term.op != "==":
            opposite = t.Literal(-bound, term.right.type)
            sides = t.Compare(term.op, inner, term.right), t.Compare(term.op, opposite, inner)
            parts = tuple(_comparison(side, is_true=is_true) for side in sides)
            return Every(parts) if is_true else Some(parts)
        case t.Literal(value=Fraction() as bound), t.Absolute(operand=inner) if term.op != "==":
            opposite = t.Literal(-bound, term.left.type)
            sides = t.Compare(term.op, term.left, inner), t.Compare(term.op, inner, opposite)
            parts = tuple(_comparison(side, is_true=is_true) for side in sides)
            return Some(parts) if is_true else Every(parts)
    left, right = _linear(term.left), _linear(term.right)
    if left is None or right is None:
        return Other(term, is_true)
    if term.op != "==":
        # not (left < right) is right <= left
        is_below = (term.op == "<") is is_true
        return _at_most(left, right, is_below) if is_true else _at_most(right, left, is_below)
    if is_true:
        return Every((_at_most(left, right, is_below=False), _at_most(right, left, is_below=False)))
    return Some((_at_most(left, right, is_below=True), _at_most(right, left, is_below=True)))


def _at_most(left: _Sum, right: _Sum, is_below: bool) -> Formula:
    """That `left` is at most `right`, or below it."""
    slopes = {name: left[0].get(name, _ZERO) - right[0].get(name, _ZERO) for name in left[0] | right[0]}
    factors = tuple((name, slope) for name, slope in sorted(slopes.items()) if slope)
    most = right[1] - left[1]
    if not factors:
        return Every(()) if most > 0 or (most == 0 and not is_below) else Some(())
    first = factors[0][1]
    values = Interval(high=most, high_open=is_below).times(1 / first)
    if len(factors) == 1:
        return Within(factors[0][0], values)
    return Within(tuple((name, slope / first) for name, slope in factors), values)


_Sum: TypeAlias = tuple[dict[str, Fraction], Fraction]


def _linear(term: t.Term) -> _Sum | None:
    """Factors by variable, and the constant, of a real term that is linear as it is written."""
    match term:
        case t.Literal(value=Fraction() as value):
            return {}, value
        case t.Variable(name=name, type=RealType()):
            return {name: Fraction(1)}, Fraction(0)
        case t.Add():
            left, right = _linear(term.left), _linear(term.right)
            if left is None or right is None:
                return None
            slopes = dict(left[0])
            for name, slope in right[0].items():
                slopes[name] = slopes.get(name, Fraction(0)) + slope
            return slopes, left[1] + right[1]
        case t.Multiply():
            left, right = _linear(term.left), _linear(term.right)
            if left is None or right is None or (left[0] and right[0]):
                return None
            (slopes, constant), (_, factor) = (left, right) if left[0] else (right, left)
            return {name: slope * factor for name, slope in slopes.items()}, constant * factor
        case _:
            return None


@dataclass(slots=True)
class _Open:
    """A box, and what is not settled of it: conditions of other kinds, and alternatives."""

    box: Box
    others: list[Other]
    choices: list[Some]

    def copy(self) -> _Open:
        return _Open(dict(self.box), list(self.others), list(self.choices))


class _Search:
    """One question: boxes are narrowed and divided until a model is found or none can be."""

    def __init__(self, scalars: Sequence[t.Variable]) -> None:
        self._scalars = scalars
        self._left = MOST_BOXES

    def run(self, formulas: list[Formula], box: Box) -> Answer | None:
        return self._search(formulas, _Open(box, [], []))

    def _search(self, pending: list[Formula], open_: _Open) -> Answer | None:
        """As `Boxes.decide`, of everything given; the arguments are used up."""
        self._left -= 1
        if self._left < 0:
            return None
        while pending or open_.choices:
            if not _narrowed(open_, pending):
                return Answer(Result.UNSAT, {})
            pending = _forced(open_)
            if not pending and open_.choices:
                return self._alternatives(open_)
        return self._model(open_)

    def _alternatives(self, open_: _Open) -> Answer | None:
        first = min(open_.choices, key=lambda choice: len(choice.parts))
        open_.choices.remove(first)
        is_known = True
        for part in first.parts:
            answer = self._search([part], open_.copy())
            if answer is not None and answer.result is Result.SAT:
                return answer
            is_known &= answer is not None
        return Answer(Result.UNSAT, {}) if is_known else None

    def _model(self, open_: _Open) -> Answer | None:
        """A point of the box at which what is not settled of it holds too, if one is found."""
        found = self._point(open_.box, {})
        if found is None or _replays(open_.others, found):
            return None if found is None else Answer(Result.SAT, found)
        spoken = sorted(frozenset[str]().union(*(t.variables_of(other.term) for other in open_.others)))
        real = [name for name in spoken if isinstance(open_.box[name], Interval)]
        for ends in islice(product(_ENDS, repeat=len(real)), MOST_CORNERS):
            found = self._point(open_.box, dict(zip(real, ends, strict=True)))
            if found is not None and _replays(open_.others, found):
                return Answer(Result.SAT, found)
        return None

    def _point(self, within: Box, ends: Mapping[str, _End]) -> dict[str, Scalar] | None:
        """A point of the box: of each variable in turn a value that sums leave it, from its middle or end."""
        box = dict(within)
        model: dict[str, Scalar] = {}
        summed = {name for of in box if isinstance(of, tuple) for name, _ in of}
        for scalar in sorted(self._scalars, key=lambda scalar: scalar.name not in summed):
            name = scalar.name
            value = model[name] = _first(scalar, box[name], ends.get(name))
            if isinstance(value, Fraction):
                if isinstance(scalar.type, IntegerType) and value.denominator != 1:
                    return None
                box[name] = Interval(value, value)
                if name in summed and not _propagated(box):
                    return None
        return model


def _replays(others: Iterable[Other], model: Mapping[str, Scalar]) -> bool:
    return all(holds(other.term, model) is other.is_true for other in others)


def _first(scalar: t.Variable, values: Values, end: _End = None) -> Scalar:
    if isinstance(values, Interval):
        return values.whole(end) if isinstance(scalar.type, IntegerType) else values.near(end)
    if isinstance(scalar.type, EnumType):
        return next(one for one in scalar.type.members if one in values)
    return False not in values


def _narrowed(open_: _Open, pending: list[Formula]) -> bool:
    """Take in what is pending; whether it leaves each variable a value, and refutes nothing else."""
    box = open_.box
    while pending:
        match pending.pop():
            case Within(of=of, values=values):
                box[of] = _meet(_known(of, box), values)
                if _is_empty(box[of]):
                    return False
            case Every(parts=parts):
                pending.extend(parts)
            case Some() as choice:
                open_.choices.append(choice)
            case Other() as other:
                open_.others.append(other)
    if not _propagated(box) or not all(_bounded(other, box) for other in open_.others):
        return False
    return not any(_status(other, box) is False for other in open_.others)


def _bounded(other: Other, box: Box) -> bool:
    """Narrow the variable that `other` compares with something bounded; whether values are left."""
    match other.term:
        case t.Compare(op="<" | "<=" as op, left=left, right=t.Variable(name=name) as right):
            is_above, bounds = other.is_true, _bounds(left, box)
        case t.Compare(op="<" | "<=" as op, left=t.Variable(name=name) as right, right=left):
            is_above, bounds = not other.is_true, _bounds(left, box)
        case _:
            return True
    if bounds is None or not _is_real(right):
        return True
    # not (left <= right) is right < left
    is_open = (op == "<") is other.is_true
    values = (
        Interval(low=bounds[0], low_open=is_open) if is_above else Interval(high=bounds[1], high_open=is_open)
    )
    box[name] = _meet(box[name], values)
    return not _is_empty(box[name])


def _propagated(box: Box) -> bool:
    """Narrow each variable of a sum to what the others leave it; whether values are left."""
    sums = [of for of in box if isinstance(of, tuple)]
    occurs = Counter(name for of in sums for name, _ in of)
    for _ in sums:  # so often at most: what one sum leaves of a variable may narrow those of another
        again = False
        for of in sums:
            total = box[of] = _interval(box[of]).meet(_total(of, box))
            for place, (name, factor) in enumerate(of):
                rest, before = _total((*of[:place], *of[place + 1 :]), box), box[name]
                box[name] = _meet(before, total.minus(rest).times(factor if factor == 1 else 1 / factor))
                if _is_empty(box[name]):
                    return False
                again |= occurs[name] > 1 and box[name] != before
        if not again:
            break
    return True


def _forced(open_: _Open) -> list[Formula]:
    """What the box leaves no choice about; the choices that stay open lose what it excludes."""
    choices, open_.choices = open_.choices, []
    forced: list[Formula] = []
    for choice in choices:
        parts = [(part, _status(part, open_.box)) for part in choice.parts]
        if any(status is True for _, status in parts):
            continue
        possible = tuple(part for part, status in parts if status is not False)
        if len(possible) == 1:
            forced.append(possible[0])
        else:
            open_.choices.append(Some(possible))
    return forced


def _meet(one: Values, other: Values) -> Values:
    if isinstance(one, Interval):
        return one.meet(_interval(other))
    return one & other  # type: ignore[operator]


def _interval(values: Values) -> Interval:
    assert isinstance(values, Interval)  # noqa: S101  terms are well typed
    return values


def _known(of: str | Sum, box: Box) -> Values:
    """The values that a variable or a sum may have, as far as `box` tells."""
    if isinstance(of, str):
        return box[of]
    kept = box.get(of)
    return _total(of, box) if kept is None else kept


def _total(of: Sum, box: Box) -> Interval:
    return reduce(Interval.plus, (_interval(box[name]).times(factor) for name, factor in of))


def _is_empty(values: Values) -> bool:
    return values.is_empty if isinstance(values, Interval) else not values


def _status(formula: Formula, box: Box) -> _Status:
    match formula:
        case Within(of=of, values=values):
            known = _known(of, box)
            both = _meet(known, values)
            return False if _is_empty(both) else True if both == known else None
        case Every(parts=parts):
            return _joined(parts, box, absorbing=False)
        case Some(parts=parts):
            return _joined(parts, box, absorbing=True)
        case Other(term=t.Compare(op=op, left=left, right=right), is_true=is_true) if _is_real(left):
            found = _compared(op, _bounds(left, box), _bounds(right, box))
            return None if found is None else found is is_true
        case _:
            return None


def _joined(parts: Sequence[Formula], box: Box, *, absorbing: bool) -> _Status:
    statuses = [_status(part, box) for part in parts]
    if absorbing in statuses:
        return absorbing
    return None if None in statuses else not absorbing


def _is_real(term: t.Term) -> bool:
    match term:
        case t.Literal(value=value):
            return isinstance(value, Fraction)
        case t.Variable(type=type_):
            return isinstance(type_, RealType)
        case t.Conditional(then=then):
            return _is_real(then)
        case _:
            return isinstance(term, t.Add | t.Multiply | t.Extremum | t.Absolute)


_Bounds: TypeAlias = tuple[Fraction, Fraction] | None
"""Two reals between which, both included, a term's value lies; None where no such two are known."""


def _compared(op: Literal["<", "<=", "=="], left: _Bounds, right: _Bounds) -> _Status:
    if left is None or right is None:
        return None
    if op == "==":
        apart = left[1] < right[0] or right[1] < left[0]
        return False if apart else True if left[0] == left[1] == right[0] == right[1] else None
    if op == "<":
        return True if left[1] < right[0] else False if left[0] >= right[1] else None
    return True if left[1] <= right[0] else False if left[0] > right[1] else None


def _bounds(term: t.Term, box: Box) -> _Bounds:
    match term:
        case t.Literal(value=Fraction() as value):
            return value, value
        case t.Variable(name=name):
            values = box[name]
            known = isinstance(values, Interval) and values.low is not None and values.high is not None
            return (values.low, values.high) if known else None  # type: ignore[union-attr, return-value]
        case t.Absolute(operand=operand):
            inner = _bounds(operand, box)
            if inner is None:
                return None
            ends = sorted(map(abs, inner))
            return (ends[0] if inner[0] >= 0 or inner[1] <= 0 else Fraction(0)), ends[1]
        case t.Add() | t.Multiply() | t.Extremum():
            left, right = _bounds(term.left, box), _bounds(term.right, box)
            return None if left is None or right is None else _combined(term, left, right)
        case t.Conditional(then=then, otherwise=otherwise):
            one, other = _bounds(then, box), _bounds(otherwise, box)
            return None if one is None or other is None else (min(one[0], other[0]), max(one[1], other[1]))
        case _:
            return None


def _combined(
    term: t.Add | t.Multiply | t.Extremum, left: tuple[Fraction, Fraction], right: tuple[Fraction, Fraction]
) -> _Bounds:
    match term:
        case t.Add():
            return left[0] + right[0], left[1] + right[1]
        case t.Multiply():
            if term.left == term.right:
                squares = sorted((left[0] ** 2, left[1] ** 2))
                return (Fraction(0) if left[0] < 0 < left[1] else squares[0]), squares[1]
            ends = [a * b for a in left for b in right]
            return min(ends), max(ends)
        case t.Extremum(kind=kind):
            choose = min if kind == "min" else max
            return choose(left[0], right[0]), choose(left[1], right[1])
