"""Type checker from surface syntax to typed terms; an error says where types or dimensions disagree.

Syntactic sugar ends here: `>`, `!=`, chains, subtraction, division by a constant, `norm`, `distance`, `dot`,
`clamp` and membership become the few nodes of `terms.py`. `norm(v)` and `distance(a, b)` have irrational
values. So they may stand only on one side of a comparison, where `norm(v) <= r` means `0 <= r and v·v <= r²`,
which is exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal as OneOf
from typing import cast

from aeros.spec.expr import syntax as s
from aeros.spec.expr import terms as t
from aeros.spec.expr.desugar import ARITY, Norm, compare_norm, dot, expand_function
from aeros.spec.expr.integrality import is_integral
from aeros.spec.expr.lower import size_bounds
from aeros.spec.expr.name_resolution import (
    not_a_member,
    resolve_attribute,
    resolve_name,
    suggest_names,
    value_type,
)
from aeros.spec.expr.scope import ExpressionTypeError, Scope
from aeros.spec.expr.types import BOOL, EnumType, FamilyType, IntegerType, RealType, Type, VectorType
from aeros.spec.expr.units import LENGTH, NUMBER, TIME, Dimension

MAX_SIZE = 50_000  # nodes of the scalar core: a tenth of a second in the exact interpreter
MAX_HEIGHT = 150  # of the scalar core: each of its passes takes up to four stack frames a level

_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, slots=True)
class _TypedTerm:
    term: t.Term | Norm
    type: Type
    extent: s.TextRange


def check(node: s.Node, scope: Scope, expected: Type, checker: _TypeChecker | None = None) -> t.Term:
    """Type-check an expression against an expected type.

    Args:
        node: parsed expression.
        scope: names that it may use.
        expected: type that it must have. For an integer, a real that is always whole will do.
        checker: checker whose results are asked for later; None for a new one.

    Returns:
        The typed term.

    Raises:
        ExpressionTypeError: the expression does not type-check or has another type.
    """
    term, type_ = infer(node, scope, expected, checker)
    if isinstance(expected, IntegerType) and type_ == RealType(NUMBER):
        if not is_integral(term):
            raise ExpressionTypeError("AE203", "expected a whole number", node.extent, label=str(type_))
    elif type_ != expected:
        code = "AE204" if isinstance(type_, RealType) and isinstance(expected, RealType) else "AE203"
        raise ExpressionTypeError(code, f"expected {expected}, found {type_}", node.extent, label=str(type_))
    return term


def infer(
    node: s.Node, scope: Scope, hint: Type | None = None, checker: _TypeChecker | None = None
) -> tuple[t.Term, Type]:
    """Type-check an expression and infer its type.

    Args:
        node: parsed expression.
        scope: names that it may use.
        hint: type that chooses the enum of a bare member; None if none is expected.
        checker: checker whose results are asked for later; None for a new one.

    Returns:
        The typed term and its type.

    Raises:
        ExpressionTypeError: the expression does not type-check, or its scalar core would have more than
            `MAX_SIZE` nodes or be higher than `MAX_HEIGHT`.
    """
    checker = checker or _TypeChecker(scope, {})
    typed = checker.check(node, hint)
    term = checker.require_rational(typed)
    size, height = size_bounds(term)
    if size > MAX_SIZE or height > MAX_HEIGHT:
        raise ExpressionTypeError(
            "AE201",
            "this expression is too large once its sets and vectors are written out",
            node.extent,
            cure="split it into several rules",
        )
    return term, typed.type


_ConditionPart = tuple[t.Term, s.TextRange]
Parts = tuple[_ConditionPart, ...]
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
    checker = _TypeChecker(scope, {})
    term = check(node, scope, BOOL, checker)
    premises, alternatives = checker.implication(node)
    return term, tuple(checker.conjuncts(node)), tuple(premises), tuple(alternatives)


class _TypeChecker:
    def __init__(self, scope: Scope, bound: Mapping[str, t.BoundVariable]) -> None:
        self._scope = scope
        self._bound = bound
        self._terms: dict[int, tuple[_TypedTerm, ...]] = {}  # by identity of the node

    def conjuncts(self, node: s.Node) -> Iterator[_ConditionPart]:
        """Yield the conjuncts of a condition that was checked."""
        if isinstance(node, s.Junction) and node.op == "and":
            for operand in node.operands:
                yield from self.conjuncts(operand)
        else:
            yield from ((self.require_rational(typed), typed.extent) for typed in self._terms[id(node)])

    def implication(self, node: s.Node) -> tuple[list[_ConditionPart], list[_ConditionPart]]:
        """Return the premises and the alternatives of a condition that was checked."""
        premises: list[_ConditionPart] = []
        alternatives: list[_ConditionPart] = []
        pending = [node]
        while pending:
            match pending.pop(0):
                case s.Junction(op="or", operands=operands):
                    pending = [*operands, *pending]
                case s.Binary(op="implies", left=left, right=right):
                    premises += self.conjuncts(left)
                    pending = [right, *pending]
                case part:
                    whole = t.conjunction(*(term for term, _ in self.conjuncts(part)))
                    alternatives.append((whole, part.extent))
        return premises, alternatives

    def check(self, node: s.Node, hint: Type | None = None) -> _TypedTerm:
        """Type `node`; `hint` is the type of its neighbour, which chooses the enum of a bare member."""
        typed = self._typed(node, hint)
        self._terms.setdefault(id(node), (typed,))
        return typed

    def _typed(self, node: s.Node, hint: Type | None) -> _TypedTerm:
        match node:
            case s.NumberLiteral(value=value, unit=unit):
                type_ = RealType(unit.dimension)
                return _TypedTerm(t.Literal(value, type_), type_, node.extent)
            case s.BooleanLiteral(value=value):
                return _TypedTerm(t.Literal(value, BOOL), BOOL, node.extent)
            case s.Name():
                return _TypedTerm(*resolve_name(node, self._scope, self._bound, hint), node.extent)
            case s.Attribute():
                return self._attribute(node)
            case s.Index():
                return self._index(node)
            case s.Call():
                return self._call(node)
            case s.Unary(op="not", operand=operand):
                return _TypedTerm(t.Not(self._bool(operand)), BOOL, node.extent)
            case s.Unary(operand=operand):
                minus = t.Literal(Fraction(-1), RealType(NUMBER))
                return self._scale(minus, NUMBER, self.check(operand), node.extent)
            case s.Binary(op="implies", left=left, right=right):
                return _TypedTerm(t.Implies(self._bool(left), self._bool(right)), BOOL, node.extent)
            case s.Binary(op="*", left=left, right=right):
                return self._product(node, left, right)
            case s.Binary(op="/", left=left, right=right):
                return self._quotient(node, left, right)
            case s.Binary():
                return self._sum(node)
            case s.Junction(op=op, operands=operands):
                parts = tuple(self._bool(operand) for operand in operands)
                return _TypedTerm(t.And(parts) if op == "and" else t.Or(parts), BOOL, node.extent)
            case s.ComparisonChain():
                return self._chain(node)
            case s.Membership():
                return self._membership(node)
            case s.IfElse():
                return self._conditional(node, hint)
            case s.Quantifier():
                return self._quantifier(node)
            case s.PastOperator():
                return self._past(node)

    def require_rational(self, typed: _TypedTerm) -> t.Term:
        """Return the term of `typed`, which must not be a bare `norm` or `distance`."""
        if isinstance(typed.term, Norm):
            raise ExpressionTypeError(
                "AE203",
                "a `norm` or `distance` can only be compared",
                typed.extent,
                cure="write it alone on one side of a comparison, as in `distance(a, b) <= 10 mm`",
            )
        return typed.term

    def _attribute(self, node: s.Attribute) -> _TypedTerm:
        resolved = resolve_attribute(node, self._scope)
        if resolved is not None:
            return _TypedTerm(*resolved, node.extent)
        base = self.check(node.base)
        axis = _AXES.get(node.name.text)
        if not isinstance(base.type, VectorType) or axis is None:
            raise ExpressionTypeError(
                "AE203",
                f"{base.type} has no component `{node.name.text}`",
                node.name.extent,
                cure="a vec3 has the components x, y and z",
            )
        vector = self.require_rational(base)
        return _TypedTerm(t.Component(vector, axis), RealType(base.type.dimension), node.extent)

    def _index(self, node: s.Index) -> _TypedTerm:
        base = self.check(node.base)
        if not isinstance(base.type, FamilyType):
            raise ExpressionTypeError("AE203", f"{base.type} cannot be indexed", node.base.extent)
        index = self.check(node.index, base.type.index)
        if index.type != base.type.index:
            raise ExpressionTypeError(
                "AE203",
                f"the index must be a member of {base.type.index}, not {index.type}",
                node.index.extent,
            )
        family = cast("t.Variable | t.ConstantTable", base.term)
        return _TypedTerm(
            t.Select(family, self.require_rational(index)), value_type(base.type.element), node.extent
        )

    def _bool(self, node: s.Node) -> t.Term:
        typed = self.check(node, BOOL)
        if typed.type != BOOL:
            raise ExpressionTypeError(
                "AE203", f"expected a condition, found {typed.type}", node.extent, label=str(typed.type)
            )
        return self.require_rational(typed)

    def _real(self, node: s.Node, what: str) -> tuple[t.Term, RealType]:
        return self._as_real(self.check(node), what)

    def _as_real(self, typed: _TypedTerm, what: str) -> tuple[t.Term, RealType]:
        if not isinstance(typed.type, RealType):
            raise ExpressionTypeError(
                "AE203",
                f"{what} must be a real number, not {typed.type}",
                typed.extent,
                label=str(typed.type),
            )
        return self.require_rational(typed), typed.type

    def _vector(self, node: s.Node, what: str) -> tuple[t.Term, VectorType]:
        return self._as_vector(self.check(node), what)

    def _as_vector(self, typed: _TypedTerm, what: str) -> tuple[t.Term, VectorType]:
        if not isinstance(typed.type, VectorType):
            raise ExpressionTypeError(
                "AE203", f"{what} must be a vec3, not {typed.type}", typed.extent, label=str(typed.type)
            )
        return self.require_rational(typed), typed.type

    def _require_same_type(self, left: _TypedTerm, right: _TypedTerm, doing: str) -> None:
        if left.type == right.type:
            return
        kinds = (RealType, VectorType)
        units = isinstance(left.type, kinds) and type(left.type) is type(right.type)
        raise ExpressionTypeError(
            "AE204" if units else "AE203",
            f"{left.type} is {doing} {right.type}",
            right.extent,
            label=str(right.type),
            related=(left.extent, str(left.type)),
            cure="give both sides the same unit" if units else None,
        )

    def _sum(self, node: s.Binary) -> _TypedTerm:
        left, right = self.check(node.left), self.check(node.right)
        doing = "added to" if node.op == "+" else "subtracted by"
        if not isinstance(left.type, RealType | VectorType):
            raise ExpressionTypeError(
                "AE203", f"{left.type} cannot be {doing} anything", left.extent, label=str(left.type)
            )
        self._require_same_type(left, right, doing)
        addend = self.require_rational(right)
        if node.op == "-":
            addend = t.Multiply(t.Literal(Fraction(-1), RealType(NUMBER)), addend)
        return _TypedTerm(t.Add(self.require_rational(left), addend), left.type, node.extent)

    def _product(self, node: s.Binary, left: s.Node, right: s.Node) -> _TypedTerm:
        first, second = self.check(left), self.check(right)
        if isinstance(first.type, VectorType):
            first, second = second, first
        factor, type_ = self._as_real(first, "a factor")
        return self._scale(factor, type_.dimension, second, node.extent)

    def _scale(
        self, factor: t.Term, dimension: Dimension, typed: _TypedTerm, extent: s.TextRange
    ) -> _TypedTerm:
        if not isinstance(typed.type, RealType | VectorType):
            raise ExpressionTypeError(
                "AE203", f"{typed.type} cannot be multiplied", typed.extent, label=str(typed.type)
            )
        type_ = replace(typed.type, dimension=typed.type.dimension * dimension)
        term = self.require_rational(typed)
        if isinstance(factor, t.Literal) and isinstance(term, t.Literal):
            product = cast("Fraction", factor.value) * cast("Fraction", term.value)
            return _TypedTerm(t.Literal(product, cast("RealType", type_)), type_, extent)
        return _TypedTerm(t.Multiply(factor, term), type_, extent)

    def _quotient(self, node: s.Binary, left: s.Node, right: s.Node) -> _TypedTerm:
        divisor, type_ = self._real(right, "a divisor")
        if not isinstance(divisor, t.Literal) or divisor.value == 0:
            raise ExpressionTypeError(
                "AE206",
                "only a constant other than zero can divide",
                right.extent,
                cure="multiply the other side instead: `a / b <= c` is `a <= c * b` where b is positive",
            )
        inverse = t.Literal(1 / cast("Fraction", divisor.value), RealType(type_.dimension**-1))
        return self._scale(inverse, type_.dimension**-1, self.check(left), node.extent)

    def _chain(self, node: s.ComparisonChain) -> _TypedTerm:
        typed: list[_TypedTerm] = []
        for operand in node.operands:
            typed.append(
                self.check(operand, typed[-1].type if typed else self._operand_hint(node.operands[1:]))
            )
        pairs = zip(node.ops, typed, typed[1:], strict=False)
        parts = tuple(self._compare(op, left, right) for op, left, right in pairs)
        starts = (node.extent.start, *(operand.extent.start for operand in typed[1:-1]))
        ends = (*(operand.extent.end for operand in typed[1:-1]), node.extent.end)
        self._terms[id(node)] = tuple(
            _TypedTerm(part, BOOL, s.TextRange(start, end))
            for part, start, end in zip(parts, starts, ends, strict=True)
        )
        return _TypedTerm(parts[0] if len(parts) == 1 else t.And(parts), BOOL, node.extent)

    def _operand_hint(self, operands: tuple[s.Node, ...]) -> Type | None:
        """Return the type of the first operand that is a declared name, to choose a leading member's enum."""
        for operand in operands:
            match operand:
                case s.Name(text=name) if name in self._bound:
                    return self._bound[name].type
                case s.Name(text=name) if name in self._scope.variables:
                    return self._scope.variables[name].type
                case s.Attribute(base=s.Name(text="inputs"), name=s.Name(text=name)) if (
                    name in self._scope.inputs
                ):
                    return self._scope.inputs[name].type
        return None

    def _compare(self, op: str, left: _TypedTerm, right: _TypedTerm) -> t.Term:
        self._require_same_type(left, right, "compared with")
        if op in (">", ">="):
            op, left, right = op.replace(">", "<"), right, left
        if op in ("<", "<=") and not isinstance(left.type, RealType):
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
        if isinstance(left.term, Norm) or isinstance(right.term, Norm):
            return compare_norm(op, left.term, right.term)
        if op == "!=":
            return t.Not(t.Compare("==", left.term, right.term))
        return t.Compare(cast('OneOf["<", "<=", "=="]', op), left.term, right.term)

    def _membership(self, node: s.Membership) -> _TypedTerm:
        if isinstance(node.container, tuple):
            term = self._in_members(node.operand, node.container)
        else:
            term = self._in_volume(node.operand, node.container)
        return _TypedTerm(t.Not(term) if node.negated else term, BOOL, node.extent)

    def _in_members(self, operand: s.Node, members: tuple[s.Name, ...]) -> t.Term:
        typed = self.check(operand)
        if not isinstance(typed.type, EnumType):
            raise ExpressionTypeError(
                "AE203", f"{typed.type} is not an enumeration", operand.extent, label=str(typed.type)
            )
        term = self.require_rational(typed)
        literals = [self._member(member, typed.type) for member in members]
        return t.Or(tuple(t.Compare("==", term, literal) for literal in literals))

    def _member(self, name: s.Name, enum: EnumType) -> t.Literal:
        if name.text not in enum.members:
            raise not_a_member(name, enum)
        return t.Literal(name.text, enum)

    def _in_volume(self, operand: s.Node, name: s.Name) -> t.Term:
        box = self._scope.volumes.get(name.text)
        if box is None:
            cure = suggest_names(name.text, self._scope.volumes) or "declare it under the site's `volumes`"
            raise ExpressionTypeError(
                "AE202", f"`{name.text}` is not a volume of this site", name.extent, cure=cure
            )
        point, type_ = self._vector(operand, "a point")
        if type_.dimension != LENGTH:
            raise ExpressionTypeError(
                "AE204", f"a point is a vec3 [m], not {type_}", operand.extent, label=str(type_)
            )
        metres = RealType(LENGTH)
        parts: list[t.Term] = []
        for axis in range(3):
            part = t.Component(point, axis)
            parts.append(t.Compare("<=", t.Literal(box.lower[axis], metres), part))
            parts.append(t.Compare("<=", part, t.Literal(box.upper[axis], metres)))
        return t.And(tuple(parts))

    def _conditional(self, node: s.IfElse, hint: Type | None) -> _TypedTerm:
        condition = self._bool(node.condition)
        then = self.check(node.then, hint)
        if isinstance(then.type, FamilyType):
            raise ExpressionTypeError(
                "AE203", "a whole family cannot be chosen", then.extent, cure="choose between its elements"
            )
        otherwise = self.check(node.otherwise, then.type)
        self._require_same_type(then, otherwise, "the alternative of")
        term = t.Conditional(condition, self.require_rational(then), self.require_rational(otherwise))
        return _TypedTerm(term, then.type, node.extent)

    def _quantifier(self, node: s.Quantifier) -> _TypedTerm:
        members = self._scope.enums.get(node.set.text)
        if members is None:
            cure = suggest_names(node.set.text, self._scope.enums) or "declare it under the site's `enums`"
            raise ExpressionTypeError("AE202", f"`{node.set.text}` is not a set", node.set.extent, cure=cure)
        name = node.index.text
        is_declared = name in self._bound or name in self._scope.variables or name in self._scope.constants
        is_member = any(name in enum.members for enum in self._scope.enums.values())
        if is_declared or is_member or name == "inputs":
            raise ExpressionTypeError(
                "AE202",
                f"`{name}` already has a meaning here",
                node.index.extent,
                cure="name the index otherwise",
            )
        index = t.BoundVariable(name, members)
        inside = _TypeChecker(self._scope, {**self._bound, name: index})
        if node.kind == "sum":
            body, type_ = inside._real(node.body, "what is summed")
            return _TypedTerm(t.Aggregate("sum", index, body), type_, node.extent)
        body = inside._bool(node.body)
        if node.kind == "count":
            return _TypedTerm(t.Aggregate("count", index, body), RealType(NUMBER), node.extent)
        kind = cast('OneOf["all", "any"]', node.kind)
        return _TypedTerm(t.Quantified(kind, index, body), BOOL, node.extent)

    def _past(self, node: s.PastOperator) -> _TypedTerm:
        if not self._scope.past:
            raise ExpressionTypeError(
                "AE209",
                f"`{node.op}` looks at the past, which only a site's invariants may do",
                node.extent,
                cure="state it as an invariant of the site, whose history the runtime keeps",
            )
        operands = [self._measured_condition(operand, node.op) for operand in node.operands]
        within = None if node.window is None else self._duration(node.window)
        if node.op == "count":
            return _TypedTerm(
                t.Occurrences(operands[0], cast("Fraction", within)), RealType(NUMBER), node.extent
            )
        term: t.Term
        match node.op:
            case "previously":
                term = t.Previously(operands[0])
            case "once":
                term = t.Since(t.TRUE, operands[0], within)
            case "historically":
                term = t.Not(t.Since(t.TRUE, t.Not(operands[0]), within))
            case _:
                term = t.Since(operands[0], operands[1], within)
        return _TypedTerm(term, BOOL, node.extent)

    def _measured_condition(self, node: s.Node, op: str) -> t.Term:
        """Type a condition on state variables alone: only these have a past."""
        term = self._bool(node)
        for variable in t.variables_of(term).values():
            if variable.role is not t.VariableRole.STATE:
                raise ExpressionTypeError(
                    "AE209",
                    f"`{op}` looks at what was measured, and `{variable.name}` is not measured",
                    node.extent,
                    cure="use state variables of the vocabulary only",
                )
        return term

    def _duration(self, node: s.Node) -> Fraction:
        duration, type_ = self._real(node, "a window")
        if type_.dimension != TIME:
            raise ExpressionTypeError(
                "AE204", f"a window is a time, not {type_}", node.extent, label=str(type_)
            )
        if not isinstance(duration, t.Literal) or cast("Fraction", duration.value) <= 0:
            raise ExpressionTypeError(
                "AE209",
                "a window is a constant time longer than nothing",
                node.extent,
                cure="as in `within 5 s`",
            )
        return cast("Fraction", duration.value)

    def _call(self, node: s.Call) -> _TypedTerm:
        name, arguments = node.function.text, node.arguments
        arity = ARITY.get(name)
        if arity is None:
            cure = suggest_names(name, ARITY) or "the functions are " + ", ".join(sorted(ARITY))
            raise ExpressionTypeError(
                "AE202", f"there is no function `{name}`", node.function.extent, cure=cure
            )
        if len(arguments) != arity:
            raise ExpressionTypeError(
                "AE205", f"`{name}` takes {arity} argument(s), not {len(arguments)}", node.extent
            )
        if name in ("norm", "distance", "dot"):
            return self._vector_call(name, arguments, node.extent)
        typed = [self.check(argument) for argument in arguments]
        for argument in typed:
            if not isinstance(argument.type, RealType):
                raise ExpressionTypeError(
                    "AE203",
                    f"`{name}` takes real numbers, not {argument.type}",
                    argument.extent,
                    label=str(argument.type),
                )
            self._require_same_type(typed[0], argument, "combined with")
        reals = [self.require_rational(argument) for argument in typed]
        type_ = cast("RealType", typed[0].type)
        return _TypedTerm(
            expand_function(name, reals), VectorType(type_.dimension) if name == "vec" else type_, node.extent
        )

    def _vector_call(self, name: str, arguments: tuple[s.Node, ...], extent: s.TextRange) -> _TypedTerm:
        typed = [self.check(argument) for argument in arguments]
        vectors = [self._as_vector(argument, f"the argument of `{name}`") for argument in typed]
        (first, type_), (second, other) = vectors[0], vectors[-1]
        dimension = type_.dimension
        if name == "dot":
            product = RealType(dimension * other.dimension)
            return _TypedTerm(dot(first, second), product, extent)
        if name == "distance":
            self._require_same_type(typed[0], typed[1], "compared with")
            first = t.Add(first, t.Multiply(t.Literal(Fraction(-1), RealType(NUMBER)), second))
        return _TypedTerm(Norm(dot(first, first), dimension), RealType(dimension), extent)
