"""Formulas over the values of variables and of linear sums. Conditions of other kinds stay terms."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Final, TypeAlias

from aeros.spec.backends.interval.box import LinearSum, ValueSet
from aeros.spec.backends.interval.interval import Interval
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import EnumType, RealType

_ZERO: Final = Fraction(0)


@dataclass(frozen=True, slots=True)
class ValueConstraint:
    """Condition that a variable or a sum has one of some values.

    Attributes:
        subject: name of a scalar variable, or a linear sum of variables.
        values: the values that meet the condition, SI.
    """

    subject: str | LinearSum
    values: ValueSet


@dataclass(frozen=True, slots=True)
class OpaqueLiteral:
    """Condition of any other kind, which is not analysed further.

    Attributes:
        term: the condition.
        is_true: True if it must be true, False if it must be false.
    """

    term: t.Term
    is_true: bool


@dataclass(frozen=True, slots=True)
class Conjunction:
    """Formula that holds where all parts hold.

    Attributes:
        parts: its parts.
    """

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class Disjunction:
    """Formula that holds where some part holds.

    Attributes:
        parts: its parts.
    """

    parts: tuple[Formula, ...]


Formula: TypeAlias = ValueConstraint | OpaqueLiteral | Conjunction | Disjunction


def conjuncts_of(formula: Formula) -> list[Formula]:
    """Split a formula at its conjunctions.

    Args:
        formula: any formula.

    Returns:
        Formulas that hold together exactly where `formula` holds.
    """
    return (
        [conjunct for part in formula.parts for conjunct in conjuncts_of(part)]
        if isinstance(formula, Conjunction)
        else [formula]
    )


def names_of(formula: Formula) -> frozenset[str]:
    """Collect the scalar variables of a formula.

    Args:
        formula: any formula.

    Returns:
        Their names.
    """
    match formula:
        case ValueConstraint(subject=of):
            return frozenset((of,)) if isinstance(of, str) else frozenset(name for name, _ in of)
        case OpaqueLiteral(term=term):
            return frozenset(t.variables_of(term))
        case Conjunction(parts=parts) | Disjunction(parts=parts):
            return frozenset[str]().union(*map(names_of, parts))


def to_formula(term: t.Term, *, is_true: bool) -> Formula:
    """Translate a condition of the scalar core to a formula.

    Args:
        term: boolean term of the scalar core.
        is_true: True for the formula that `term` is true, False for its negation.

    Returns:
        The formula.
    """
    match term:
        case t.Literal(value=value):
            return Conjunction(()) if value is is_true else Disjunction(())
        case t.Variable(name=name):
            return ValueConstraint(name, frozenset((is_true,)))
        case t.Not(operand=operand):
            return to_formula(operand, is_true=not is_true)
        case t.And(operands=operands) | t.Or(operands=operands):
            parts = tuple(to_formula(operand, is_true=is_true) for operand in operands)
            return Conjunction(parts) if isinstance(term, t.And) is is_true else Disjunction(parts)
        case t.Compare():
            return _comparison(term, is_true=is_true)
        case _:
            return OpaqueLiteral(term, is_true)


def _comparison(term: t.Compare, *, is_true: bool) -> Formula:
    match term.left, term.right:
        case (t.Variable(name=name, type=EnumType(members=members)), t.Literal(value=value)) | (
            t.Literal(value=value),
            t.Variable(name=name, type=EnumType(members=members)),
        ):
            return ValueConstraint(
                name, frozenset(member for member in members if (member == value) is is_true)
            )
        case t.Absolute(operand=inner), t.Literal(value=Fraction() as bound) if term.op != "==":
            opposite = t.Literal(-bound, term.right.type)
            sides = t.Compare(term.op, inner, term.right), t.Compare(term.op, opposite, inner)
            parts = tuple(_comparison(side, is_true=is_true) for side in sides)
            return Conjunction(parts) if is_true else Disjunction(parts)
        case t.Literal(value=Fraction() as bound), t.Absolute(operand=inner) if term.op != "==":
            opposite = t.Literal(-bound, term.left.type)
            sides = t.Compare(term.op, term.left, inner), t.Compare(term.op, inner, opposite)
            parts = tuple(_comparison(side, is_true=is_true) for side in sides)
            return Disjunction(parts) if is_true else Conjunction(parts)
    left, right = _linear(term.left), _linear(term.right)
    if left is None or right is None:
        return OpaqueLiteral(term, is_true)
    if term.op != "==":
        # not (left < right) is right <= left
        is_below = (term.op == "<") is is_true
        return (
            _less_equal_constraint(left, right, is_below)
            if is_true
            else _less_equal_constraint(right, left, is_below)
        )
    if is_true:
        return Conjunction(
            (
                _less_equal_constraint(left, right, is_below=False),
                _less_equal_constraint(right, left, is_below=False),
            )
        )
    return Disjunction(
        (
            _less_equal_constraint(left, right, is_below=True),
            _less_equal_constraint(right, left, is_below=True),
        )
    )


def _less_equal_constraint(left: _Linear, right: _Linear, is_below: bool) -> Formula:
    """Constrain `left` to be at most `right`, or below it if `is_below`."""
    slopes = {name: left[0].get(name, _ZERO) - right[0].get(name, _ZERO) for name in left[0] | right[0]}
    factors = tuple((name, slope) for name, slope in sorted(slopes.items()) if slope)
    most = right[1] - left[1]
    if not factors:
        return Conjunction(()) if most > 0 or (most == 0 and not is_below) else Disjunction(())
    first = factors[0][1]
    values = Interval(high=most, high_open=is_below).scale(1 / first)
    if len(factors) == 1:
        return ValueConstraint(factors[0][0], values)
    return ValueConstraint(tuple((name, slope / first) for name, slope in factors), values)


_Linear: TypeAlias = tuple[dict[str, Fraction], Fraction]


def _linear(term: t.Term) -> _Linear | None:
    """Return the coefficients by variable and the constant of a real term that is written as a linear one."""
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
