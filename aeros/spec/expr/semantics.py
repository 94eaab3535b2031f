"""Exact, slow interpreter of terms: the definition that all back ends agree with.

Values are bool, `Fraction` (SI; a double is the rational it denotes), enum members as str, 3-tuples of
`Fraction` for vectors, and tuples in index order for families. Evaluation is total: every well-typed term has
a value under every environment that gives its free variables values of their types. There is no division, and
no operand can fail, so stopping early cannot hide an error.

Past-time operators look back along a trace: the measured states up to and including the present one. Without
a trace, the present state is the first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple, cast

from aeros.spec.expr import terms as t

Value = bool | Fraction | str | tuple[Fraction, ...] | tuple[bool, ...]
Environment = Mapping[str, Value]


class TimedState(NamedTuple):
    """State measured at one time.

    Attributes:
        time: plant time, s.
        values: value of each variable, SI.
    """

    time: Fraction
    values: Environment


Trace = Sequence[TimedState]
"""States in order of time; the last is the present one."""


def evaluate(term: t.Term, env: Environment, trace: Trace = ()) -> Value:
    """Compute the value of a term.

    Args:
        term: well-typed term.
        env: value of each free variable and of each enclosing quantifier's index, by name.
        trace: states that past-time operators look back along; the last one is `env`. Empty if there is no
            past.

    Returns:
        Truth value, exact real (SI), enum member, vector or family.
    """
    match term:
        case t.Literal(value=value):
            return value
        case t.Variable(name=name) | t.BoundVariable(name=name):
            return env[name]
        case t.ConstantTable(values=values):
            return values
        case t.Select(family=family, index=index):
            member: Any = evaluate(index, env, trace)
            return _part(evaluate(family, env), term.members.index(member))
        case t.Vector(x=x, y=y, z=z):
            return (_real(x, env, trace), _real(y, env, trace), _real(z, env, trace))
        case t.Component(vector=vector, axis=axis):
            return _part(evaluate(vector, env, trace), axis)
        case t.Not(operand=operand):
            return not is_true(operand, env, trace)
        case t.And(operands=operands):
            return all(is_true(operand, env, trace) for operand in operands)
        case t.Or(operands=operands):
            return any(is_true(operand, env, trace) for operand in operands)
        case t.Implies(premise=premise, conclusion=conclusion):
            return (not is_true(premise, env, trace)) or is_true(conclusion, env, trace)
        case t.Compare(op="==", left=left, right=right):
            return evaluate(left, env, trace) == evaluate(right, env, trace)
        case t.Compare(op="<", left=left, right=right):
            return _real(left, env, trace) < _real(right, env, trace)
        case t.Compare(left=left, right=right):
            return _real(left, env, trace) <= _real(right, env, trace)
        case t.Add(left=left, right=right):
            return _add(evaluate(left, env, trace), evaluate(right, env, trace))
        case t.Multiply(left=left, right=right):
            return _scale(_real(left, env, trace), evaluate(right, env, trace))
        case t.Extremum(kind="min", left=left, right=right):
            return min(_real(left, env, trace), _real(right, env, trace))
        case t.Extremum(left=left, right=right):
            return max(_real(left, env, trace), _real(right, env, trace))
        case t.Absolute(operand=operand):
            return abs(_real(operand, env, trace))
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            return evaluate(then if is_true(condition, env, trace) else otherwise, env, trace)
        case t.Quantified(kind=kind, index=index, body=body):
            each = (is_true(body, {**env, index.name: member}, trace) for member in index.type.members)
            return all(each) if kind == "all" else any(each)
        case t.Aggregate(index=index, body=body):  # `count` adds truth values, of which True is 1
            addends = (_real(body, {**env, index.name: member}, trace) for member in index.type.members)
            return Fraction(sum(addends))
        case t.Previously(operand=operand):
            return len(trace) > 1 and _held_at_end(operand, env, trace[:-1])
        case t.Since(sustained=kept, trigger=reset, window_s=within):
            return _evaluate_since(kept, reset, within, env, trace or _first_state(env))
        case t.Occurrences(operand=operand, window_s=within):
            looked_at = trace or _first_state(env)
            ends = [end for end in range(1, len(looked_at) + 1) if _age_of_last(looked_at, end) <= within]
            return Fraction(sum(_held_at_end(operand, env, looked_at[:end]) for end in ends))


def is_true(term: t.Term, env: Environment, trace: Trace = ()) -> bool:
    """Evaluate a boolean term.

    Args:
        term: well-typed boolean term.
        env: value of each free variable, by name.
        trace: states that past-time operators look back along, as in `evaluate`.

    Returns:
        The truth value of `term`.
    """
    return cast("bool", evaluate(term, env, trace))


def _first_state(env: Environment) -> Trace:
    """Return the trace of a present state that is the first; its time has no effect."""
    return (TimedState(Fraction(), env),)


def _evaluate_since(
    sustained: t.Term, reset: t.Term, window_s: Fraction | None, env: Environment, trace: Trace
) -> bool:
    """Look back state by state until `reset` held, `sustained` did not hold, or the window ends."""
    for end in range(len(trace), 0, -1):
        if window_s is not None and _age_of_last(trace, end) > window_s:
            return False
        if _held_at_end(reset, env, trace[:end]):
            return True
        if not _held_at_end(sustained, env, trace[:end]):
            return False
    return False


def _age_of_last(trace: Trace, end: int) -> Fraction:
    """Return the seconds from the last state of `trace[:end]` to the present."""
    return trace[-1].time - trace[end - 1].time


def _held_at_end(term: t.Term, env: Environment, then: Trace) -> bool:
    """Evaluate `term` at the last state of `then`; quantifier indices keep the members they have in `env`."""
    return is_true(term, {**env, **then[-1].values}, then)


def _real(term: t.Term, env: Environment, trace: Trace) -> Fraction:
    return cast("Fraction", evaluate(term, env, trace))


def _part(value: Any, position: int) -> Value:
    part: Value = value[position]
    return part


def _add(left: Any, right: Any) -> Value:
    if isinstance(left, tuple):
        return tuple([a + b for a, b in zip(left, right, strict=True)])
    total: Fraction = left + right
    return total


def _scale(factor: Fraction, value: Any) -> Value:
    if isinstance(value, tuple):
        return tuple([factor * component for component in value])
    product: Fraction = factor * value
    return product
