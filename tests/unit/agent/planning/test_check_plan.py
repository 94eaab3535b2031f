"""The check of a plan from the measured state: what leads to the goal is accepted, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.agent.planning.check_plan import PlanChecker
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.planning.task_graph import Part, PlanStep, TaskGraph
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.step_graph import If, Par
from aeros.spec.model.variables import Declared
from tests.unit.agent.dumplings import (
    DUMPLING,
    FORCE,
    MAKE_DUMPLINGS,
    PREDICATES,
    SPAN,
    given_input,
    module,
    outcome,
    site,
    skill,
    state,
    term,
)


def do(name: str, retry: int = 0, **more: Any) -> PlanStep:
    return PlanStep("dumpling", name, retry=retry, **more)


WHOLE = (do("prepare"), do("recover"), do("wrap", 2, between_tries=do("recover")), do("boil"))
COOKED = outcome("cooked", {"dumpling_cooked": True})


def problems(*parts: Part, ecm: Ecm = DUMPLING, **measured: bool) -> list[str]:
    values = dict.fromkeys(PREDICATES, False) | measured
    readings = {name: Reading(value, 0.0) for name, value in values.items()}
    world = world_from_readings(site().state, readings, 0.0)
    return PlanChecker(RoutedTask("dumpling", MAKE_DUMPLINGS), world, {"dumpling": ecm}, site()).problems(
        TaskGraph(parts)
    )


def test_a_plan_that_leads_to_the_goal_has_no_problem() -> None:
    assert problems(*WHOLE) == []


def test_the_measured_state_is_where_it_starts() -> None:
    (problem,) = problems(do("wrap"), do("boil"))
    assert "its precondition" in problem
    assert problems(do("boil"), dumpling_wrapped=True) == []


def test_a_plan_that_ends_before_the_goal_is_not_accepted() -> None:
    (problem,) = problems(*WHOLE[:3])
    assert "it ends, and the goal does not hold" in problem


def test_a_step_that_its_condition_makes_needless_is_skipped() -> None:
    aligned = do("recover", unless=term("wrapper_aligned"))
    assert problems(WHOLE[0], aligned, *WHOLE[2:], wrapper_aligned=True) == []


def test_either_branch_of_an_if_must_lead_on() -> None:
    fork = If(term("wrapper_aligned"), "wrapper_aligned", do("wrap"), WHOLE[1], SPAN)
    assert problems(WHOLE[0], fork, *WHOLE[2:]) == []


@pytest.mark.parametrize(
    ("part", "problem"),
    [
        (do("fly"), "no such skill"),
        (PlanStep("kitchen", "boil"), "no such skill"),
        (
            do("boil", inputs={"force": 0.25}),
            "it cannot be checked with inputs other than the declared defaults",
        ),
        (
            do("boil", inputs={"force": 2.0}),
            "it cannot be checked with inputs other than the declared defaults",
        ),
        (
            do("boil", inputs={"salt": 1.0}),
            "it cannot be checked with inputs other than the declared defaults",
        ),
        (do("wrap", 1, needs_recovery=True), "steps of a composition, or with outputs of other steps"),
        (
            do("boil", flows={"force": ("weigh", "force")}),
            "steps of a composition, or with outputs of other steps",
        ),
        (
            do("prepare", 1, on_failure=do("fly")),
            "on_failure: no such skill",
        ),
        (Par((do("prepare"), do("recover")), SPAN), "parallel branches cannot be checked"),
    ],
)
def test_a_plan_that_is_not_checked_is_not_accepted(part: Part, problem: str) -> None:
    found = problems(part)
    assert len(found) == 1
    assert problem in found[0]


def test_inputs_that_are_the_defaults_may_be_given() -> None:
    assert problems(*WHOLE[:3], do("boil", inputs={"force": 0.5})) == []
    assert problems(*WHOLE[:3], do("boil", inputs={"force": Fraction(1, 2)})) == []


def _with_lid() -> Ecm:
    """Boiling has an input of two values and no default."""
    lid = Declared(replace(state("lid").variable, name="inputs.lid", role=FORCE.variable.role), SPAN)
    boil = skill("boil", COOKED, precondition="dumpling_wrapped", inputs={"lid": lid})
    return module("dumpling", (*DUMPLING.skills.values(), boil), MAKE_DUMPLINGS)


def test_an_input_of_few_values_may_have_each_of_them() -> None:
    ecm = _with_lid()
    for lid in (True, False):
        assert problems(*WHOLE[:3], do("boil", inputs={"lid": lid}), ecm=ecm) == []
    (problem,) = problems(*WHOLE[:3], do("boil", inputs={"lid": 1}), ecm=ecm)
    assert "it cannot be checked with inputs other than the declared defaults" in problem


def test_a_skill_that_no_planner_can_use_is_named_with_the_reason() -> None:
    salt = given_input("salt", None, (Fraction(0), Fraction(1)))
    boil = skill("boil", COOKED, precondition="dumpling_wrapped", inputs={"salt": salt})
    ecm = module("dumpling", (*DUMPLING.skills.values(), boil), MAKE_DUMPLINGS)
    (problem,) = problems(*WHOLE[:3], do("boil", inputs={"salt": 0.5}), ecm=ecm)
    assert problem == "step 4, `dumpling.boil`: its input `salt` has no value"


def test_every_provider_of_a_capability_must_work() -> None:
    fry = skill("fry", COOKED, precondition="dumpling_wrapped")
    raw = skill("serve", outcome("served", {"dumpling_wrapped": False}))
    for cooks, is_accepted in ((("boil", "fry"), True), (("boil", "serve"), False)):
        ecm = module("dumpling", (*DUMPLING.skills.values(), fry, raw), MAKE_DUMPLINGS)
        found = problems(*WHOLE[:3], do("cook"), ecm=replace(ecm, capabilities={"cook": cooks}))
        assert (found == []) is is_accepted


def test_a_skill_that_the_goal_does_not_need_is_judged_by_its_own_precondition() -> None:
    wave = skill("wave", outcome("waved", {}), precondition="area == pot")
    ecm = module("dumpling", (*DUMPLING.skills.values(), wave), MAKE_DUMPLINGS)
    (problem,) = problems(do("wave"), *WHOLE, ecm=ecm)
    assert "its precondition" in problem
