"""Loops by hand, with their programs and sets of states."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr.effects import Increment
from aeros.spec.model.ecm import ActionCondition, Outcome, PlanningRule, Skill, TaskInvariant
from tests.differential.planning.number_loops import STATE, term
from tests.unit.agent.dumplings import SPAN, module, outcome, rule, site, skill, task

WRAPPED, COOKED = "dumpling_wrapped", "dumpling_cooked"
WRAP = skill("wrap", outcome("wrapped", {WRAPPED: True}), outcome("torn", {}, failure=True))
BOIL = skill("boil", outcome("cooked", {COOKED: True}), precondition=WRAPPED)
WRAPPING, COOKING = rule(WRAPPED, "wrap"), rule(COOKED, "boil")
COUNT = replace(
    skill("add", Outcome("added", {"count": Increment(Fraction(1))}, False, None, None)),
    precondition=ActionCondition(term("count < 4"), "count < 4", SPAN),
)


def loop(
    *rules: PlanningRule,
    skills: tuple[Skill, ...] = (WRAP, BOIL),
    goal: str = COOKED,
    kept: str | None = None,
    initial: dict[str, Any] | None = None,
) -> SymbolicLoop:
    """A loop by sets of states; every predicate may have any value at its start."""
    invariants = () if kept is None else (TaskInvariant("kept", term(kept), kept, SPAN),)
    pursued = replace(
        task("cook", ("cook",), COOKED, *(rules or (WRAPPING, COOKING))),
        goal=term(goal),
        goal_text=goal,
        invariants=invariants,
        initial=initial or {},
    )
    ecm = module("kitchen", skills, pursued)
    return SymbolicLoop(TransitionSystem(ecm, pursued, replace(site(), state=STATE)))


def counting(text: str = "count >= 4") -> SymbolicLoop:
    """A loop that counts, by one in each plan, until a condition holds."""
    counted = replace(rule(WRAPPED, "add"), satisfied_condition=term(text), text=text)
    return loop(counted, skills=(COUNT,), goal=text)
