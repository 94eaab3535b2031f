"""Lowering of typed terms to the scalar core.

The scalar core has no vectors, families, tables, quantifiers or bound variables, so back ends are small. It
is a subset of the same terms, so `semantics.evaluate` gives both sides their meaning. The conformance suite
checks `evaluate(lower(term), values_by_scalar(variables, env)) == evaluate(term, env)`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache, partial
from typing import Any

from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import constant_term
from aeros.spec.expr.semantics import Environment, Value, evaluate
from aeros.spec.expr.types import FamilyType, RealType, VectorType
from aeros.spec.expr.units import NUMBER

_ZERO, _ONE = (t.Literal(Fraction(number), RealType(NUMBER)) for number in (0, 1))
_Indices = Mapping[str, str]  # the member each bound variable stands for


@lru_cache(4096)
def scalar_variables(variable: t.Variable) -> tuple[t.Variable, ...]:
    """Return the scalar variables that a variable consists of.

    Args:
        variable: free variable of any type.

    Returns:
        `p.x`, `p.y`, `p.z` for a vector `p`; `q[member]` in index order for a family `q`; else the variable
        itself.
    """
    match variable.type:
        case VectorType(dimension=dimension):
            type_ = RealType(dimension)
            return tuple(replace(variable, name=f"{variable.name}.{axis}", type=type_) for axis in "xyz")
        case FamilyType(index=index, element=element):
            return tuple(
                replace(variable, name=f"{variable.name}[{member}]", type=element) for member in index.members
            )
        case _:
            return (variable,)


def values_by_scalar(variables: Mapping[str, t.Variable], env: Environment) -> dict[str, Value]:
    """Split an environment into values of scalar variables.

    Args:
        variables: declared variables by name.
        env: value of each of them.

    Returns:
        Value of each scalar variable by its name, as `p.x` or `q[j1]`.
    """
    scalars: dict[str, Value] = {}
    for name, variable in variables.items():
        parts = scalar_variables(variable)
        value = env[name]
        values = value if isinstance(value, tuple) else (value,)
        scalars.update(zip((part.name for part in parts), values, strict=True))
    return scalars


def values_by_variable(variables: Iterable[t.Variable], scalars: Mapping[str, Value]) -> dict[str, Value]:
    """Put values of scalar variables together, the reverse of `values_by_scalar`.

    Args:
        variables: the variables.
        scalars: value of each of their scalar variables by name.

    Returns:
        Value of each variable by its name.
    """
    values: dict[str, Any] = {}
    for one in variables:
        parts = tuple(scalars[part.name] for part in scalar_variables(one))
        is_compound = isinstance(one.type, VectorType | FamilyType)
        values[one.name] = parts if is_compound else parts[0]
    return values


def size_bounds(term: t.Term) -> tuple[int, int]:
    """Bound the size of `lower(term)` without lowering.

    A few characters can stand for more nodes than any machine holds: each `dot` repeats its vectors six
    times, and each quantifier repeats its body once for each member.

    Args:
        term: typed term.

    Returns:
        Upper bounds on the number of nodes and on the height of the lowered term.
    """
    return _size_bounds(term, {})


def _size_bounds(term: t.Term, known: dict[int, tuple[int, int]]) -> tuple[int, int]:
    """Do as `size_bounds`; `known` caches by identity, since many sub-terms are shared."""
    if id(term) in known:
        return known[id(term)]
    parts = [_size_bounds(child, known) for child in t.children(term)]
    size, height = sum(size for size, _ in parts), max((height for _, height in parts), default=0)
    match term:
        case t.Select(index=t.Literal() | t.BoundVariable()):
            size, height = 1, 1  # one element, as every bound variable stands for a member
        case t.Select():
            members = len(term.members)
            size, height = members * (size + 2), members + height
        case t.Quantified(index=index):
            size *= len(index.type.members)
        case t.Aggregate(index=index):
            members = len(index.type.members)
            size, height = members * (size + 4), members.bit_length() + height
        case t.Compare(left=left) if _is_vector(left):
            size *= 3
    known[id(term)] = (size + 3, height + 1)
    return known[id(term)]


def lower(term: t.Term) -> t.Term:
    """Rewrite a term to the scalar core and fold constants.

    Args:
        term: boolean or real term without past-time operators.

    Returns:
        Equivalent term over scalar variables, cached.
    """
    if isinstance(term, t.And):
        # A site's rules are joined anew for each skill and action kind; each rule is lowered only once.
        return junction(t.And, [lower(operand) for operand in term.operands])
    return _lower(term)


def with_constants(term: t.Term, constants: Environment) -> t.Term:
    """Lower a term in which some variables have constant values.

    Args:
        term: boolean or real term without past-time operators.
        constants: values by name, of any type; names that the term does not read are ignored.

    Returns:
        The term with these values; lowered if it reads one of them, else unchanged.
    """
    read = {name: one for name, one in t.variables_of(term).items() if name in constants}
    if not read:
        return term
    values = values_by_scalar(read, constants)
    scalars = [scalar for variable in read.values() for scalar in scalar_variables(variable)]
    return t.substitute(lower(term), {one.name: constant_term(values[one.name], one.type) for one in scalars})


@lru_cache(1024)
def _lower(term: t.Term) -> t.Term:
    return _scalar(term, {})


def _scalar(term: t.Term, indices: _Indices) -> t.Term:
    match term:
        case t.Literal() | t.Variable():
            return term
        case t.BoundVariable(name=name, type=type_):
            return t.Literal(indices[name], type_)
        case t.Select(index=index):
            return _select(term, _scalar(index, indices))
        case t.Component(vector=vector, axis=axis):
            return _components(vector, indices)[axis]
        case t.Not(operand=operand):
            return negate(_scalar(operand, indices))
        case t.And(operands=operands):
            return junction(t.And, [_scalar(operand, indices) for operand in operands])
        case t.Or(operands=operands):
            return junction(t.Or, [_scalar(operand, indices) for operand in operands])
        case t.Implies(premise=premise, conclusion=conclusion):
            return junction(t.Or, [negate(_scalar(premise, indices)), _scalar(conclusion, indices)])
        case t.Compare(left=left) if _is_vector(left):
            parts = _components(left, indices), _components(term.right, indices)
            return junction(t.And, [*map(_equal, *parts)])
        case t.Compare() | t.Add() | t.Extremum():
            return _fold(replace(term, left=_scalar(term.left, indices), right=_scalar(term.right, indices)))
        case t.Multiply(left=left, right=right):
            return _fold(t.Multiply(_scalar(left, indices), _scalar(right, indices)))
        case t.Absolute(operand=operand):
            return _fold(t.Absolute(_scalar(operand, indices)))
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            chosen = _scalar(condition, indices)
            return _if_then_else(chosen, _scalar(then, indices), _scalar(otherwise, indices))
        case t.Quantified(kind=kind, index=index, body=body):
            each = [_scalar(body, {**indices, index.name: member}) for member in index.type.members]
            return junction(t.And if kind == "all" else t.Or, each)
        case t.Aggregate(kind=kind, index=index, body=body):
            each = [_scalar(body, {**indices, index.name: member}) for member in index.type.members]
            addends = each if kind == "sum" else [_if_then_else(part, _ONE, _ZERO) for part in each]
            return _sum(addends)
        case t.Vector() | t.ConstantTable():
            raise AssertionError(f"not a scalar: {term}")
        case t.Previously() | t.Since() | t.Occurrences():
            raise AssertionError(f"not a condition on one state: {term}")


def _sum(addends: Sequence[t.Term]) -> t.Term:
    """Add numbers half by half, as back ends go down into a term by recursion."""
    if len(addends) == 1:
        return addends[0]
    middle = (len(addends) + 1) // 2
    return _add(_sum(addends[:middle]), _sum(addends[middle:]))


def _add(left: t.Term, right: t.Term) -> t.Term:
    return _fold(t.Add(left, right))


def _equal(left: t.Term, right: t.Term) -> t.Term:
    return _fold(t.Compare("==", left, right))


def _components(term: t.Term, indices: _Indices) -> tuple[t.Term, t.Term, t.Term]:
    match term:
        case t.Variable():
            return _xyz(scalar_variables(term))
        case t.Vector(x=x, y=y, z=z):
            return (_scalar(x, indices), _scalar(y, indices), _scalar(z, indices))
        case t.Add(left=left, right=right):
            return _xyz(map(_add, _components(left, indices), _components(right, indices)))
        case t.Multiply(left=left, right=right):
            factor = _scalar(left, indices)
            return _xyz(_fold(t.Multiply(factor, part)) for part in _components(right, indices))
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            choose = partial(_if_then_else, _scalar(condition, indices))
            return _xyz(map(choose, _components(then, indices), _components(otherwise, indices)))
        case _:
            raise AssertionError(f"not a vector: {term}")


def _xyz(parts: Iterable[t.Term]) -> tuple[t.Term, t.Term, t.Term]:
    x, y, z = parts
    return (x, y, z)


def _is_vector(term: t.Term) -> bool:
    match term:
        case t.Add(left=part) | t.Multiply(right=part) | t.Conditional(then=part):
            return _is_vector(part)
        case t.Variable(type=type_):
            return isinstance(type_, VectorType)
        case _:
            return isinstance(term, t.Vector)


def _select(selection: t.Select, index: t.Term) -> t.Term:
    family, type_ = selection.family, selection.family_type
    elements: Sequence[t.Term]
    if isinstance(family, t.ConstantTable):
        elements = [t.Literal(value, type_.element) for value in family.values]
    else:
        elements = scalar_variables(family)
    pairs = list(zip(type_.index.members, elements, strict=True))
    _, chosen = pairs.pop()
    for member, element in reversed(pairs):
        chosen = _if_then_else(_equal(index, t.Literal(member, type_.index)), element, chosen)
    return chosen


def _fold(term: t.Term) -> t.Term:
    """Evaluate `term` if all its operands are constants."""
    if not all(isinstance(child, t.Literal) for child in t.children(term)):
        return term
    match evaluate(term, {}):
        case Fraction() as number:
            return t.Literal(number, _real_type(term))
        case truth:
            return t.TRUE if truth else t.FALSE


def _real_type(term: t.Term) -> RealType:
    match term:
        case t.Literal(type=RealType() as type_):
            return type_
        case t.Multiply(left=left, right=right):
            return RealType(_real_type(left).dimension * _real_type(right).dimension)
        case t.Add(left=part) | t.Extremum(left=part) | t.Absolute(operand=part):
            return _real_type(part)
        case _:
            raise AssertionError(f"not a constant real: {term}")


def negate(term: t.Term) -> t.Term:
    """Negate a condition.

    Args:
        term: the condition.

    Returns:
        Its negation, without a double one.
    """
    if isinstance(term, t.Not):
        return term.operand
    return _fold(t.Not(term))


def junction(kind: type[t.And | t.Or], parts: Iterable[t.Term]) -> t.Term:
    """Join conditions by `and` or `or`, flattened and without constants.

    Args:
        kind: `And` or `Or`.
        parts: the conditions; of none the conjunction is true, and the disjunction false.

    Returns:
        The joined condition; a single one stays as it is.
    """
    flat: list[t.Term] = []
    for part in parts:
        flat.extend(part.operands if isinstance(part, kind) else (part,))
    zero, one = (t.FALSE, t.TRUE) if kind is t.And else (t.TRUE, t.FALSE)
    if zero in flat:
        return zero
    kept = tuple(part for part in flat if part != one)
    if not kept:
        return one
    return kept[0] if len(kept) == 1 else kind(kept)


def _if_then_else(condition: t.Term, then: t.Term, otherwise: t.Term) -> t.Term:
    if isinstance(condition, t.Literal):
        return then if condition.value else otherwise
    return then if then == otherwise else t.Conditional(condition, then, otherwise)
