"""Comparison of a small loop by sets of states with the list of its states."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

from aeros.spec.closed_loop.reachability import explore_system
from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr import terms as t
from aeros.spec.expr.constants import equality_condition
from aeros.spec.model.ecm import Ecm, Task, TaskInvariant
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import discharge_obligations
from tests.differential.planning.number_loops import STATE
from tests.differential.planning.test_symbolic_loops import compare_engines
from tests.unit.agent.dumplings import SPAN, site
from tests.unit.spec.closed_loop.symbolic.certificates import certificate_of

SITE = replace(site(), state=STATE)


def assert_as_listed(ecm: Ecm, pursued: Task) -> None:
    """A small loop has the faults that the list of its states has, and comes through the same states.

    For each state there is an invariant: that the loop never comes through it.  A path shows where it does;
    where the loop has no other fault, a solver confirms of all other states that it does not.
    """
    found = TransitionSystem(ecm, pursued, SITE).variables
    variables = found.variables.values()
    states = product(*found.values.values())
    never = tuple(
        TaskInvariant(f"not_{at}", t.Not(_is_state(dict(zip(variables, state, strict=True)))), "", SPAN)
        for at, state in enumerate(states)
    )
    system = TransitionSystem(ecm, replace(pursued, invariants=never), SITE)
    listed = explore_system(system)
    compare_engines(listed)
    if listed.blocked_step() is None and listed.dead_end() is None and not system.inexact_reason:
        kept = tuple(one for one in never if listed.violation(one) is None)
        sound = SymbolicLoop(TransitionSystem(ecm, replace(pursued, invariants=kept), SITE))
        results = discharge_obligations(certificate_of(sound))
        assert {one.verdict for one in results} == {Verdict.PROVED}


def _is_state(values: dict[t.Variable, Any]) -> t.Term:
    return t.conjunction(*(equality_condition(*one) for one in values.items()))
