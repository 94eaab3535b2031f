"""What a term means: the exact, slow interpreter.  This is the definition; back ends agree with it.

Values are bool, `Fraction` (SI; a double is the rational it denotes), enum members as str,
3-tuples of `Fraction` for vectors, and tuples in index order for families.  Evaluation is total:
every well-typed term has a value under every environment that gives its free variables values of
their types.  There is no division, and no operand that
could fail, so stopping early cannot hide anything.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import cast

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import FamilyType

Value = bool | Fraction | str | tuple[Fraction, ...] | tuple[bool, ...]
Environment = Mapping[str, Value]


def evaluate(term: t.Term, env: Environment) -> Value:
    """The value of `term` where `env` gives each free variable's value by name."""
    match term:
        case t.Literal(value=value):
            return value
        case t.Variable(name=name) | t.BoundVariable(name=name):
            return env[name]
        case t.Table(values=values):
            return values
        case t.Select(family=family, index=index):
            member = evaluate(index, env)
            position = cast("FamilyType", family.type).index.members.index(cast("str", member))
            return cast("tuple[Fraction | bool, ...]", evaluate(family, env))[position]
        case t.Vector(x=x, y=y, z=z):
            return (_real(x, env), _real(y, env), _real(z, env))
        case t.Component(vector=vector, axis=axis):
            return _vector(vector, env)[axis]
        case t.Not(operand=operand):
            return not holds(operand, env)
        case t.And(operands=operands):
            return all(holds(operand, env) for operand in operands)
        case t.Or(operands=operands):
            return any(holds(operand, env) for operand in operands)
        case t.Implies(premise=premise, conclusion=conclusion):
            return (not holds(premise, env)) or holds(conclusion, env)
        case t.Compare(op="==", left=left, right=right):
            return evaluate(left, env) == evaluate(right, env)
        case t.Compare(op="<", left=left, right=right):
            return _real(left, env) < _real(right, env)
        case t.Compare(left=left, right=right):
            return _real(left, env) <= _real(right, env)
        case t.Add(left=left, right=right):
            return _add(evaluate(left, env), evaluate(right, env))
        case t.Multiply(left=left, right=right):
            return _scale(_real(left, env), evaluate(right, env))
        case t.Extremum(kind="min", left=left, right=right):
            return min(_real(left, env), _real(right, env))
        case t.Extremum(left=left, right=right):
            return max(_real(left, env), _real(right, env))
        case t.Absolute(operand=operand):
            return abs(_real(operand, env))
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            return evaluate(then if holds(condition, env) else otherwise, env)
        case t.Quantified(kind=kind, index=index, body=body):
            each = [holds(body, {**env, index.name: member}) for member in index.type.members]
            return all(each) if kind == "all" else any(each)
        case t.Aggregate(kind="sum", index=index, body=body):
            members = index.type.members
            return sum((_real(body, {**env, index.name: member}) for member in members), Fraction(0))
        case t.Aggregate(index=index, body=body):
            return Fraction(sum(holds(body, {**env, index.name: member}) for member in index.type.members))


def holds(term: t.Term, env: Environment) -> bool:
    """Whether the boolean `term` is true under `env`."""
    return cast("bool", evaluate(term, env))


def _real(term: t.Term, env: Environment) -> Fraction:
    return cast("Fraction", evaluate(term, env))


def _vector(term: t.Term, env: Environment) -> tuple[Fraction, ...]:
    return cast("tuple[Fraction, ...]", evaluate(term, env))


def _add(left: Value, right: Value) -> Value:
    if isinstance(left, Fraction):
        return left + cast("Fraction", right)
    pairs = zip(cast("tuple[Fraction, ...]", left), cast("tuple[Fraction, ...]", right), strict=True)
    return tuple(a + b for a, b in pairs)


def _scale(factor: Fraction, value: Value) -> Value:
    if isinstance(value, Fraction):
        return factor * value
    return tuple(factor * component for component in cast("tuple[Fraction, ...]", value))
