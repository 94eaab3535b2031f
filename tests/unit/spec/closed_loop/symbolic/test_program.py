"""Pieces of programs: joined conditions, and names of values afterwards."""

from __future__ import annotations

from aeros.spec.closed_loop.symbolic.program import (
    REACHED,
    Place,
    afterwards,
    all_of,
    any_of,
    plan_bit,
    step,
)
from aeros.spec.expr import terms as t
from aeros.spec.expr.lower import negate

A, B = plan_bit(0), plan_bit(1)


def test_conditions_are_joined_without_constants() -> None:
    assert all_of() == t.TRUE
    assert all_of(A, t.TRUE) == A
    assert all_of(A, t.FALSE, B) == t.FALSE
    assert all_of(A, B) == t.And((A, B))
    assert any_of([]) == t.FALSE
    assert any_of([t.FALSE, B]) == B
    assert any_of([A, t.TRUE]) == t.TRUE
    assert any_of([A, B]) == t.Or((A, B))


def test_a_negation_is_not_negated_again() -> None:
    assert negate(negate(A)) == A
    assert negate(t.TRUE) == t.FALSE
    assert negate(t.FALSE) == t.TRUE


def test_names_differ() -> None:
    assert len({A.name, B.name, afterwards(A).name}) == 3
    assert afterwards(A).type == A.type
    assert {one.role for one in (A, afterwards(A))} == {t.VariableRole.STATE}


def test_a_step_always_leads_to_its_target() -> None:
    (branch,) = step(A, REACHED, {B.name: t.FALSE}).branches
    assert [(end.guard, end.target) for end in branch.ends] == [(t.TRUE, Place("reached"))]
    assert branch.updates == {B.name: t.FALSE}
    assert branch.is_likely
