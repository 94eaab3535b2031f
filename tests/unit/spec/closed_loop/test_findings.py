"""Paths to faults as people read them."""

from __future__ import annotations

from fractions import Fraction

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


def test_numbers_and_places_are_shown_among_many_variables_also_where_they_are_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    goal = f"{FIRST} and fill_level > 0 and area == pot"
    pursued = task("work", ("work",), goal, rule(FIRST, "work"))
    system = TransitionSystem(module("kitchen", (SKILL,), pursued), pursued, site())
    assert system.names == ("area", FIRST, "fill_level")
    path = LoopPath(("table", False, Fraction(0)), (), ("table", False, Fraction(0)))
    for most, lines in (
        (3, [f"area = table, {FIRST} = false, fill_level = 0"] * 2),
        (2, ["area = table, fill_level = 0, and 1 truth values false", "all else as at the start"]),
    ):
        monkeypatch.setattr(findings, "MAX_SHOWN", most)
        start, end = lines
        assert format_path(system, path).splitlines()[1:] == [f"start with {start}", f"then {end}"]
