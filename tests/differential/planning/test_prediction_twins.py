"""Twins of the closed-loop analysis, each wrong in one way: the comparison notices every one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from aeros.spec.closed_loop.invocation import Invocation
from aeros.spec.closed_loop.transition_system import LoopState, Transition, TransitionSystem
from tests.differential.planning.small_tasks import START, Case
from tests.differential.planning.tree_expansion import expected
from tests.differential.reference_cases import REFERENCE, as_tuple, predicted_without_giving_up, reference
from tests.unit.agent.dumplings import module, outcome, rule, site, skill, task

_EXTRA_REPORTS = Case(
    module(
        "twin",
        (
            skill(
                "act",
                outcome("done", {"wrapper_aligned": True}),
                outcome("odd", {"dough_on_workspace": True}, failure=True),
                outcome("nothing", {}, failure=True),
            ),
            skill("help", outcome("helped", {"filling_on_workspace": True}), outcome("no", {}, failure=True)),
            skill("end", outcome("ended", {"dumpling_cooked": True}), precondition="filling_on_workspace"),
        ),
    ),
    task(
        "task",
        ("word",),
        "dumpling_cooked",
        rule("dough_on_workspace", "act", 1, "help"),
        rule("dumpling_cooked", "end"),
    ),
    site(replans=2),
    START,
)


def _no_failures(self: Invocation, state: Any) -> Any:
    return [case for case in _cases(self, state) if not case[0][1].failure] or _cases(self, state)


def _as_drawn(self: Invocation, before: Any, after: Any) -> Any:
    return self._outcomes[-1][0].outcome


def _never_recovers(self: TransitionSystem, node: LoopState) -> list[Transition]:
    if node.phase == "reset":
        return [Transition(LoopState("plan", node.state))]
    return [Transition(LoopState("try", node.state, node.remaining_rules, node.tries))]


def _replans_although_done(self: TransitionSystem, node: LoopState) -> list[Transition]:
    return [
        replace(move, target=LoopState("plan", move.target.state))
        if move.target.phase == "try" and node.tries and not move.target.tries and "odd" in move.label
        else move
        for move in _try(self, node)
    ]


_cases, _try = Invocation.cases, TransitionSystem._attempt_transitions
TWINS: dict[str, tuple[type, str, Callable[..., Any]]] = {
    "ignores failures": (Invocation, "cases", _no_failures),
    "takes another outcome than the one measured": (Invocation, "_measured_outcome", _as_drawn),
    "forgets recoveries": (TransitionSystem, "_recovery_transitions", _never_recovers),
    "plans again although the step is done": (
        TransitionSystem,
        "_attempt_transitions",
        _replans_although_done,
    ),
}


def _disagreements() -> list[str]:
    compared = {name: reference(name, 1) for name in REFERENCE} | {"twin": _EXTRA_REPORTS}
    return [
        name
        for name, case in compared.items()
        if as_tuple(predicted_without_giving_up(case)) != expected(case.ecm, case.task, case.site, case.start)
    ]


@pytest.mark.parametrize("twin", TWINS)
def test_a_broken_twin_of_the_analysis_disagrees(twin: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert _disagreements() == []
    owner, name, wrong = TWINS[twin]
    monkeypatch.setattr(owner, name, wrong)
    assert _disagreements() != []
