"""Types of terms by the rules of `terms.py`, without the type checker."""

from __future__ import annotations

from aeros.spec.expr import terms as t
from aeros.spec.expr.types import (
    BOOL,
    BoolType,
    EnumType,
    FamilyType,
    IntegerType,
    RealType,
    Type,
    VectorType,
)
from aeros.spec.expr.units import NUMBER, Dimension

_BOOLEAN_NODES = t.Not | t.And | t.Or | t.Implies | t.Previously | t.Since


def type_of(term: t.Term) -> Type:
    """Return the type of a term; every operand must have the type that its node demands.

    Raises:
        AssertionError: an operand has another type, or a node has a kind that there is not.
    """
    below = [type_of(child) for child in t.children(term)]
    match term:
        case t.Literal(value=value, type=type_):
            kind = {bool: BoolType, str: EnumType}.get(type(value), RealType)
            assert isinstance(type_, kind), term
            assert not isinstance(type_, EnumType) or value in type_.members, term
            assert not isinstance(type_, RealType) or isinstance(type_.dimension, Dimension), term
            return type_
        case t.Variable(type=type_) | t.BoundVariable(type=type_) | t.ConstantTable(type=type_):
            return RealType(NUMBER) if isinstance(type_, IntegerType) else type_
        case t.Select(family=family):
            assert isinstance(family.type, FamilyType), term
            assert family.type.index in below, term
            element = family.type.element
            return RealType(NUMBER) if isinstance(element, IntegerType) else element
        case t.Vector():
            assert len({_real(one) for one in below}) == 1, term
            return VectorType(_real(below[0]).dimension)
        case t.Component(axis=axis):
            assert axis in (0, 1, 2), term
            assert isinstance(below[0], VectorType), term
            return RealType(below[0].dimension)
        case t.Compare(op=op):
            left, right = below
            assert left == right, term
            assert op in ("<", "<=", "=="), term
            assert op == "==" or isinstance(left, RealType), term
            return BOOL
        case t.Add():
            left, right = below
            assert left == right, term
            assert isinstance(left, RealType | VectorType), term
            return left
        case t.Multiply():
            left, right = below
            assert isinstance(right, RealType | VectorType), term
            return type(right)(_real(left).dimension * right.dimension)
        case t.Extremum(kind=kind):
            assert kind in ("min", "max"), term
            left, right = below
            assert left == right, term
            return _real(left)
        case t.Absolute():
            return _real(below[0])
        case t.Conditional():
            condition, then, otherwise = below
            assert condition == BOOL, term
            assert then == otherwise, term
            return then
        case t.Quantified(kind=kind):
            assert kind in ("all", "any"), term
            assert below[-1] == BOOL, term
            return BOOL
        case t.Aggregate(kind=kind):
            assert kind in ("sum", "count"), term
            assert kind == "sum" or below[-1] == BOOL, term
            return _real(below[-1]) if kind == "sum" else RealType(NUMBER)
        case t.Occurrences():
            assert below == [BOOL], term
            return RealType(NUMBER)
    assert isinstance(term, _BOOLEAN_NODES), term
    assert set(below) <= {BOOL}, term
    return BOOL


def _real(type_: Type) -> RealType:
    assert isinstance(type_, RealType), type_
    return type_
