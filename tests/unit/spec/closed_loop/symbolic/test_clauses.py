"""Clauses of sets: together they hold exactly in the set."""

from __future__ import annotations

from itertools import product

from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.closed_loop.symbolic.clauses import clauses_of
from aeros.spec.closed_loop.symbolic.program import plan_bit
from aeros.spec.closed_loop.symbolic.state_sets import StateSets

BITS = [plan_bit(number) for number in range(5)]
SETS = StateSets({one.name: (False, True) for one in BITS}, {one.name: one for one in BITS})
NAMES = [SETS.bits[one.name][0] for one in BITS]
POINTS = list(product([False, True], repeat=len(BITS)))


def union(points: set[tuple[bool, ...]]) -> object:
    found = SETS.none
    for point in points:
        found |= SETS.bdd.cube(dict(zip(NAMES, point, strict=True)))
    return found


@given(st.sets(st.sampled_from(POINTS)), st.sets(st.sampled_from(POINTS)))
def test_clauses_hold_together_exactly_in_a_set(
    states: set[tuple[bool, ...]], more: set[tuple[bool, ...]]
) -> None:
    valid = states | more
    found = clauses_of(SETS.bdd, union(states), union(valid), 100)
    assert found is not None
    for point in valid:
        values = dict(zip(NAMES, point, strict=True))
        holds = all(any(values[bit] is value for bit, value in clause) for clause in found)
        assert holds is (point in states)


def test_more_clauses_than_wanted_are_none() -> None:
    odd = {point for point in POINTS if sum(point) % 2}
    assert clauses_of(SETS.bdd, union(odd), SETS.every, 15) is None
    found = clauses_of(SETS.bdd, union(odd), SETS.every, 16)
    assert found is not None
    assert len(found) == 16


def test_everything_needs_no_clause_and_nothing_the_empty_one() -> None:
    assert clauses_of(SETS.bdd, SETS.every, SETS.every, 1) == ()
    assert clauses_of(SETS.bdd, SETS.none, SETS.every, 1) == (frozenset(),)
