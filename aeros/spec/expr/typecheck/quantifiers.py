"""Typing rules of quantifiers, sums and counts over the members of an enum."""

from __future__ import annotations

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.typecheck.name_resolution import Bound, suggest_names
from aeros.spec.expr.typecheck.typed_term import TypedTerm, require_condition, require_real
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.expr.units import NUMBER


def declare_index(node: s.Quantifier, scope: Scope, bound: Bound) -> t.BoundVariable:
    """Declare the index of a quantifier.

    Args:
        node: quantifier.
        scope: declared names.
        bound: indices of the enclosing quantifiers, by name.

    Returns:
        The index, over the members of its enum.

    Raises:
        ExpressionTypeError: its set is not an enum, or its name has a meaning already.
    """
    members = scope.enums.get(node.set.text)
    if members is None:
        cure = suggest_names(node.set.text, scope.enums) or "declare it under the site's `enums`"
        raise ExpressionTypeError("AE202", f"`{node.set.text}` is not a set", node.set.extent, cure=cure)
    name = node.index.text
    is_declared = any(name in each for each in (bound, scope.variables, scope.constants, scope.definitions))
    is_member = any(name in enum.members for enum in scope.enums.values())
    if is_declared or is_member or name == "inputs":
        raise ExpressionTypeError(
            "AE202",
            f"`{name}` already has a meaning here",
            node.index.extent,
            cure="choose another name for the index",
        )
    return t.BoundVariable(name, members)


def quantify(kind: str, index: t.BoundVariable, body: TypedTerm, extent: s.TextRange) -> TypedTerm:
    """Type a quantifier, sum or count.

    Args:
        kind: `all`, `any`, `sum` or `count`.
        index: index that the body may use.
        body: real for `sum`, otherwise a condition.
        extent: place of the whole.

    Returns:
        Condition for `all` and `any`, otherwise a real.

    Raises:
        ExpressionTypeError: the body has another type.
    """
    if kind == "sum":
        summand, type_ = require_real(body, "what is summed")
        return TypedTerm(t.Aggregate("sum", index, summand), type_, extent)
    condition = require_condition(body)
    if kind == "count":
        return TypedTerm(t.Aggregate("count", index, condition), RealType(NUMBER), extent)
    return TypedTerm(t.Quantified("all" if kind == "all" else "any", index, condition), BOOL, extent)
