"""Typing rules of comparisons and of membership in sets and volumes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import AxisAlignedBox, ExpressionTypeError
from aeros.spec.expr.typecheck.desugar import Relation, compare_terms
from aeros.spec.expr.typecheck.name_resolution import not_a_member
from aeros.spec.expr.typecheck.typed_term import (
    TypedTerm,
    require_rational,
    require_same_type,
    require_vector,
)
from aeros.spec.expr.types import EnumType, FamilyType, RealType
from aeros.spec.expr.units import LENGTH

_RELATIONS: Final[Mapping[str, Relation]] = {
    "<": "<",
    ">": "<",
    "<=": "<=",
    ">=": "<=",
    "==": "==",
    "!=": "==",
}
"""The relation that stands for each operator, with sides exchanged, or negated."""


def compare(op: str, left: TypedTerm, right: TypedTerm) -> t.Term:
    """Type the comparison of two operands.

    Args:
        op: `<`, `<=`, `>`, `>=`, `==` or `!=`.
        left: left side.
        right: right side, of the same type.

    Returns:
        Boolean term, with `<`, `<=` and `==` only.

    Raises:
        ExpressionTypeError: the types differ, have no order, or are those of whole families.
    """
    require_same_type(left, right, "compared with")
    relation = _RELATIONS[op]
    if op in (">", ">="):
        left, right = right, left
    if relation != "==" and not isinstance(left.type, RealType):
        raise ExpressionTypeError(
            "AE203",
            f"{left.type} has no order",
            left.extent,
            label=str(left.type),
            cure="compare with `==` or `!=`",
        )
    if isinstance(left.type, FamilyType):
        raise ExpressionTypeError(
            "AE203",
            "a whole family cannot be compared",
            left.extent,
            cure="compare each: `all(… for j in …)`",
        )
    term = compare_terms(relation, left.term, right.term)
    return t.Not(term) if op == "!=" else term


def is_one_of(operand: TypedTerm, members: tuple[s.Name, ...]) -> t.Term:
    """Type `operand in {member, …}`.

    Args:
        operand: value of an enum.
        members: names of members.

    Returns:
        Boolean term: the operand equals one of them.

    Raises:
        ExpressionTypeError: the operand has another type, or a name is no member of its enum.
    """
    enum = operand.type
    if not isinstance(enum, EnumType):
        raise ExpressionTypeError("AE203", f"{enum} is not an enumeration", operand.extent, label=str(enum))
    term = require_rational(operand)
    return t.Or(tuple(t.Compare("==", term, _member(member, enum)) for member in members))


def _member(name: s.Name, enum: EnumType) -> t.Literal:
    if name.text not in enum.members:
        raise not_a_member(name, enum)
    return t.Literal(name.text, enum)


def is_inside(operand: TypedTerm, box: AxisAlignedBox) -> t.Term:
    """Type `operand in volume`.

    Args:
        operand: point, a vector in metres.
        box: closed box in W.

    Returns:
        Boolean term: each coordinate lies between those of the corners.

    Raises:
        ExpressionTypeError: the operand is not a point.
    """
    point, type_ = require_vector(operand, "a point")
    if type_.dimension != LENGTH:
        raise ExpressionTypeError(
            "AE204", f"a point is a vec3 [m], not {type_}", operand.extent, label=str(type_)
        )
    metres = RealType(LENGTH)
    parts: list[t.Term] = []
    for axis in range(3):
        coordinate = t.Component(point, axis)
        parts.append(t.Compare("<=", t.Literal(box.lower[axis], metres), coordinate))
        parts.append(t.Compare("<=", coordinate, t.Literal(box.upper[axis], metres)))
    return t.And(tuple(parts))
