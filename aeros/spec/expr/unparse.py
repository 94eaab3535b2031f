"""Text of a term in the expression language, for terms that nobody wrote."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import RealType
from aeros.spec.expr.units import NUMBER, TIME, Dimension, exact_decimal

_MINUS_ONE = t.Literal(Fraction(-1), RealType(NUMBER))


def unparse(term: t.Term) -> str:
    """Write a term as an expression that means it.

    Args:
        term: any term.

    Returns:
        Text in SI units, with brackets around every operand that is more than a name.
    """
    match term:
        case t.Literal(value=bool(value)):
            return "true" if value else "false"
        case t.Literal(value=Fraction() as value, type=RealType(dimension=dimension)):
            return _number(value, dimension)
        case t.Literal(value=value):
            return str(value)
        case t.Variable(name=name) | t.BoundVariable(name=name) | t.ConstantTable(name=name):
            return name
        case t.Select(family=family, index=index):
            return f"{unparse(family)}[{unparse(index)}]"
        case t.Vector(x=x, y=y, z=z):
            return f"vec({unparse(x)}, {unparse(y)}, {unparse(z)})"
        case t.Component(vector=vector, axis=axis):
            return f"{_operand(vector)}.{'xyz'[axis]}"
        case t.Not(operand=operand):
            return f"not {_operand(operand)}"
        case t.And(operands=operands):
            return " and ".join(map(_operand, operands)) or "true"
        case t.Or(operands=operands):
            return " or ".join(map(_operand, operands)) or "false"
        case t.Implies(premise=premise, conclusion=conclusion):
            return f"{_operand(premise)} implies {_operand(conclusion)}"
        case t.Compare(op=op, left=left, right=right):
            return f"{_operand(left)} {op} {_operand(right)}"
        case t.Add(left=left, right=t.Multiply(left=t.Literal() as sign, right=right)) if sign == _MINUS_ONE:
            return f"{_operand(left)} - {_operand(right)}"
        case t.Add(left=left, right=right):
            return f"{_operand(left)} + {_operand(right)}"
        case t.Multiply(left=left, right=right):
            return f"{_operand(left)} * {_operand(right)}"
        case t.Extremum(kind=kind, left=left, right=right):
            return f"{kind}({unparse(left)}, {unparse(right)})"
        case t.Absolute(operand=operand):
            return f"abs({unparse(operand)})"
        case t.Conditional(condition=condition, then=then, otherwise=otherwise):
            return f"if {_operand(condition)} then {_operand(then)} else {_operand(otherwise)}"
        case t.Quantified(kind=kind, index=index, body=body) | t.Aggregate(kind=kind, index=index, body=body):
            return f"{kind}({unparse(body)} for {index.name} in {index.type.name})"
        case t.Previously(operand=operand):
            return f"previously {_operand(operand)}"
        case t.Since(sustained=t.Literal(value=True), trigger=reset, window_s=within):
            return f"once {_window(within)}{_operand(reset)}"
        case t.Since(sustained=kept, trigger=reset, window_s=within):
            return f"{_operand(kept)} since {_window(within)}{_operand(reset)}"
        case t.Occurrences(operand=operand, window_s=within):
            return f"count {_window(within)}({unparse(operand)})"


def _operand(term: t.Term) -> str:
    closed = t.Variable | t.BoundVariable | t.Select | t.Vector | t.Extremum | t.Absolute
    text = unparse(term)
    bare = isinstance(term, closed) or (isinstance(term, t.Literal) and text[0] != "-")
    return text if bare else f"({text})"


def _window(window_s: Fraction | None) -> str:
    return "" if window_s is None else f"within {_number(window_s, TIME)} "


def _number(value: Fraction, dimension: Dimension) -> str:
    unit = "" if dimension == NUMBER else f" {dimension}"
    shown = exact_decimal(value)
    return f"({value.numerator}{unit} / {value.denominator})" if shown is None else f"{shown}{unit}"
