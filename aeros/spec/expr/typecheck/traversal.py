"""Traversal of syntax trees: types the operands of each node, then applies the rule for its kind."""

from __future__ import annotations

from collections.abc import Mapping

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.typecheck.arithmetic import add, invert, multiply, negate, scale
from aeros.spec.expr.typecheck.comparison import compare, is_inside, is_one_of
from aeros.spec.expr.typecheck.desugar import Norm
from aeros.spec.expr.typecheck.functions import call, check_signature
from aeros.spec.expr.typecheck.name_resolution import (
    declared_type,
    resolve_attribute,
    resolve_name,
    resolve_volume,
)
from aeros.spec.expr.typecheck.past_operators import (
    check_past_is_allowed,
    look_back,
    require_measured,
    require_window,
)
from aeros.spec.expr.typecheck.quantifiers import declare_index, quantify
from aeros.spec.expr.typecheck.selection import component, element, require_family
from aeros.spec.expr.typecheck.typed_term import (
    TypedTerm,
    require_condition,
    require_rational,
    require_same_type,
)
from aeros.spec.expr.types import BOOL, FamilyType, RealType, Type
from aeros.spec.expr.units import format_number

Part = tuple[t.Term, s.TextRange]
"""Term with its place in the text."""

_CHOICES = ("min", "max", "clamp")  # functions whose value is one of their arguments


