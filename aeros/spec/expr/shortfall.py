"""Which parts of a condition are not as required: each quantity, its value, the bound it does not keep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final, cast

from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import lower
from aeros.spec.expr.semantics import Environment, evaluate, is_true
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER, Dimension
from aeros.spec.expr.unparse import unparse

_LIMIT: Final = {"<=": "at most", "<": "below", "==": "exactly"}
"""What the right side is to the left one, by the comparison that was to hold."""

_MIRRORED_PHRASES: Final = {"<=": "at least", "<": "above", "==": "exactly"}
"""The same of the left side to the right one."""

_NEGATED: Final = {"<=": "above", "<": "at least", "==": "other than"}
_NEGATED_MIRRORED_PHRASES: Final = {"<=": "below", "<": "at most", "==": "other than"}

_DIGITS: Final = (4, 6, 9, 17)


@dataclass(frozen=True, slots=True)
class UnmetBound:
    """One part of a condition that is not as required.

    quantity: as an expression; empty where the condition is never met, whatever is measured.
    value, bound: float in SI, bool or word; a value of None is not known, and `reason` says why.
    asked: what the value is to be to the bound, as in `at most`.
    unit: of both, SI; empty of truth values, words and bare numbers.
    """

    quantity: str
    value: float | bool | str | None
    required_op: str
    bound: float | bool | str
    unit: str = ""
    reason: str = ""

    def __str__(self) -> str:
        if not self.quantity:
            return "never allowed"
        if self.value is None:
            return f"`{self.quantity}` {self.reason}"
        if isinstance(self.bound, bool):
            return f"{self.quantity} is {self.formatted_values()[0]}"
        value, bound = self.formatted_values()
        return f"{self.quantity} is {value} ({self.required_op} {bound})"

    def formatted_values(self) -> tuple[str, str]:
        """Value and bound, of numbers as many digits as tell them apart."""
        for digits in _DIGITS:
            told = _format_value(self.value, self.unit, digits), _format_value(self.bound, self.unit, digits)
            if told[0] != told[1]:
                break
        return told


def unmet_bounds(term: t.Term, values: Mapping[str, Any]) -> tuple[UnmetBound, ...]:
    """Why `term` does not hold at `values`: exact values by variable, or float, bool or str by scalar one."""
    exact = {name: _exact(value) for name, value in values.items()}
    return tuple(dict.fromkeys(_violated_parts(lower(term), exact, wanted=True)))


def _violated_parts(term: t.Term, values: Environment, *, wanted: bool) -> Iterator[UnmetBound]:
    """The parts of a term of the scalar core that are on account of its not being as `wanted`."""
    match term:
        case t.Not(operand=operand):
            yield from _violated_parts(operand, values, wanted=not wanted)
        case t.And(operands=operands) | t.Or(operands=operands):
            for operand in operands:
                if is_true(operand, values) is not wanted:
                    yield from _violated_parts(operand, values, wanted=wanted)
        case t.Compare(op=op, left=left, right=right):
            is_turned = _blame_priority(left) < _blame_priority(right)
            words = (
                (_MIRRORED_PHRASES if is_turned else _LIMIT)
                if wanted
                else (_NEGATED_MIRRORED_PHRASES if is_turned else _NEGATED)
            )
            measured, bound = (right, left) if is_turned else (left, right)
            measured, limit = _isolate_measured(measured, evaluate(bound, values))
            value, unit = _value(measured, values)
            told = float(limit) if isinstance(limit, Fraction) else limit
            yield UnmetBound(_format_quantity(measured), value, words[op], told, unit)
        case t.Literal():
            yield UnmetBound("", not wanted, "exactly", wanted)
        case _:
            yield UnmetBound(_format_quantity(term), not wanted, "exactly", wanted)


def _blame_priority(term: t.Term) -> int:
    """What is measured is compared with what was asked for, and that with constants."""
    roles = {one.role for one in t.variables_of(term).values()}
    return 2 if t.VariableRole.STATE in roles else len(roles)


def _format_quantity(term: t.Term) -> str:
    text = unparse(term)
    return text if isinstance(term, t.Variable | t.Absolute) else f"`{text}`"


def _isolate_measured(measured: t.Term, limit: Any) -> tuple[t.Term, Any]:
    """The same bound of what is measured alone, without the constants added to it."""
    match measured:
        case t.Add(left=part, right=t.Literal(value=Fraction() as added)):
            return _isolate_measured(part, limit - added)
        case _:
            return measured, limit


def _value(term: t.Term, values: Environment) -> tuple[float | bool | str, str]:
    """Its value, and the unit of that."""
    value = evaluate(term, values)
    if isinstance(value, Fraction):
        dimension = _dimension(term)
        return float(value), "" if dimension == NUMBER else str(dimension)
    return cast("bool | str", value), ""


def _format_value(value: float | bool | str | None, unit: str, digits: int) -> str:
    if value is None or isinstance(value, bool | str):
        return str(value).lower() if isinstance(value, bool) else str(value)
    return f"{value:.{digits}g} {unit}".rstrip()


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
