"""What was measured when a rule did not hold: each quantity, its value, and the bound that it broke."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from math import sqrt
from typing import Any, Final, NamedTuple, cast

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import Environment, evaluate, holds
from aeros.spec.expr.spell import spell
from aeros.spec.expr.types import RealType
from aeros.spec.units import NUMBER, Dimension

_LIMIT: Final = {"<=": "at most", "<": "below", "==": "exactly"}
"""What the right side is to the left one, by the comparison that was to hold."""

_TURNED: Final = {"<=": "at least", "<": "above", "==": "exactly"}
"""The same of the left side to the right one."""

_NEGATED: Final = {"<=": "above", "<": "at least", "==": "other than"}
_NEGATED_TURNED: Final = {"<=": "below", "<": "at most", "==": "other than"}


class Violation(NamedTuple):
    """A rule that does not hold at `values`: float, bool or str by scalar variable."""

    rule: str
    term: t.Term
    values: Mapping[str, Any]

    def __str__(self) -> str:
        """As in `link_speed is 0.31 m/s (at most 0.25 m/s)`, for each part that is not as required."""
        exact = {name: _exact(value) for name, value in self.values.items()}
        return ", ".join(dict.fromkeys(_broken(lower(self.term), exact, wanted=True)))


def _broken(term: t.Term, values: Environment, *, wanted: bool) -> Iterator[str]:
    """The parts of a term of the scalar core that are on account of its not being as `wanted`."""
    match term:
        case t.Not(operand=operand):
            yield from _broken(operand, values, wanted=not wanted)
        case t.And(operands=operands) | t.Or(operands=operands):
            for operand in operands:
                if holds(operand, values) is not wanted:
                    yield from _broken(operand, values, wanted=wanted)
        case t.Compare(op=op, left=left, right=right):
            is_turned = _weight(left) < _weight(right)
            words = (
                (_TURNED if is_turned else _LIMIT) if wanted else (_NEGATED_TURNED if is_turned else _NEGATED)
            )
            measured, bound = (right, left) if is_turned else (left, right)
            measured, limit = _solved(measured, evaluate(bound, values))
            unit = _unit(measured)
            yield f"{_named(measured)} is {_value(measured, values)} ({words[op]} {_said(limit)}{unit})"
        case t.Literal():
            yield "never allowed"
        case _:
            yield f"{_named(term)} is {'false' if wanted else 'true'}"


def _weight(term: t.Term) -> int:
    """What is measured is compared with what was asked for, and that with constants."""
    roles = {one.role for one in t.variables_of(term).values()}
    return 2 if t.Role.STATE in roles else len(roles)


def _named(term: t.Term) -> str:
    text = spell(term)
    return text if isinstance(term, t.Variable | t.Absolute) else f"`{text}`"


def _solved(measured: t.Term, limit: Any) -> tuple[t.Term, Any]:
    """The same bound of what is measured alone: without its square, and without what is added to it.

    Lengths are compared by their squares, of which neither is negative here.
    """
    match measured:
        case t.Multiply(left=left, right=right) if left == right and limit >= 0:
            return _solved(left, Fraction(sqrt(limit)))
        case t.Add(left=part, right=t.Literal(value=Fraction() as added)):
            return _solved(part, limit - added)
        case _:
            return measured, limit


def _value(term: t.Term, values: Environment) -> str:
    value = evaluate(term, values)
    return _said(value) + (_unit(term) if isinstance(value, Fraction) else "")


def _said(value: Any) -> str:
    if isinstance(value, Fraction):
        return f"{float(value):.4g}"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _unit(term: t.Term) -> str:
    """Of a number of the scalar core, after a space; nothing for one without, and for what is no number."""
    match term:
        case t.Variable(type=kind) if not isinstance(kind, RealType):
            return ""
        case t.Literal(value=value) if not isinstance(value, Fraction):
            return ""
    dimension = _dimension(term)
    return "" if dimension == NUMBER else f" {dimension}"


def _dimension(term: t.Term) -> Dimension:
    """Of a real term of the scalar core."""
    match term:
        case t.Multiply(left=left, right=right):
            return _dimension(left) * _dimension(right)
        case t.Add(left=part) | t.Extremum(left=part) | t.Absolute(operand=part) | t.Conditional(then=part):
            return _dimension(part)
        case _:
            return cast("RealType", cast("t.Variable", term).type).dimension


def _exact(value: Any) -> Any:
    return Fraction(value) if type(value) is float else value
