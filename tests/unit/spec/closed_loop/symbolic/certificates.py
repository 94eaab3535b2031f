"""Certificates of loops as obligations, whose terms have types."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, BoolType, EnumType, RealType, Type
from aeros.spec.obligations.closed_loop import certificate_obligations
from aeros.spec.obligations.obligation import Obligation


def certificate_of(loop: SymbolicLoop) -> list[Obligation]:
    """The obligations of a loop's certificate."""
    made = list(certificate_obligations(loop.system.task, loop.certificate()))
    for one in made:
        declared = {each.name: each.variable for each in one.space.variables}
        for term in (*one.space.assumptions, one.conclusion):
            assert type_of(term) == BOOL
            assert all(declared[name] == each for name, each in t.variables_of(term).items())
    return made


def type_of(term: t.Term) -> Type:
    """Type of a lowered term, of which each part has the type that its place needs."""
    match term:
        case t.Variable(type=type_):
            return RealType(type_.dimension) if isinstance(type_, RealType) else type_
        case t.Literal(value=value, type=type_):
            assert isinstance(value, {BoolType: bool, EnumType: str}.get(type(type_), Fraction))
            return RealType(type_.dimension) if isinstance(type_, RealType) else type_
        case t.Compare(op=op, left=left, right=right):
            assert op in ("==", "<", "<=")
            assert op == "==" or isinstance(type_of(left), RealType)
            assert type_of(left) == type_of(right)
            return BOOL
        case t.Add(left=left, right=right) | t.Extremum(left=left, right=right):
            assert type_of(left) == type_of(right)
            assert isinstance(type_of(left), RealType)
            return type_of(left)
        case t.Absolute(operand=operand):
            return type_of(operand)
        case _:
            assert isinstance(term, t.Not | t.And | t.Or | t.Implies), term
            assert all(type_of(one) == BOOL for one in t.children(term))
            return BOOL
