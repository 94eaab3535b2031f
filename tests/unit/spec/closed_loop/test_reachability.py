"""Reachable states of a task, nearest first, and those that may never reach the goal."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop import reachability
from aeros.spec.closed_loop.findings import format_path
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.reachability import ReachableStates, explore_task
from aeros.spec.closed_loop.transition_system import LoopState
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import Outcome, PlanningRule, Skill, Task, TaskInvariant
from aeros.spec.model.perception import Definition
from tests.differential.planning.test_symbolic_loops import compare_engines
from tests.unit.agent.dumplings import SPAN, module, outcome, rule, site, skill, task, term
from tests.unit.spec.consequences import places

WRAPPED, COOKED = "dumpling_wrapped", "dumpling_cooked"
CLEAN = {WRAPPED: False, COOKED: False}
WRAP = skill("wrap", outcome("wrapped", {WRAPPED: True}), outcome("torn", {}, failure=True))
BOIL = skill("boil", outcome("cooked", {COOKED: True}), precondition=WRAPPED)
WAIT = skill("wait", outcome("waited", {}))
WRAPPING, COOKING = rule(WRAPPED, "wrap"), rule(COOKED, "cooking")


def explored(
    *rules: PlanningRule,
    skills: tuple[Skill, ...] = (WRAP, BOIL),
    initial: dict[str, Any] = CLEAN,
    cooking: tuple[str, ...] = ("boil",),
) -> ReachableStates:
    pursued = replace(task("cook", ("cook",), COOKED, *rules), initial=initial)
    ecm = replace(module("kitchen", skills, pursued), capabilities={"cooking": cooking})
    return explore_task(ecm, pursued, site())


def test_nodes_are_found_nearest_first_each_once() -> None:
    none, wrapped, both = (False, False), (False, True), (True, True)
    assert list(explored(WRAPPING, COOKING).graph) == [
        LoopState("plan", none),
        LoopState("try", none, (0, 1)),
        LoopState("try", wrapped, (1,)),
        LoopState("try", both),
        LoopState("reached", both),
    ]


def test_starts_agree_with_initial_and_have_every_value_of_the_rest() -> None:
    starts = [
        node for node in explored(WRAPPING, COOKING, initial={WRAPPED: True}).graph if node.phase == "plan"
    ]
    assert [node.state for node in starts] == [(False, True), (True, True)]
    assert len([node for node in explored(WRAPPING, COOKING, initial={}).graph if node.phase == "plan"]) == 4


def test_a_trace_is_the_shortest_way_with_its_labels() -> None:
    found = explored(WRAPPING, COOKING)
    (end,) = (node for node in found.graph if node.phase == "reached")
    assert format_path(found.system, found.path(end)).splitlines() == [
        "for example:",
        "start with dumpling_cooked = false, dumpling_wrapped = false",
        "wrap → wrapped",
        "boil → cooked",
        "then dumpling_cooked = true, dumpling_wrapped = true",
    ]
    start = next(iter(found.graph))
    assert format_path(found.system, found.path(start)).splitlines()[1:] == [
        f"{word} dumpling_cooked = false, dumpling_wrapped = false" for word in ("start with", "then")
    ]


def stuck(found: ReachableStates) -> list[tuple[Any, ...]]:
    return [node.state for node in found.nodes_that_can_miss_goal()]


def test_no_state_misses_the_goal_that_some_outcome_of_each_choice_reaches() -> None:
    assert stuck(explored(WRAPPING, COOKING)) == []
    eager = skill("boil", outcome("cooked", {COOKED: True}))
    both = (WRAP, eager, WAIT)
    assert stuck(explored(WRAPPING, COOKING, skills=both)) == []
    assert stuck(explored(WRAPPING, COOKING, skills=both, cooking=("boil", "wait"))) == [
        (False, False),
        (False, True),
    ]


def test_a_state_whose_plan_is_rejected_misses_the_goal() -> None:
    found = explored(rule(f"{WRAPPED} or {COOKED}", "wrap"))
    assert stuck(found) == [(False, False), (False, True)]
    assert [node.state for node in found.graph if node.phase == "rejected"] == [(False, True)]


def test_a_move_of_no_probability_is_no_way_to_the_goal_but_is_reachable() -> None:
    boil = skill("boil", Outcome("raw", {}, False, Fraction(1), None), outcome("cooked", {COOKED: True}))
    found = explored(COOKING, skills=(boil,), initial={COOKED: False})
    assert any(node.phase == "reached" for node in found.graph)
    assert stuck(found) == [(False,)]


@pytest.mark.parametrize(
    ("limit", "most", "initial", "message"),
    [
        ("MAX_STARTS", 4, {}, "it has too many start states"),
        ("MAX_NODES", 5, CLEAN, "it has too many states"),
    ],
)
def test_a_state_space_is_explored_up_to_its_limit(
    limit: str, most: int, initial: dict[str, Any], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reachability, limit, most)
    assert explored(WRAPPING, COOKING, initial=initial).graph
    monkeypatch.setattr(reachability, limit, most - 1)
    with pytest.raises(StateSpaceError, match=f"^{message}$"):
        explored(WRAPPING, COOKING, initial=initial)


@pytest.mark.parametrize(("effects", "misses"), [({}, True), ({"m.docked": True}, False)])
def test_a_goal_that_a_step_may_leave_true_or_false_is_not_within_reach(
    effects: dict[str, bool], misses: bool
) -> None:
    goal = PlanningRule(places.term("m.docked"), "m.docked", "go", {}, 0, None, None, SPAN)
    arrive = Task("arrive", (), places.term("m.docked"), "m.docked", (goal,), {"m.docked": False}, None, SPAN)
    ecm = module("m", (places.asking("go", outcome("gone", effects), outcome("blocked", {}, failure=True)),))
    reachable = explore_task(replace(ecm, definitions=places.DEFINITIONS), arrive, places.site())
    assert any(reachable.nodes_that_can_miss_goal()) is misses
    assert ("may be either after `go" in reachable.system.inexact_reason) is misses


def test_a_goal_that_both_values_of_an_open_predicate_lead_to_is_within_reach() -> None:
    """The drive leaves `m.docked` true or false; each way, a plan goes on to what is held."""
    going, holding = (
        PlanningRule(places.term(text), text, name, {}, 0, None, None, SPAN)
        for text, name in (("m.docked", "go"), ("holding", "grab"))
    )
    pursued = Task("get", (), places.term("holding"), "holding", (going, holding), {}, None, SPAN)
    ecm = module(
        "m",
        (
            places.asking("go", outcome("gone", {})),
            places.asking("grab", outcome("grabbed", {"holding": True}), kinds=()),
        ),
    )
    reachable = explore_task(replace(ecm, definitions=places.DEFINITIONS), pursued, places.site())
    (start,) = (node for node in reachable.graph if node.phase == "try" and len(node.remaining_rules) == 2)
    assert {move.case for move in reachable.system.transitions(start)} == {"0"}
    assert list(reachable.nodes_that_can_miss_goal()) == []


def test_a_goal_that_a_composition_may_leave_true_or_false_is_not_within_reach() -> None:
    goal = PlanningRule(places.term("m.docked"), "m.docked", "going", {}, 0, None, None, SPAN)
    arrive = Task("arrive", (), places.term("m.docked"), "m.docked", (goal,), {"m.docked": False}, None, SPAN)
    body = Step("go", "go", {}, {}, 0, None, None, SPAN)
    ecm = replace(
        module("m", (places.asking("go", outcome("gone", {})),)),
        definitions=places.DEFINITIONS,
        compositions={"drive": Composition("drive", t.TRUE, None, body, {}, SPAN)},
        capabilities={"going": ("drive",)},
    )
    reachable = explore_task(ecm, arrive, places.site())
    moves = reachable.system.transitions(LoopState("try", (False,), (0,)))
    assert sorted((one.case, one.target.state) for one in moves) == [("done", (False,)), ("done", (True,))]
    assert [node.state for node in reachable.nodes_that_can_miss_goal()] == [(False,)]


@pytest.mark.parametrize(
    ("text", "levels"), [("fill_level > 0.5", {0.75}), ("fill_level > 1", {0.25, 0.5, 0.75, 1})]
)
def test_a_run_starts_only_where_the_definitions_agree_with_its_start(text: str, levels: set[float]) -> None:
    """If no level agrees, `initial` contradicts the definition, and all levels are shown."""
    pursued = replace(
        task("cook", ("cook",), COOKED, COOKING),
        initial={COOKED: False, WRAPPED: True},
        invariants=(TaskInvariant("kept", term(f"{WRAPPED} or fill_level <= 0.5"), "", SPAN),),
    )
    ecm = module("kitchen", (WAIT, BOIL), pursued)
    ecm = replace(ecm, definitions={WRAPPED: Definition(term(text), text, SPAN)})
    reachable = explore_task(replace(ecm, capabilities={"cooking": ("boil",)}), pursued, site())
    starts = [node.state for node in reachable.graph if node not in reachable.predecessors]
    at = reachable.system.names.index("fill_level")
    assert {state[at] for state in starts} == levels
    compare_engines(reachable)
