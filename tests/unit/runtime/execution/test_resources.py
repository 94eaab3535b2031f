"""Laws of the resource manager, whatever is asked for and released in whatever order."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.execution.resources import ResourceQueue
from aeros.spec.diagnostics.errors import MisuseError
from tests.hypothesis_profiles import examples

NAMES = ("arm", "camera", "memory", "wheels")
CAPACITIES = st.fixed_dictionaries({name: st.integers(1, 3) for name in NAMES})
NEEDS = st.frozensets(st.sampled_from(NAMES))
MOVES = st.lists(st.one_of(NEEDS, st.integers(0, 30)), max_size=40)
"""Asking for something, or releasing what the n-th one asked for."""

small = examples(100)


def _follow(capacities: dict[str, int], moves: list[frozenset[str] | int]) -> None:
    """Each law after each move, against a model that only knows who asked for what and when."""
    manager = ResourceQueue(capacities)
    asked: list[frozenset[str]] = []
    waiting: list[int] = []
    holding: list[int] = []
    for move in moves:
        if isinstance(move, int):
            if move < len(asked):
                manager.release(move)
                waiting = [who for who in waiting if who != move]
                holding = [who for who in holding if who != move]
        else:
            manager.enqueue(len(asked), move)
            waiting.append(len(asked))
            asked.append(move)
        granted = manager.grant_ready()
        # Each once, and in the order they asked in.
        assert [who for who in waiting if who in granted] == granted
        waiting = [who for who in waiting if who not in granted]
        holding += granted
        held = {name: sum(name in asked[who] for who in holding) for name in NAMES}
        assert held == {name: manager.held_count(name) for name in NAMES}
        assert all(held[name] <= capacities[name] for name in NAMES)
        for place, who in enumerate(waiting):
            # Nobody waits for nothing: something of it is taken, or awaited by one who came before.
            taken = {name for name in asked[who] if held[name] == capacities[name]}
            awaited = set().union(*(asked[other] for other in waiting[:place]))
            assert taken or asked[who] & awaited
        if waiting:
            # The first waits for what is taken, so once that is released it is his.
            assert any(held[name] == capacities[name] for name in asked[waiting[0]])
    for _ in range(len(asked) + 1):
        for who in holding:
            manager.release(who)
        holding = manager.grant_ready()
        waiting = [who for who in waiting if who not in holding]
    assert waiting == []
    assert {manager.held_count(name) for name in NAMES} == {0}


@small
@given(CAPACITIES, MOVES)
def test_no_resource_is_lost_no_step_starves_and_none_waits_without_need(
    capacities: dict[str, int], moves: list[frozenset[str] | int]
) -> None:
    _follow(capacities, moves)


@small
@given(CAPACITIES, MOVES, NEEDS, st.lists(NEEDS, max_size=20))
def test_a_later_step_does_not_overtake_one_that_waits(
    capacities: dict[str, int],
    moves: list[frozenset[str] | int],
    needs: frozenset[str],
    later: list[frozenset[str]],
) -> None:
    """Later requests do not change what earlier ones are granted, and when."""
    alone, crowded = ResourceQueue(capacities), ResourceQueue(capacities)
    first = [move for move in moves if not isinstance(move, int)]
    for who, wanted in enumerate([*first, needs]):
        alone.enqueue(who, wanted)
        crowded.enqueue(who, wanted)
    for number, wanted in enumerate(later, len(first) + 1):
        crowded.enqueue(number, wanted)
    for _ in range(len(first) + 2):
        among = alone.grant_ready()
        others = crowded.grant_ready()
        assert [who for who in others if who <= len(first)] == among
        for who in others:
            crowded.release(who)
        for who in among:
            alone.release(who)


def test_a_step_that_needs_no_awaited_resource_goes_ahead() -> None:
    manager = ResourceQueue({"arm": 1, "camera": 1, "wheels": 1})
    for who, needs in enumerate([{"arm"}, {"arm", "camera"}, {"camera"}, {"wheels"}]):
        manager.enqueue(who, needs)
    assert manager.grant_ready() == [0, 3]
    manager.release(0)
    assert manager.grant_ready() == [1]
    manager.release(1)
    assert manager.grant_ready() == [2]


def test_a_resource_with_reduced_capacity_is_granted_again_once_it_is_free() -> None:
    manager = ResourceQueue({"camera": 2})
    for who in range(3):
        manager.enqueue(who, {"camera"})
    assert manager.grant_ready() == [0, 1]
    manager.set_capacities({"camera": 1})
    manager.release(0)
    assert manager.grant_ready() == []
    manager.release(1)
    assert manager.grant_ready() == [2]


def test_the_first_missing_part_is_named() -> None:
    manager = ResourceQueue({"arm": 1, "camera": 0})
    assert manager.never_available({"arm"}) is None
    assert manager.never_available({"arm", "camera"}) == "camera"
    assert manager.never_available({"wheels"}) == "wheels"


def test_nobody_asks_twice() -> None:
    manager = ResourceQueue({"arm": 1})
    manager.enqueue(1, {"arm"})
    with pytest.raises(MisuseError, match=r"^step 1 waits or holds resources already$"):
        manager.enqueue(1, {"arm"})
    manager.grant_ready()
    with pytest.raises(MisuseError):
        manager.enqueue(1, ())


def test_resources_that_several_steps_await_are_kept_for_them_until_they_go() -> None:
    manager = ResourceQueue({"arm": 1, "camera": 1, "wheels": 1})
    for who, needs in enumerate([{"arm"}, {"wheels"}, {"arm", "camera"}, {"wheels"}, {"camera"}]):
        manager.enqueue(who, needs)
    assert manager.grant_ready() == [0, 1]
    manager.release(2)
    assert manager.grant_ready() == [4]
