"""Paths to faults as people read them."""

from __future__ import annotations

import pytest

from aeros.spec.closed_loop import findings
from aeros.spec.closed_loop.findings import LoopPath, format_path
from aeros.spec.closed_loop.transition_system import TransitionSystem
from tests.unit.agent.dumplings import PREDICATES, module, outcome, rule, site, skill, task

FIRST, SECOND, THIRD = PREDICATES[:3]
SKILL = skill("work", outcome("done", {FIRST: True}))
TASK = task("work", ("work",), f"{FIRST} and {SECOND} and {THIRD}", rule(FIRST, "work"))
SYSTEM = TransitionSystem(module("kitchen", (SKILL,), TASK), TASK, site())
PATH = LoopPath((False, True, False), ("work → done",), (True, True, False))


def test_a_path_has_the_start_the_moves_and_the_end() -> None:
    assert format_path(SYSTEM, PATH).splitlines() == [
        "for example:",
        f"start with {FIRST} = false, {SECOND} = true, {THIRD} = false",
        "work → done",
        f"then {FIRST} = true, {SECOND} = true, {THIRD} = false",
    ]
    inside = LoopPath(PATH.start, (), PATH.end, "pair")
    assert format_path(SYSTEM, inside).splitlines()[2] == "pair, on its way"


def test_of_many_variables_only_those_that_matter_are_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(findings, "MAX_SHOWN", 2)
    assert format_path(SYSTEM, PATH).splitlines() == [
        "for example:",
        f"start with {SECOND} = true, and 2 truth values false",
        "work → done",
        f"then {FIRST} = true, all else as at the start",
    ]