class TypeChecker:
    """Type checker of one expression; remembers the term of each node, for explanations."""

    def __init__(self, scope: Scope, bound: Mapping[str, t.BoundVariable] | None = None) -> None:
        """Start a check.

        Args:
            scope: names that the expression may use.
            bound: indices of the enclosing quantifiers, by name; None for none.
        """
        self._scope = scope
        self._bound = bound or {}
        self._parts: dict[int, tuple[Part, ...]] = {}  # by identity of the node
        self._points: set[int] = set()  # nodes that may be a temperature in °C, by identity

    def check(self, node: s.Node, hint: Type | None = None) -> TypedTerm:
        """Type a node and all that is in it.

        Args:
            node: expression.
            hint: type of its neighbour, which chooses the enum of a bare member; None if there is none.

        Returns:
            Its term and type.

        Raises:
            ExpressionTypeError: it does not type-check.
        """
        self._allow_points(node)
        return self._check(node, hint)

    def _check(self, node: s.Node, hint: Type | None = None) -> TypedTerm:
        """Type a part of an expression."""
        typed = self._typed(node, hint)
        if not isinstance(typed.term, Norm):
            self._parts.setdefault(id(node), ((typed.term, typed.extent),))
        return typed

    def parts_of(self, node: s.Node) -> tuple[Part, ...]:
        """Return the parts of a node outside quantifiers that was checked.

        Args:
            node: checked expression.

        Returns:
            The comparison of each pair for a comparison chain; otherwise the node's own term alone. Each with
            its place.
        """
        return self._parts[id(node)]

    def _typed(self, node: s.Node, hint: Type | None) -> TypedTerm:
        match node:
            case s.NumberLiteral(value=value, unit=unit):
                if unit.offset and id(node) not in self._points:
                    raise ExpressionTypeError(
                        "AE204",
                        f"a temperature in {unit.text} can only be compared, and with no computed value: "
                        "its zero is not that of K",
                        node.extent,
                        cure=f"write a difference in K, and this temperature as {format_number(value)} K",
                    )
                real = RealType(unit.dimension)
                return TypedTerm(t.Literal(value, real), real, node.extent)
            case s.BooleanLiteral(value=value):
                return TypedTerm(t.Literal(value, BOOL), BOOL, node.extent)
            case s.Name():
                return TypedTerm(*resolve_name(node, self._scope, self._bound, hint), node.extent)
            case s.Attribute():
                return self._attribute(node)
            case s.Index():
                family, type_ = require_family(self._check(node.base))
                return element(family, type_, self._check(node.index, type_.index), node.extent)
            case s.Call():
                check_signature(node)
                if node.function.text in _CHOICES:
                    self._allow_points(*node.arguments)
                arguments = [self._check(argument) for argument in node.arguments]
                return call(node.function.text, arguments, node.extent)
            case s.Unary(op="not"):
                return TypedTerm(t.Not(self._condition(node.operand)), BOOL, node.extent)
            case s.Unary():
                return negate(self._check(node.operand), node.extent)
            case s.Binary():
                return self._binary(node)
            case s.Junction():
                parts = tuple(self._condition(operand) for operand in node.operands)
                return TypedTerm(t.And(parts) if node.op == "and" else t.Or(parts), BOOL, node.extent)
            case s.ComparisonChain():
                return self._chain(node)
            case s.Membership():
                term = self._membership(node)
                return TypedTerm(t.Not(term) if node.negated else term, BOOL, node.extent)
            case s.IfElse():
                return self._conditional(node, hint)
            case s.Quantifier():
                index_variable = declare_index(node, self._scope, self._bound)
                inside = TypeChecker(self._scope, {**self._bound, index_variable.name: index_variable})
                return quantify(node.kind, index_variable, inside.check(node.body), node.extent)
            case s.PastOperator():
                return self._past(node)

    def _allow_points(self, *nodes: s.Node) -> None:
        """Allow temperatures in °C beside each other and beside values that are not computed.

        A difference of temperatures is no temperature: `warm - cold < 5 °C` would hold nearly always.
        """
        if all(map(_is_point, nodes)):
            self._points.update(map(id, nodes))

    def _condition(self, node: s.Node) -> t.Term:
        return require_condition(self._check(node))

    def _attribute(self, node: s.Attribute) -> TypedTerm:
        resolved = resolve_attribute(node, self._scope, self._bound)
        if resolved is not None:
            return TypedTerm(*resolved, node.extent)
        return component(self._check(node.base), node.name, node.extent)

    def _binary(self, node: s.Binary) -> TypedTerm:
        match node.op:
            case "implies":
                implication = t.Implies(self._condition(node.left), self._condition(node.right))
                return TypedTerm(implication, BOOL, node.extent)
            case "*":
                return multiply(self._check(node.left), self._check(node.right), node.extent)
            case "/":
                if isinstance(node.left, s.NumberLiteral):
                    self._check(node.left)  # `5 °C/s` is refused for its unit, not for the name `s`
                factor, dimension = invert(self._check(node.right))
                return scale(factor, dimension, self._check(node.left), node.extent)
            case _:
                return add(node.op, self._check(node.left), self._check(node.right), node.extent)

    def _chain(self, node: s.ComparisonChain) -> TypedTerm:
        self._allow_points(*node.operands)
        # Each operand's type chooses the enum of the next; the first takes it from a declared name.
        typed = [self._check(node.operands[0], declared_type(node.operands[1:], self._scope, self._bound))]
        for operand in node.operands[1:]:
            typed.append(self._check(operand, typed[-1].type))
        parts = tuple(map(compare, node.ops, typed, typed[1:]))
        starts = (node.extent.start, *(operand.extent.start for operand in typed[1:-1]))
        ends = (*(operand.extent.end for operand in typed[1:-1]), node.extent.end)
        self._parts[id(node)] = tuple(zip(parts, map(s.TextRange, starts, ends), strict=True))
        return TypedTerm(parts[0] if len(parts) == 1 else t.And(parts), BOOL, node.extent)

    def _membership(self, node: s.Membership) -> t.Term:
        if isinstance(node.container, tuple):
            return is_one_of(self._check(node.operand), node.container)
        box = resolve_volume(node.container, self._scope)
        return is_inside(self._check(node.operand), box)

    def _conditional(self, node: s.IfElse, hint: Type | None) -> TypedTerm:
        condition = self._condition(node.condition)
        self._allow_points(node.then, node.otherwise)
        then = self._check(node.then, hint)
        if isinstance(then.type, FamilyType):
            raise ExpressionTypeError(
                "AE203", "a whole family cannot be chosen", then.extent, cure="choose between its elements"
            )
        otherwise = self._check(node.otherwise, then.type)
        require_same_type(then, otherwise, "the alternative of")
        term = t.Conditional(condition, require_rational(then), require_rational(otherwise))
        return TypedTerm(term, then.type, node.extent)

    def _past(self, node: s.PastOperator) -> TypedTerm:
        check_past_is_allowed(node, self._scope)
        operands = [require_measured(self._check(operand), node.op) for operand in node.operands]
        within = None if node.window is None else require_window(self._check(node.window))
        return look_back(node.op, operands, within, node.extent)


def _is_point(node: s.Node) -> bool:
    """Tell whether a value is one that is written, measured or chosen, so not the result of arithmetic."""
    match node:
        case s.NumberLiteral() | s.Name() | s.Attribute() | s.Index():
            return True
        case s.Call(function=function, arguments=arguments):
            return function.text in _CHOICES and all(map(_is_point, arguments))
        case s.IfElse(then=then, otherwise=otherwise):
            return _is_point(then) and _is_point(otherwise)
    return False
