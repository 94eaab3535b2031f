"""Fixpoints: reachable states, plans to the goal, and rings around states."""

from __future__ import annotations

import pytest

from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.symbolic import fixpoints
from aeros.spec.closed_loop.symbolic.program import PLAN, REACHED
from tests.differential.planning.number_loops import term
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import COOKED, WRAPPED, counting, loop


def test_states_at_the_end_have_the_goal() -> None:
    found = loop().fixpoints
    cooked = found.sets.where(term(COOKED))
    assert found.reachable[REACHED] & ~cooked == found.sets.none
    assert found.reachable[REACHED] != found.sets.none


def test_each_count_takes_one_plan_more() -> None:
    found = counting().fixpoints
    sizes = [found.sets.bdd.count(one[PLAN] & found.sets.valid) for one in found.hopeful]
    assert len(sizes) == 4
    assert sizes == sorted(set(sizes))
    assert found.hopeful[-1][PLAN] == found.reachable[PLAN]


def test_rings_lead_from_a_start_to_the_states() -> None:
    found = loop(initial={COOKED: False, WRAPPED: False}).fixpoints
    rings = found.rings({REACHED: found.sets.every})
    assert rings[-1][PLAN] & found.start != found.sets.none
    assert all(ring.get(PLAN, found.sets.none) & found.start == found.sets.none for ring in rings[:-1])


@pytest.mark.parametrize(("limit", "value"), [("MAX_IMAGES", 5), ("MAX_NODES", 10)])
def test_the_work_has_a_limit(limit: str, value: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fixpoints, limit, value)
    with pytest.raises(StateSpaceError, match=r"^it has too many states, also as decision diagrams$"):
        _ = counting().fixpoints.hopeful


def test_the_limit_is_the_largest_number_of_images(monkeypatch: pytest.MonkeyPatch) -> None:
    made = counting().fixpoints
    assert made.hopeful
    monkeypatch.setattr(fixpoints, "MAX_IMAGES", made._images)
    assert counting().fixpoints.hopeful
    monkeypatch.setattr(fixpoints, "MAX_IMAGES", made._images - 1)
    with pytest.raises(StateSpaceError):
        _ = counting().fixpoints.hopeful


@pytest.mark.parametrize(
    ("fact", "agreeing"), [(f"not {COOKED}", f"not {COOKED}"), ("false", "true"), ("true", "true")]
)
def test_starts_agree_with_definitions_unless_none_does(fact: str, agreeing: str) -> None:
    given = loop().fixpoints
    found = fixpoints.Fixpoints(given.program, given.starts, given.sets, (term(fact),))
    assert found.start == given.start & given.sets.where(term(agreeing))
    assert found.start_facts == (() if fact == "false" else (term(fact),))
    assert found.reachable[PLAN] & ~given.reachable[PLAN] == given.sets.none
