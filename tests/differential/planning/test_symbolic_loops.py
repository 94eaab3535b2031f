"""Loops by sets of states against the same loops state by state; a certificate where nothing is wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import pytest

from aeros.spec.closed_loop.findings import LoopFindings, LoopPath
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.reachability import ReachableStates, UnlistedStatesError, explore_system
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.symbolic.program import PLAN, Place
from aeros.spec.closed_loop.transition_system import LoopState, TransitionSystem
from aeros.spec.obligations.closed_loop import closed_loop_obligations
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.differential.planning.number_loops import Loop, composed_loop, number_loop, stopped_loop
from tests.unit.spec.closed_loop.symbolic.certificates import certificate_of

SEEN: Counter[str] = Counter()


def answers(found: LoopFindings) -> dict[str, bool]:
    """Answer of an engine to each claim about a loop: true if it holds."""
    return {
        "AE801": found.blocked_step() is None,
        "AE802": found.dead_end() is None,
        "AE805": not found.starts_at_goal(),
        "choices": not found.has_choices,
    } | {f"AE804 {one.id}": found.violation(one) is None for one in found.system.task.invariants}


def compare(make: Callable[[int], Loop], seed: int) -> None:
    try:
        system = TransitionSystem(*make(seed))
        listed = explore_system(system)
    except (StateSpaceError, UnlistedStatesError):
        SEEN["undecided"] += 1
        return
    compare_engines(listed)


def compare_engines(listed: ReachableStates) -> None:
    """Compare all answers about a loop whose states are listed; check the certificate if it has no fault."""
    by_sets = SymbolicLoop(listed.system)
    expected = answers(listed)
    found = answers(by_sets)
    for engine in (by_sets, listed):
        assert_paths_are_runs(engine, listed)
    if listed.system.inexact_reason:
        # The list has states in which parallel branches stop at points at which they may not.
        SEEN["more precise"] += found != expected
        assert all(found[claim] for claim, holds in expected.items() if holds and claim != "choices")
    else:
        assert found == expected
        assert_same_states(by_sets, listed)
    for claim, holds in expected.items():
        SEEN[f"{claim.split()[0]} {holds}"] += 1
    if all(holds for claim, holds in found.items() if claim not in ("choices", "AE805")):
        SEEN["proved"] += 1
        results = discharge_obligations(certificate_of(by_sets))
        assert {one.verdict for one in results} == {Verdict.PROVED}


def assert_paths_are_runs(found: LoopFindings, listed: ReachableStates) -> None:
    """Each path begins at a start and ends where the fault is."""
    starts = {node.state for node in listed.graph if node not in listed.predecessors}
    stuck = {node.state for node in listed.nodes_that_can_miss_goal()}
    blocked, dead_end = found.blocked_step(), found.dead_end()
    for path in (dead_end, None if blocked is None else blocked.path):
        assert path is None or path.end in {node.state for node in ends_of_runs(found.system, path)}
    if dead_end is not None:
        assert dead_end.start in starts
        assert dead_end.end in stuck
    if blocked is not None:
        assert blocked.path.start in starts
        index = found.system.task.rules.index(blocked.rule)
        due = LoopState("try", blocked.path.end, (index,))
        assert found.system.blocked_step(due) == (blocked.rule, blocked.skill)
    states = {node.state for node in listed.graph} | listed.through.keys()
    for invariant in found.system.task.invariants:
        path = found.violation(invariant)
        if path is not None:
            assert path.start in starts
            assert path.end in states
            nodes = ends_of_runs(found.system, path)
            if path.inside:
                moves = [move for node in nodes for move in found.system.transitions(node)]
                moves = [move for move in moves if move.label.startswith(f"{path.inside} → ")]
                assert any(path.end in move.through for move in moves)
            else:
                assert path.end in {node.state for node in nodes}
            assert not found.system.condition(invariant.term)(path.end)


def ends_of_runs(system: TransitionSystem, path: LoopPath) -> set[LoopState]:
    """States in which the runs may end whose labelled moves are those of a path."""
    ends = {LoopState("plan", path.start)}
    for label in (*path.labels, ""):
        pending, passed = list(ends), set(ends)
        while pending:
            silent = {one.target for one in system.transitions(pending.pop()) if not one.label} - passed
            passed |= silent
            pending += silent
        ends = passed if not label else set()
        for node in passed if label else ():
            ends |= {move.target for move in system.transitions(node) if move.label == label}
    return ends


def assert_same_states(by_sets: SymbolicLoop, listed: ReachableStates) -> None:
    """Each place of the program has the states that are listed, and the same have the goal within reach."""
    sets, reachable, bits = by_sets.fixpoints.sets, by_sets.fixpoints.reachable, by_sets.program.plan_bits
    width = sum(len(sets.bits[name]) for name in sets.after_names)
    found: dict[Place, dict[LoopState, dict[str, object]]] = {
        place: {} for place in reachable if is_listed(place)
    }
    stuck = {node.state for node in listed.nodes_that_can_miss_goal()}
    for node in (tried_next(by_sets.system, one) for one in listed.graph):
        rest = node.remaining_rules
        place = Place(node.phase, rest[0] if rest else 0, node.tries if node.phase != "reset" else 0)
        if place in found:
            due = {bit: at in rest[1:] for at, bit in enumerate(bits)}
            found[place][node] = {**by_sets.system.named(node.state), **due}
            if place == PLAN:
                hopeful = by_sets.fixpoints.hopeful[-1][PLAN]
                assert sets.contains(hopeful, found[place][node]) is (node.state not in stuck)
    for place, states in found.items():
        assert sets.bdd.count(reachable[place] & sets.valid, width) == len(states)
        assert all(sets.contains(reachable[place], state) for state in states.values())


def tried_next(system: TransitionSystem, node: LoopState) -> LoopState:
    """A state before a further try; where nothing runs between tries, the program has no place before it."""
    if node.phase != "recover" or system.task.rules[node.remaining_rules[0]].between_tries is not None:
        return node
    return replace(node, phase="try")


def is_listed(place: Place) -> bool:
    """Tell whether the states of a place are nodes of the list, each once."""
    return place.kind != "inside" and (place.kind != "try" or place.tries > 0)


def assert_same_faults(make: Callable[[int], Loop], seeds: range) -> None:
    SEEN.clear()
    for seed in seeds:
        compare(make, seed)
    assert SEEN["undecided"] < len(seeds) / 10
    assert SEEN["proved"] > len(seeds) / 50
    for code in ("AE801", "AE802", "AE804"):
        assert min(SEEN[f"{code} True"], SEEN[f"{code} False"]) > len(seeds) / 30


_MANY = pytest.param(range(1000, 4000), marks=pytest.mark.deep)


@pytest.mark.parametrize("seeds", [range(80), _MANY], ids=["few", "many"])
def test_sets_of_states_have_the_same_faults_as_listed_states(seeds: range) -> None:
    assert_same_faults(number_loop, seeds)


@pytest.mark.parametrize("seeds", [range(28, 60), _MANY], ids=["few", "many"])
def test_so_they_have_inside_compositions(seeds: range) -> None:
    assert_same_faults(composed_loop, seeds)


@pytest.mark.parametrize("seeds", [range(1, 12), pytest.param(range(12, 60), marks=pytest.mark.deep)])
def test_sets_of_states_have_the_same_faults_where_a_counting_step_may_be_stopped(seeds: range) -> None:
    SEEN.clear()
    for seed in seeds:
        compare(stopped_loop, seed)
    assert SEEN["undecided"] < len(seeds) / 5
    for claim in ("AE801 True", "AE802 False", "AE804 True", "AE804 False"):
        assert SEEN[claim] > 0, SEEN


def test_the_claims_of_a_module_are_the_same_where_its_states_are_not_listed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ecm, _, site = number_loop(3)
    listed = {str(one.id) for one in closed_loop_obligations(ecm, site)}
    monkeypatch.setattr("aeros.spec.closed_loop.reachability.MAX_STARTS", 0)
    by_sets = {str(one.id) for one in closed_loop_obligations(ecm, site)}
    assert listed == {one for one in by_sets if "/certificate/" not in one}
