"""Typing rules of past-time operators: which conditions and windows they take, and their terms."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.typecheck.typed_term import TypedTerm, require_condition, require_real
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import NUMBER, TIME


def check_past_is_allowed(node: s.PastOperator, scope: Scope) -> None:
    """Check that past-time operators may stand in an expression.

    Args:
        node: past-time operator.
        scope: scope of the expression.

    Raises:
        ExpressionTypeError: they may not.
    """
    if not scope.past:
        raise ExpressionTypeError(
            "AE209",
            f"`{node.op}` reads the past, which only a site's invariants may do",
            node.extent,
            cure="state it as an invariant of the site, whose history the runtime keeps",
        )


def require_measured(operand: TypedTerm, op: str) -> t.Term:
    """Return the term of an operand that must be a condition on state variables: only these have a past.

    Args:
        operand: operand of a past-time operator.
        op: the operator, for the error.

    Returns:
        Its boolean term.

    Raises:
        ExpressionTypeError: it is no condition, or reads something that is not measured.
    """
    term = require_condition(operand)
    for variable in t.variables_of(term).values():
        if variable.role is not t.VariableRole.STATE:
            raise ExpressionTypeError(
                "AE209",
                f"`{op}` reads past measurements, but `{variable.name}` is not measured",
                operand.extent,
                cure="use state variables of the vocabulary only",
            )
    return term


def require_window(operand: TypedTerm) -> Fraction:
    """Return the length of a window.

    Args:
        operand: constant time above 0.

    Returns:
        The length (s).

    Raises:
        ExpressionTypeError: it is not a time, not a constant, or not above 0.
    """
    duration, type_ = require_real(operand, "a window")
    if type_.dimension != TIME:
        raise ExpressionTypeError(
            "AE204", f"a window must be a time, not {type_}", operand.extent, label=str(type_)
        )
    match duration:
        case t.Literal(value=Fraction() as length) if length > 0:
            return length
    raise ExpressionTypeError(
        "AE209",
        "a window must be a constant time above 0 s",
        operand.extent,
        cure="as in `within 5 s`",
    )


def look_back(op: str, operands: list[t.Term], within: Fraction | None, extent: s.TextRange) -> TypedTerm:
    """Type a past-time operator.

    Args:
        op: `previously`, `once`, `historically`, `since` or `count`.
        operands: conditions on state variables; two for `since`, otherwise one.
        within: window (s); None for all the past, which `count` cannot have.
        extent: place of the whole.

    Returns:
        Real for `count`, otherwise a condition.
    """
    if op == "count" and within is not None:
        return TypedTerm(t.Occurrences(operands[0], within), RealType(NUMBER), extent)
    term: t.Term
    match op:
        case "previously":
            term = t.Previously(operands[0])
        case "once":
            term = t.Since(t.TRUE, operands[0], within)
        case "historically":
            term = t.Not(t.Since(t.TRUE, t.Not(operands[0]), within))
        case _:
            term = t.Since(operands[0], operands[1], within)
    return TypedTerm(term, BOOL, extent)
