from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import MAX_REMARK_CHARS, PlanStep, TaskGraph, verify_plan
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.model.step_graph import MAX_STEPS
from tests.unit.agent.dumplings import (
    DUMPLING,
    FORCE,
    MAKE_DUMPLINGS,
    STATE,
    module,
    outcome,
    site,
    skill,
)

NEEDY = skill("needy", outcome("done", {}), inputs={"force": replace(FORCE, default_value=None)})
MODULES = {"dumpling": module("dumpling", (*DUMPLING.skills.values(), NEEDY))}


def problems(*steps: Any) -> list[str]:
    return verify_plan(TaskGraph(steps), MODULES, site(retries=3))


def planned(**measured: bool) -> list[str]:
    world = world_from_readings(STATE, {name: Reading(value, 0.0) for name, value in measured.items()}, 0.0)
    graph = RulePlanner().plan(RoutedTask("dumpling", MAKE_DUMPLINGS), world, {"dumpling": DUMPLING})
    assert verify_plan(graph, {"dumpling": DUMPLING}, site()) == []
    return [str(step) for step in graph.steps]


def test_a_fitting_plan_has_no_problem() -> None:
    assert (
        problems(
            PlanStep("dumpling", "wrap", retry=3, between_tries=PlanStep("dumpling", "recover")),
            PlanStep("dumpling", "boil"),
        )
        == []
    )
    assert problems(PlanStep("dumpling", "boil", {"force": 0.25})) == []
    assert problems(PlanStep("dumpling", "needy", {"force": Fraction(1, 4)})) == []


@pytest.mark.parametrize(
    ("step", "problem"),
    [
        (PlanStep("pizza", "bake"), "no active module is named `pizza`"),
        (PlanStep("dumpling", "wrapp"), "has no skill `wrapp`; did you mean `wrap`?"),
        (PlanStep("dumpling", "wrap", {"force": 0.5}), "`force` is not an input of it"),
        (PlanStep("dumpling", "needy"), "it needs the input `force`"),
        (PlanStep("dumpling", "boil", {"force": 2.0}), "the input `force` is outside 0 … 1"),
        (PlanStep("dumpling", "boil", {"force": "hard"}), "the input `force` is of type str"),
        (PlanStep("dumpling", "wrap", retry=4), "4 retries; this site allows 0 to 3"),
        (PlanStep("dumpling", "wrap", retry=-1), "-1 retries"),
        (
            PlanStep("dumpling", "wrap", retry=1, on_failure=PlanStep("dumpling", "pray")),
            "its `on_failure`, `dumpling.pray`: `dumpling` has no skill `pray`",
        ),
        (
            PlanStep("dumpling", "wrap", retry=1, between_tries=PlanStep("dumpling", "needy")),
            "its `between_tries`, `dumpling.needy`: it needs the input",
        ),
        (
            PlanStep("dumpling", "wrap", retry=1, between_tries=PlanStep("dumpling", "wrap")),
            "leads back to itself: `dumpling.wrap` → `dumpling.wrap`",
        ),
        (PlanStep("dumpling", "wrap", retry=True), "`retry` is of type bool"),
        (PlanStep("dumpling", None), "`skill` is of type NoneType"),  # type: ignore[arg-type]
        (PlanStep("dumpling", "wrap", unless="never"), "`unless` is of type str"),  # type: ignore[arg-type]
        ("wrap", "a str is not a step"),
    ],
)
def test_a_problem_is_named_before_the_first_step(step: Any, problem: str) -> None:
    (found,) = problems(step)
    assert problem in found


def test_every_problem_is_named() -> None:
    assert (
        len(
            problems(
                PlanStep("dumpling", "a", retry=9, on_failure=PlanStep("dumpling", "b")),
                PlanStep("pizza", "bake"),
            )
        )
        == 4
    )


def test_recoveries_must_not_go_round_in_a_circle_over_several_steps() -> None:
    wrap = PlanStep("dumpling", "wrap", retry=1, between_tries=PlanStep("dumpling", "recover"))
    recover = PlanStep("dumpling", "recover", retry=1, between_tries=PlanStep("dumpling", "wrap"))
    (found,) = problems(wrap, recover)
    assert "leads back" in found


@pytest.mark.parametrize("graph", [None, "steps", TaskGraph(()), TaskGraph([PlanStep("dumpling", "wrap")])])  # type: ignore[arg-type]
def test_text_that_is_no_plan_is_rejected(graph: object) -> None:
    assert len(verify_plan(graph, MODULES, site())) == 1


def test_a_remark_is_text_of_some_length() -> None:
    steps = (PlanStep("dumpling", "recover"),)
    assert verify_plan(TaskGraph(steps, "x" * MAX_REMARK_CHARS), MODULES, site()) == []
    wrong: list[Any] = ["x" * (MAX_REMARK_CHARS + 1), ["x"], None]
    for remark in wrong:
        assert "its remark is not a text" in verify_plan(TaskGraph(steps, remark), MODULES, site())[0]


def test_a_plan_has_a_greatest_length() -> None:
    step = PlanStep("dumpling", "recover")
    assert problems(*[step] * MAX_STEPS) == []
    assert "at most 100" in problems(*[step] * (MAX_STEPS + 1))[0]


def test_rules_emit_what_is_not_measured_in_order() -> None:
    nothing = dict.fromkeys(STATE, False)
    everything = [
        "dumpling.prepare",
        "dumpling.recover",
        "dumpling.wrap (retry 2, between_tries recover)",
        "dumpling.boil",
    ]
    del nothing["fill_level"], nothing["area"], nothing["tool"], nothing["joint"]
    assert planned(**nothing) == everything
    assert planned() == everything
    assert planned(**nothing | {"wrapper_aligned": True}) == [everything[0], *everything[2:]]
    ready = nothing | {"dough_on_workspace": True, "filling_on_workspace": True, "dumpling_wrapped": True}
    assert planned(**ready) == ["dumpling.boil"]


def test_an_unknown_unless_emits_its_step() -> None:
    ready = {"dough_on_workspace": True, "filling_on_workspace": True, "dumpling_cooked": True}
    # `wrapper_aligned or dumpling_wrapped` is true by `wrapper_aligned`, whatever the other is.
    wrap = "dumpling.wrap (retry 2, between_tries recover)"
    assert planned(**ready, wrapper_aligned=True) == [wrap]
    assert planned(**ready, wrapper_aligned=False) == ["dumpling.recover", wrap]
