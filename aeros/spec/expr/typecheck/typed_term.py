"""Terms with their types, and the demands that typing rules make on an operand."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.typecheck.desugar import Norm
from aeros.spec.expr.types import BOOL, RealType, Type, VectorType
from aeros.spec.expr.units import NUMBER, cure_of_bare_number, format_number


@dataclass(frozen=True, slots=True)
class TypedTerm:
    """Term of a checked expression.

    Attributes:
        term: the term, or a norm that no comparison has consumed yet.
        type: its type.
        extent: its place in the text.
    """

    term: t.Term | Norm
    type: Type
    extent: s.TextRange


def require_rational(typed: TypedTerm) -> t.Term:
    """Return the term of an operand that must not be a bare `norm` or `distance`.

    Args:
        typed: operand.

    Returns:
        Its term.

    Raises:
        ExpressionTypeError: it is a bare `norm` or `distance`.
    """
    if isinstance(typed.term, Norm):
        raise ExpressionTypeError(
            "AE203",
            "a `norm` or `distance` can only be compared",
            typed.extent,
            cure="write it alone on one side of a comparison, as in `distance(a, b) <= 10 mm`",
        )
    return typed.term


def require_condition(typed: TypedTerm) -> t.Term:
    """Return the term of an operand that must be a condition.

    Args:
        typed: operand.

    Returns:
        Its boolean term.

    Raises:
        ExpressionTypeError: it has another type.
    """
    if typed.type != BOOL:
        raise ExpressionTypeError(
            "AE203", f"expected a condition, found {typed.type}", typed.extent, label=str(typed.type)
        )
    return require_rational(typed)


def require_real(typed: TypedTerm, what: str) -> tuple[t.Term, RealType]:
    """Return the term of an operand that must be a real number.

    Args:
        typed: operand.
        what: noun phrase for the operand, for the error.

    Returns:
        Its term and its type.

    Raises:
        ExpressionTypeError: it has another type, or is a bare `norm` or `distance`.
    """
    if not isinstance(typed.type, RealType):
        raise ExpressionTypeError(
            "AE203",
            f"{what} must be a real number, not {typed.type}",
            typed.extent,
            label=str(typed.type),
        )
    return require_rational(typed), typed.type


def require_vector(typed: TypedTerm, what: str) -> tuple[t.Term, VectorType]:
    """Return the term of an operand that must be a vector.

    Args:
        typed: operand.
        what: noun phrase for the operand, for the error.

    Returns:
        Its term and its type.

    Raises:
        ExpressionTypeError: it has another type.
    """
    if not isinstance(typed.type, VectorType):
        raise ExpressionTypeError(
            "AE203", f"{what} must be a vec3, not {typed.type}", typed.extent, label=str(typed.type)
        )
    return require_rational(typed), typed.type


def require_same_type(left: TypedTerm, right: TypedTerm, relation: str) -> None:
    """Require that two operands have one type.

    Args:
        left: first operand.
        right: second operand, underlined in the error.
        relation: relation between them, such as `compared with`, for the error.

    Raises:
        ExpressionTypeError: the types differ, or only their units do.
    """
    if left.type == right.type:
        return
    kinds = (RealType, VectorType)
    units = isinstance(left.type, kinds) and type(left.type) is type(right.type)
    raise ExpressionTypeError(
        "AE204" if units else "AE203",
        f"{left.type} is {relation} {right.type}",
        right.extent,
        label=str(right.type),
        related=(left.extent, str(left.type)),
        cure=(_with_unit(left, right) or _with_unit(right, left) or "give both sides the same unit")
        if units
        else None,
    )


def _with_unit(number: TypedTerm, other: TypedTerm) -> str | None:
    """Write a bare number with the unit of the other side; None if it is none, or that cannot be written."""
    match number, other.type:
        case TypedTerm(term=t.Literal(value=Fraction() as value), type=type_), RealType(dimension=dimension):
            shown = format_number(value)
            can_be_written = not (shown.startswith("≈") or str(dimension).startswith("1/"))
            if type_ == RealType(NUMBER) and can_be_written:
                return cure_of_bare_number(shown, dimension)
    return None
