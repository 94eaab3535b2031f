"""Type check from surface syntax to typed terms; an error says where types or dimensions disagree.

Syntactic sugar ends here: `>`, `!=`, chains, subtraction, division by a constant, `norm`, `distance`, `dot`,
`clamp` and membership become the few nodes of `terms.py`. `norm(v)` and `distance(a, b)` have irrational
values. So they may stand only on one side of a comparison, where `norm(v) <= r` means `0 <= r and v·v <= r²`,
which is exact.
"""

from __future__ import annotations

from collections.abc import Iterator

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import size_bounds
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.typecheck.integrality import is_integral
from aeros.spec.expr.typecheck.traversal import Part, TypeChecker
from aeros.spec.expr.typecheck.typed_term import require_rational
from aeros.spec.expr.types import BOOL, IntegerType, RealType, Type
from aeros.spec.expr.units import NUMBER, units_of

MAX_SIZE = 50_000  # nodes of the scalar core: a tenth of a second in the exact interpreter
MAX_HEIGHT = 150  # of the scalar core: each of its passes takes up to four stack frames a level


def check(node: s.Node, scope: Scope, expected: Type) -> t.Term:
    """Type-check an expression against an expected type.

    Args:
        node: parsed expression.
        scope: names that it may use.
        expected: type that it must have. For an integer, a real that is always whole will do.

    Returns:
        The typed term.

    Raises:
        ExpressionTypeError: the expression does not type-check or has another type.
    """
    return _check(node, TypeChecker(scope), expected)


def _check(node: s.Node, checker: TypeChecker, expected: Type) -> t.Term:
    term, type_ = _infer(node, checker, expected)
    if isinstance(expected, IntegerType) and type_ == RealType(NUMBER):
        if not is_integral(term):
            raise ExpressionTypeError("AE203", "expected a whole number", node.extent, label=str(type_))
    elif type_ != expected:
        code = "AE204" if isinstance(type_, RealType) and isinstance(expected, RealType) else "AE203"
        cure = _unit_cure(node, type_, expected)
        raise ExpressionTypeError(
            code, f"expected {expected}, found {type_}", node.extent, label=str(type_), cure=cure
        )
    return term


def _unit_cure(node: s.Node, type_: Type, expected: Type) -> str | None:
    """Return the cure for a bare number where one with a unit is needed."""
    if type_ != RealType(NUMBER) or not isinstance(expected, RealType):
        return None
    unit, *_ = *units_of(expected.dimension), str(expected.dimension)
    return f"write its unit after it, as in `2 {unit}`" if isinstance(node, s.NumberLiteral) else None


def infer(node: s.Node, scope: Scope, hint: Type | None = None) -> tuple[t.Term, Type]:
    """Type-check an expression and infer its type.

    Args:
        node: parsed expression.
        scope: names that it may use.
        hint: type that chooses the enum of a bare member; None if none is expected.

    Returns:
        The typed term and its type.

    Raises:
        ExpressionTypeError: the expression does not type-check, or its scalar core would have more than
            `MAX_SIZE` nodes or be higher than `MAX_HEIGHT`.
    """
    return _infer(node, TypeChecker(scope), hint)


def _infer(node: s.Node, checker: TypeChecker, hint: Type | None) -> tuple[t.Term, Type]:
    typed = checker.check(node, hint)
    term = require_rational(typed)
    size, height = size_bounds(term)
    if size > MAX_SIZE or height > MAX_HEIGHT:
        raise ExpressionTypeError(
            "AE201",
            "this expression is too large after its sets and vectors are expanded",
            node.extent,
            cure="split it into several rules",
        )
    return term, typed.type


Parts = tuple[Part, ...]
"""Conditions, each with its place in the text."""


def check_condition(node: s.Node, scope: Scope) -> tuple[t.Term, Parts, Parts, Parts]:
    """Type-check a condition and split it into parts that can be explained one by one.

    Args:
        node: parsed condition.
        scope: names that it may use.

    Returns:
        (term, conjuncts, premises, alternatives). The conjuncts are the operands of `and` and each pair of a
        comparison chain; their conjunction is the term. The premises are the conjuncts before `implies`, the
        alternatives the operands of `or`: the term is false where all premises are true and all alternatives
        false.

    Raises:
        ExpressionTypeError: the expression is no condition or does not type-check.
    """
    checker = TypeChecker(scope)
    term = _check(node, checker, BOOL)
    premises, alternatives = _split_implication(node, checker)
    return term, tuple(_conjuncts(node, checker)), tuple(premises), tuple(alternatives)


def _conjuncts(node: s.Node, checker: TypeChecker) -> Iterator[Part]:
    if isinstance(node, s.Junction) and node.op == "and":
        for operand in node.operands:
            yield from _conjuncts(operand, checker)
    else:
        yield from checker.parts_of(node)


def _split_implication(node: s.Node, checker: TypeChecker) -> tuple[list[Part], list[Part]]:
    """Return the premises and the alternatives of a condition that was checked."""
    premises: list[Part] = []
    alternatives: list[Part] = []
    pending = [node]
    while pending:
        match pending.pop(0):
            case s.Junction(op="or", operands=operands):
                pending = [*operands, *pending]
            case s.Binary(op="implies", left=left, right=right):
                premises += _conjuncts(left, checker)
                pending = [right, *pending]
            case part:
                whole = t.conjunction(*(term for term, _ in _conjuncts(part, checker)))
                alternatives.append((whole, part.extent))
    return premises, alternatives
