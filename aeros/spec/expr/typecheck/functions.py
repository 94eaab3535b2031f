"""Typing rules of function calls."""

from __future__ import annotations

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import ExpressionTypeError
from aeros.spec.expr.typecheck.arithmetic import MINUS_ONE
from aeros.spec.expr.typecheck.desugar import ARITY, Norm, dot, expand_function
from aeros.spec.expr.typecheck.name_resolution import suggest_names
from aeros.spec.expr.typecheck.typed_term import (
    TypedTerm,
    require_rational,
    require_same_type,
    require_vector,
)
from aeros.spec.expr.types import RealType, VectorType


def check_signature(node: s.Call) -> None:
    """Check that a called function exists and takes as many arguments.

    Args:
        node: call.

    Raises:
        ExpressionTypeError: there is no such function, or it takes another number of arguments.
    """
    name, count = node.function.text, len(node.arguments)
    arity = ARITY.get(name)
    if arity is None:
        cure = suggest_names(name, ARITY) or "the functions are " + ", ".join(sorted(ARITY))
        raise ExpressionTypeError("AE202", f"there is no function `{name}`", node.function.extent, cure=cure)
    if count != arity:
        raise ExpressionTypeError("AE205", f"`{name}` takes {arity} argument(s), not {count}", node.extent)


def call(name: str, arguments: list[TypedTerm], extent: s.TextRange) -> TypedTerm:
    """Type a call.

    Args:
        name: function of `ARITY`.
        arguments: as many as it takes.
        extent: place of the whole.

    Returns:
        The expansion of the call; a bare norm for `norm` and `distance`.

    Raises:
        ExpressionTypeError: an argument has a wrong type, or their dimensions differ.
    """
    if name in ("norm", "distance", "dot"):
        return _vector_call(name, arguments, extent)
    for argument in arguments:
        type_ = _number_type(name, argument)
        require_same_type(arguments[0], argument, "combined with")
    term = expand_function(name, [require_rational(argument) for argument in arguments])
    return TypedTerm(term, VectorType(type_.dimension) if name == "vec" else type_, extent)


def _number_type(name: str, argument: TypedTerm) -> RealType:
    if isinstance(argument.type, RealType):
        return argument.type
    raise ExpressionTypeError(
        "AE203",
        f"`{name}` takes real numbers, not {argument.type}",
        argument.extent,
        label=str(argument.type),
    )


def _vector_call(name: str, arguments: list[TypedTerm], extent: s.TextRange) -> TypedTerm:
    vectors = [require_vector(argument, f"the argument of `{name}`") for argument in arguments]
    (first, type_), (second, other) = vectors[0], vectors[-1]
    dimension = type_.dimension
    if name == "dot":
        product = RealType(dimension * other.dimension)
        return TypedTerm(dot(first, second), product, extent)
    if name == "distance":
        require_same_type(arguments[0], arguments[1], "compared with")
        first = t.Add(first, t.Multiply(MINUS_ONE, second))
    return TypedTerm(Norm(dot(first, first), dimension), RealType(dimension), extent)
