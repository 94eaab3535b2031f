"""Explanation of a condition that does not hold: each violated bound with the measured value."""

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
"""Relation that the left side must have to the right one, by the comparison that must hold."""

_MIRRORED_PHRASES: Final = {"<=": "at least", "<": "above", "==": "exactly"}
"""Relation that the right side must have to the left one."""

_NEGATED: Final = {"<=": "above", "<": "at least", "==": "other than"}
_NEGATED_MIRRORED_PHRASES: Final = {"<=": "below", "<": "at most", "==": "other than"}

_DIGITS: Final = (4, 6, 9, 17)


@dataclass(frozen=True, slots=True)
class UnmetBound:
    """One part of a condition that does not hold as required.

    Attributes:
        quantity: an expression; empty if no state can meet the condition.
        value: measured value: float in SI, bool or word; None if it is not known, and `reason` says why.
        required_op: relation of the value to the bound that was required, as `at most`.
        bound: float in SI, bool or word.
        unit: SI unit of value and bound; empty for truth values, words and bare numbers.
        reason: why the value is not known.
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
        """Format value and bound with as many digits as it takes for them to differ.

        Returns:
            The two texts, with unit; equal only if 17 digits do not separate them.
        """
        for digits in _DIGITS:
            texts = format_value(self.value, self.unit, digits), format_value(self.bound, self.unit, digits)
            if texts[0] != texts[1]:
                break
        return texts


def unmet_bounds(term: t.Term, values: Mapping[str, Any]) -> tuple[UnmetBound, ...]:
    """Explain why a condition does not hold.

    Args:
        term: condition without past-time operators.
        values: float, exact real, bool or str by scalar variable, such as `joint[j1]`.

    Returns:
        The parts that do not hold, each once; empty if `term` holds.
    """
    exact = {name: _exact(value) for name, value in values.items()}
    lowered = lower(term)
    if is_true(lowered, exact):
        return ()
    return tuple(dict.fromkeys(_violated_parts(lowered, exact, expected=True)))


def _violated_parts(term: t.Term, values: Environment, *, expected: bool) -> Iterator[UnmetBound]:
    """Yield the parts of a scalar-core term that keep it from being as required."""
    match term:
        case t.Not(operand=operand):
            yield from _violated_parts(operand, values, expected=not expected)
        case t.And(operands=operands) | t.Or(operands=operands):
            for operand in operands:
                if is_true(operand, values) is not expected:
                    yield from _violated_parts(operand, values, expected=expected)
        case t.Compare(op=op, left=left, right=right):
            is_turned = _blame_priority(left) < _blame_priority(right)
            words = (
                (_MIRRORED_PHRASES if is_turned else _LIMIT)
                if expected
                else (_NEGATED_MIRRORED_PHRASES if is_turned else _NEGATED)
            )
            measured, bound = (right, left) if is_turned else (left, right)
            measured, limit = _isolate_measured(measured, evaluate(bound, values))
            value, unit = _value(measured, values)
            shown_limit = float(limit) if isinstance(limit, Fraction) else limit
            yield UnmetBound(_format_quantity(measured), value, words[op], shown_limit, unit)
        case t.Literal():
            yield UnmetBound("", not expected, "exactly", expected)
        case _:
            yield UnmetBound(_format_quantity(term), not expected, "exactly", expected)


def _blame_priority(term: t.Term) -> tuple[int, bool]:
    """Rank a side of a comparison: measured values before requested ones, and these before constants.

    Of two measured sides, a variable comes before an expression: `tool.x >= edge.x + 5 cm` is about the tool.
    """
    roles = {variable.role for variable in t.variables_of(term).values()}
    if t.VariableRole.STATE in roles:
        return 2, isinstance(term, t.Variable)
    return len(roles), False


def _format_quantity(term: t.Term) -> str:
    text = unparse(term)
    return text if isinstance(term, t.Variable | t.Absolute) else f"`{text}`"


def _isolate_measured(measured: t.Term, limit: Any) -> tuple[t.Term, Any]:
    """Move constants that are added to the measured quantity over to the bound."""
    match measured:
        case t.Add(left=part, right=t.Literal(value=Fraction() as added)):
            return _isolate_measured(part, limit - added)
        case _:
            return measured, limit


def _value(term: t.Term, values: Environment) -> tuple[float | bool | str, str]:
    """Return the value of a term and its unit."""
    value = evaluate(term, values)
    if isinstance(value, Fraction):
        dimension = _dimension(term)
        return float(value), "" if dimension == NUMBER else str(dimension)
    return cast("bool | str", value), ""


def format_value(value: Any, unit: str = "", digits: int = 6) -> str:
    """Write a measured value or a bound for people.

    Args:
        value: number, truth or member; a list of them; None if unknown.
        unit: of a number.
        digits: significant digits of a number.

    Returns:
        The text.
    """
    if isinstance(value, list):
        return f"({', '.join(format_value(one, unit, digits) for one in value)})"
    if isinstance(value, float):
        return f"{value:.{digits}g} {unit}".rstrip()
    return "unknown" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _dimension(term: t.Term) -> Dimension:
    """Return the dimension of a real term of the scalar core."""
    match term:
        case t.Multiply(left=left, right=right):
            return _dimension(left) * _dimension(right)
        case t.Add(left=part) | t.Extremum(left=part) | t.Absolute(operand=part) | t.Conditional(then=part):
            return _dimension(part)
        case _:
            return cast("RealType", cast("t.Variable", term).type).dimension


def _exact(value: Any) -> Any:
    return Fraction(value) if type(value) is float else value
