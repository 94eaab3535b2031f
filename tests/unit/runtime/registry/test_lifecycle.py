"""The life of a module: which step leads where, and that no other is taken."""

from __future__ import annotations

from itertools import product

import networkx as nx
import pytest

from aeros.runtime.registry.lifecycle import TRANSITIONS, State, Verb, after, before

LIFE = (
    Verb.INSTALL,
    Verb.CONFIGURE,
    Verb.ACTIVATE,
    Verb.DEACTIVATE,
    Verb.ACTIVATE,
    Verb.DEACTIVATE,
    Verb.REMOVE,
)


def test_the_life_of_the_paper_with_its_loop() -> None:
    state = State.ABSENT
    seen = []
    for verb in LIFE:
        reached = after(state, verb)
        assert reached is not None
        state = reached
        seen.append(state)
    active, configured = State.ACTIVE, State.CONFIGURED
    assert seen == [State.INSTALLED, configured, active, configured, active, configured, State.ABSENT]


@pytest.mark.parametrize(("state", "verb"), list(product(State, Verb)))
def test_what_is_no_step_is_refused_and_what_is_one_is_told(state: State, verb: Verb) -> None:
    assert (after(state, verb) is None) == (state not in before(verb))


def test_only_what_is_configured_becomes_active_and_what_is_active_is_not_removed() -> None:
    into = {
        state
        for (state, verb), reached in TRANSITIONS.items()
        if reached is State.ACTIVE and verb is not Verb.INSTALL
    }
    assert into == {State.CONFIGURED}
    assert after(State.ACTIVE, Verb.REMOVE) is None


def test_an_upgrade_changes_no_state_but_that_of_what_is_absent() -> None:
    kept = {state: reached for (state, verb), reached in TRANSITIONS.items() if verb is Verb.INSTALL}
    assert kept == {**{state: state for state in State}, State.ABSENT: State.INSTALLED}


def test_every_state_is_reached_and_left() -> None:
    graph = nx.DiGraph((one, reached) for (one, _), reached in TRANSITIONS.items())
    assert set(graph) == set(State)
    assert nx.is_strongly_connected(graph)
