"""Classical engines: a plan, no plan, or an error that says which engine did not decide."""

from __future__ import annotations

from importlib import import_module

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.planning.classical import ClassicalEngineError, UnifiedPlanningEngine

DOMAIN = """(define (domain kitchen)
(:requirements :strips :disjunctive-preconditions :negative-preconditions)
(:predicates (dough) (filling) (wrapped))
(:action knead :parameters () :precondition (not (dough)) :effect (dough))
(:action wrap :parameters () :precondition (or (dough) (filling)) :effect (wrapped)))
"""


def problem(goal: str, *facts: str) -> str:
    return f"(define (problem p) (:domain kitchen) (:init {' '.join(facts)}) (:goal {goal}))"


def solve(goal: str, *facts: str) -> list[str] | None:
    pytest.importorskip("unified_planning", reason="needs `pip install '.[pddl]'`")
    return UnifiedPlanningEngine("pyperplan").solve(DOMAIN, problem(goal, *facts))


def test_a_plan_names_the_actions_of_the_problem_as_it_was_posed() -> None:
    # `or` and `not` are compiled away for the engine, and no name that comes of it is seen.
    assert solve("(wrapped)") == ["knead", "wrap"]
    assert solve("(wrapped)", "(filling)") == ["wrap"]


def test_without_a_name_an_installed_engine_is_chosen() -> None:
    pytest.importorskip("unified_planning", reason="needs `pip install '.[pddl]'`")
    assert UnifiedPlanningEngine().solve(DOMAIN, problem("(wrapped)")) == ["knead", "wrap"]


def test_a_goal_that_holds_needs_no_action() -> None:
    assert solve("(dough)", "(dough)") == []


def test_a_goal_that_cannot_be_reached_has_no_plan() -> None:
    assert solve("(filling)") is None


def test_text_that_is_no_pddl_is_an_error_of_the_engine() -> None:
    pytest.importorskip("unified_planning", reason="needs `pip install '.[pddl]'`")
    with pytest.raises(ClassicalEngineError, match=r"^\w+: "):
        UnifiedPlanningEngine("pyperplan").solve("(define (domain", problem("(dough)"))


def test_an_engine_that_does_not_decide_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("unified_planning", reason="needs `pip install '.[pddl]'`")
    from unified_planning.engines import PlanGenerationResult, PlanGenerationResultStatus

    status = PlanGenerationResultStatus.TIMEOUT
    monkeypatch.setattr(
        import_module("up_pyperplan.engine").EngineImpl,
        "_solve",
        lambda engine, *_, **__: PlanGenerationResult(status, None, engine.name),
    )
    with pytest.raises(ClassicalEngineError, match=r"^Pyperplan ends with TIMEOUT$"):
        solve("(wrapped)")


def test_without_the_library_the_error_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("aeros.agent.planning.classical.find_spec", lambda _: None)
    with pytest.raises(AgentError, match=r"needs `pip install '\.\[pddl\]'`"):
        UnifiedPlanningEngine()
