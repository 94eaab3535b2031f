"""Faults of loops by sets of states, each with a run that shows it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aeros.spec.closed_loop.findings import LoopFindings, LoopPath
from aeros.spec.closed_loop.reachability import explore_system
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.transition_system import Transition, TransitionSystem
from aeros.spec.diagnostics.errors import InternalError
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import TaskInvariant
from aeros.spec.model.step_graph import Seq
from tests.unit.agent.dumplings import SPAN, module, outcome, rule, site, skill, task, term
from tests.unit.spec.closed_loop.symbolic.loops_by_hand import BOIL, COOKED, COOKING, WRAP, WRAPPED, loop


def test_a_loop_without_faults_has_none() -> None:
    made = loop(kept=f"{WRAPPED} or not {COOKED}", initial={COOKED: False, WRAPPED: False})
    assert made.blocked_step() is None
    assert made.dead_end() is None
    assert made.violation(made.system.task.invariants[0]) is None
    assert not made.starts_at_goal()
    assert not made.has_choices


def test_a_step_that_cannot_start_is_found_with_its_skill() -> None:
    made = loop(COOKING, initial={COOKED: False})
    found = made.blocked_step()
    assert found is not None
    assert (found.rule, found.skill) == (made.system.task.rules[0], "boil")
    assert found.path.start == found.path.end == (False, False)


def test_a_dead_end_is_found_with_the_way_to_it() -> None:
    spoilt = skill(
        "wrap", outcome("wrapped", {WRAPPED: True}), outcome("burnt", {"wrapper_aligned": True}, failure=True)
    )
    boil = skill("boil", outcome("cooked", {COOKED: True}), precondition=f"{WRAPPED} and not wrapper_aligned")
    made = loop(skills=(spoilt, boil), initial={COOKED: False, WRAPPED: False, "wrapper_aligned": False})
    path = made.dead_end()
    assert path is not None
    assert path.labels == ("wrap → burnt",)


def test_a_violation_is_found_at_the_nearest_state() -> None:
    made = loop(kept=f"not {COOKED}", initial={COOKED: False, WRAPPED: False})
    path = made.violation(made.system.task.invariants[0])
    assert path is not None
    assert path.labels == ("wrap → wrapped", "boil → cooked")
    assert path.end == (True, True)


def test_a_choice_is_one_between_skills_that_can_start() -> None:
    quick = skill("quick", outcome("wrapped", {WRAPPED: True}))
    made = loop(rule(WRAPPED, "wrapping"), COOKING, skills=(WRAP, BOIL, quick))
    ecm = replace(made.system.ecm, capabilities={"wrapping": ("wrap", "quick")})
    assert SymbolicLoop(TransitionSystem(ecm, made.system.task, site())).has_choices


def test_a_path_that_no_run_takes_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    made = loop(kept=f"not {COOKED}", initial={COOKED: False, WRAPPED: False})
    monkeypatch.setattr(type(made.system), "transitions", lambda _, node: [Transition(node)])
    with pytest.raises(InternalError, match=r"^no run of the loop takes the path that the diagrams have$"):
        made.violation(made.system.task.invariants[0])


def test_a_step_that_can_start_where_the_sets_have_it_blocked_is_an_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = loop(COOKING, initial={COOKED: False})
    monkeypatch.setattr(type(made.system), "blocked_step", lambda *_: None)
    with pytest.raises(InternalError, match=r"^a step starts where the diagrams have it blocked$"):
        made.blocked_step()


def test_a_violation_inside_a_composition_has_its_name() -> None:
    aligned = "wrapper_aligned"
    skills = (
        skill("align", outcome("aligned", {aligned: True})),
        skill("tilt", outcome("tilted", {aligned: False})),
        skill("bake", outcome("cooked", {COOKED: True})),
    )
    kept = TaskInvariant("kept", term(f"not {aligned}"), "", SPAN)
    pursued = replace(
        task("cook", ("cook",), COOKED, rule(COOKED, "cooking")),
        initial={COOKED: False, aligned: False},
        invariants=(kept,),
    )
    body = Seq(tuple(Step(one.id, one.id, {}, {}, 0, None, None, SPAN) for one in skills))
    ecm = replace(
        module("kitchen", skills, pursued),
        compositions={"both": Composition("both", t.TRUE, None, body, {}, SPAN)},
        capabilities={"cooking": ("both",)},
    )
    system = TransitionSystem(ecm, pursued, site())
    engines: tuple[LoopFindings, ...] = (SymbolicLoop(system), explore_system(system))
    for engine in engines:
        assert engine.dead_end() is None
        assert engine.violation(kept) == LoopPath((False, False), (), (False, True), "both")
