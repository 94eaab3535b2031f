"""Typing rules for parts of a value: components of vectors and elements of families."""

from __future__ import annotations

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.typecheck.name_resolution import value_type
from aeros.spec.expr.typecheck.typed_term import TypedTerm, require_rational
from aeros.spec.expr.types import FamilyType, RealType, VectorType

_AXES = {"x": 0, "y": 1, "z": 2}


def component(base: TypedTerm, name: s.Name, extent: s.TextRange) -> TypedTerm:
    """Type `base.x`, `base.y` or `base.z`.

    Args:
        base: vector.
        name: name of the component.
        extent: place of the whole.

    Returns:
        The component, a real of the vector's dimension.

    Raises:
        ExpressionTypeError: the base is no vector, or has no such component.
    """
    axis = _AXES.get(name.text)
    if not isinstance(base.type, VectorType) or axis is None:
        raise ExpressionTypeError(
            "AE203",
            f"{base.type} has no component `{name.text}`",
            name.extent,
            cure="a vec3 has the components x, y and z",
        )
    return TypedTerm(t.Component(require_rational(base), axis), RealType(base.type.dimension), extent)


def require_family(base: TypedTerm) -> tuple[t.Variable | t.ConstantTable, FamilyType]:
    """Return the term and the type of an operand that must be a family.

    Args:
        base: operand.

    Returns:
        Its term and its type.

    Raises:
        ExpressionTypeError: it has another type.
    """
    match base:
        case TypedTerm(term=t.Variable() | t.ConstantTable() as term, type=FamilyType() as type_):
            return term, type_
    raise ExpressionTypeError("AE203", f"{base.type} cannot be indexed", base.extent)


def element(
    family: t.Variable | t.ConstantTable, type_: FamilyType, index: TypedTerm, extent: s.TextRange
) -> TypedTerm:
    """Type `base[index]`.

    Args:
        family: family.
        type_: its type.
        index: member of the enum that indexes it.
        extent: place of the whole.

    Returns:
        The element, as it is read.

    Raises:
        ExpressionTypeError: the index is of another enum.
    """
    if index.type != type_.index:
        raise ExpressionTypeError(
            "AE203", f"the index must be a member of {type_.index}, not {index.type}", index.extent
        )
    return TypedTerm(t.Select(family, require_rational(index)), value_type(type_.element), extent)
