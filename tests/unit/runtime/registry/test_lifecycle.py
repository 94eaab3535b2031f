"""The life of a module: which step leads where, and that no other is taken."""

from __future__ import annotations

from itertools import product

import networkx as nx
import pytest

from aeros.runtime.registry.lifecycle import (
    TRANSITIONS,
    LifecycleAction,
    ModuleState,
    allowed_states,
    next_state,
)

LIFE = (
    LifecycleAction.INSTALL,
    LifecycleAction.CONFIGURE,
    LifecycleAction.ACTIVATE,
    LifecycleAction.DEACTIVATE,
    LifecycleAction.ACTIVATE,
    LifecycleAction.DEACTIVATE,
    LifecycleAction.REMOVE,
)


def test_the_life_of_the_paper_with_its_loop() -> None:
    state = ModuleState.ABSENT
    seen = []
    for verb in LIFE:
        reached = next_state(state, verb)
        assert reached is not None
        state = reached
        seen.append(state)
    active, configured = ModuleState.ACTIVE, ModuleState.CONFIGURED
    assert seen == [
        ModuleState.INSTALLED,
        configured,
        active,
        configured,
        active,
        configured,
        ModuleState.ABSENT,
    ]


@pytest.mark.parametrize(("state", "verb"), list(product(ModuleState, LifecycleAction)))
def test_a_transition_exists_exactly_from_the_allowed_states(
    state: ModuleState, verb: LifecycleAction
) -> None:
    assert (next_state(state, verb) is None) == (state not in allowed_states(verb))


def test_only_what_is_configured_becomes_active_and_what_is_active_is_not_removed() -> None:
    into = {
        state
        for (state, verb), reached in TRANSITIONS.items()
        if reached is ModuleState.ACTIVE and verb is not LifecycleAction.INSTALL
    }
    assert into == {ModuleState.CONFIGURED}
    assert next_state(ModuleState.ACTIVE, LifecycleAction.REMOVE) is None


def test_an_upgrade_changes_no_state_but_that_of_what_is_absent() -> None:
    kept = {
        state: reached for (state, verb), reached in TRANSITIONS.items() if verb is LifecycleAction.INSTALL
    }
    assert kept == {**{state: state for state in ModuleState}, ModuleState.ABSENT: ModuleState.INSTALLED}


def test_every_state_is_reached_and_left() -> None:
    graph = nx.DiGraph((one, reached) for (one, _), reached in TRANSITIONS.items())
    assert set(graph) == set(ModuleState)
    assert nx.is_strongly_connected(graph)
