"""A plan is accepted exactly where its steps can be taken and nothing that may happen loses the goal."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop.invocation import State
from aeros.spec.diagnostics.source import Source
from aeros.spec.expr.types import EnumType
from aeros.spec.model.ecm import Skill
from aeros.spec.model.step_graph import If, Par, Part, Seq
from aeros.spec.planning.plan_check import (
    PlannedStep,
    UnreadablePlanError,
    find_plan_problems,
    find_step_problems,
    read_plan,
)
from aeros.spec.planning.strong_cyclic import StrongCyclicStrategy
from tests.unit.agent.dumplings import given_input, outcome, skill, term
from tests.unit.spec.planning.kitchen import BOIL, WRAP, choice_of, domain_of

COOKED, WRAPPED, ALIGNED = "dumpling_cooked", "dumpling_wrapped", "wrapper_aligned"
SPAN = Source("plan", "x").span(0, 1)
READY = replace(WRAP, precondition=None)
START, DONE = (False, False), (True, False)


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("", ()),
        ("; a comment\n\n", ()),
        ("(kitchen.boil)\n", ("kitchen.boil",)),
        ("  (a.b  x=1   y)  ; why\n( c )", ("a.b x=1 y", "c")),
        ("(a)\r\n(b)\r\n", ("a", "b")),
    ],
)
def test_a_plan_is_read_line_by_line(text: str, steps: tuple[str, ...]) -> None:
    assert read_plan(text) == steps


@pytest.mark.parametrize("line", ["a", "(a", "a)", "()", "( )", "0: a"])
def test_a_line_that_is_no_step_is_refused(line: str) -> None:
    with pytest.raises(UnreadablePlanError, match=r"^line 2: expected a step in brackets"):
        read_plan(f"(ok)\n{line}\n")


def strategy_of(*skills: Skill, goal: str = COOKED) -> StrongCyclicStrategy:
    return StrongCyclicStrategy(domain_of(*skills, goal=goal))


KITCHEN = strategy_of(BOIL, READY)


def problems(*steps: str, start: State = START, strategy: StrongCyclicStrategy = KITCHEN) -> list[str]:
    return find_step_problems(strategy, start, steps)


def test_steps_that_reach_the_goal_are_accepted_by_label_or_pddl_name() -> None:
    assert problems("kitchen.wrap", "kitchen.boil") == []
    assert problems("KITCHEN-wrap-wrapped", "kitchen.BOIL") == []
    assert problems(start=DONE) == []


def test_nothing_is_done_once_the_goal_is_reached() -> None:
    assert problems("kitchen.boil", start=DONE) == []
    assert problems("kitchen.wrap", "kitchen.boil", "kitchen.boil") == []


def test_a_plan_that_ends_before_the_goal_is_refused() -> None:
    shown = "dumpling_cooked = false, dumpling_wrapped = true"
    assert problems("kitchen.wrap") == [f"it ends, and the goal does not hold: {shown}"]
    assert problems() == [f"it ends, and the goal does not hold: {shown.replace('true', 'false')}"]


def test_a_step_that_cannot_start_is_refused_with_its_number() -> None:
    assert problems("kitchen.boil") == [
        "step 1, `kitchen.boil`: its precondition `dumpling_wrapped` does not hold where "
        "dumpling_cooked = false, dumpling_wrapped = false"
    ]
    assert problems("kitchen.wrap", "kitchen.wrap", "kitchen.boil") == []


def test_a_step_that_is_none_is_refused_with_the_nearest_or_the_reason() -> None:
    force = {"force": given_input("force", None, (Fraction(0), Fraction(1)))}
    forced = skill("press", outcome("done", {COOKED: True}), inputs=force)
    strategy = strategy_of(BOIL, READY, forced)
    found = problems("kitchen.boli", "kitchen.press", "nothing", "kitchen.wrap", strategy=strategy)
    assert found == [
        "step 1, `kitchen.boli`: no such skill; did you mean `kitchen.boil`?",
        "step 2, `kitchen.press`: its input `force` has no value",
        "step 3, `nothing`: no such skill",
    ]


def test_every_step_counts_for_an_executor_that_runs_all() -> None:
    unwrap = skill("unwrap", outcome("raw", {COOKED: False, WRAPPED: False}))
    strategy = strategy_of(BOIL, READY, unwrap)
    undone = ["kitchen.wrap", "kitchen.boil", "kitchen.unwrap"]
    assert find_step_problems(strategy, START, undone) == []
    assert find_step_problems(strategy, START, undone, every_step=True) == [
        "it ends, and the goal does not hold: dumpling_cooked = false, dumpling_wrapped = false"
    ]
    assert find_step_problems(strategy, START, [*undone, *undone[:2]], every_step=True) == []
    (found,) = find_step_problems(strategy, START, [*undone, "kitchen.boil"], every_step=True)
    assert found.startswith("step 4, `kitchen.boil`: its precondition")


def test_a_step_that_names_a_capability_runs_a_provider_that_can_start() -> None:
    steam = skill("steam", outcome("cooked", {COOKED: True}), precondition=f"not {WRAPPED}")
    strategy = strategy_of(BOIL, READY, steam)
    providers = {"kitchen.cooking": ("kitchen.boil", "kitchen.steam"), "kitchen.none": ("kitchen.fry",)}
    for start in (START, (False, True)):
        assert find_step_problems(strategy, start, ["kitchen.Cooking"], providers) == []
    boil = {"kitchen.cooking": ("kitchen.boil",)}
    (found,) = find_step_problems(strategy, START, ["kitchen.cooking"], boil)
    assert found.startswith("step 1, `kitchen.cooking`: its precondition `dumpling_wrapped` does not hold")
    (found,) = find_step_problems(strategy, START, ["kitchen.none"], providers)
    assert found.startswith("step 1, `kitchen.none`: no such skill")


def test_each_provider_that_can_start_has_to_lead_on() -> None:
    burn = skill("burn", outcome("burnt", {ALIGNED: True}))
    boil = skill("boil", outcome("cooked", {COOKED: True}), precondition=f"not {ALIGNED}")
    strategy = strategy_of(boil, burn)
    both = {"kitchen.cooking": ("kitchen.boil", "kitchen.burn")}
    assert find_step_problems(strategy, START, ["kitchen.cooking"], both) != []


def test_a_plan_whose_steps_have_one_outcome_each_is_checked_without_a_search() -> None:
    def search(*_: object) -> None:
        raise AssertionError("searched")

    strategy = StrongCyclicStrategy(domain_of(BOIL, READY, goal=COOKED), search)
    assert find_step_problems(strategy, START, ["kitchen.wrap", "kitchen.boil"]) == []
    assert find_step_problems(strategy, START, ["kitchen.boil"]) != []
    burning = StrongCyclicStrategy(domain_of(BURN, goal=COOKED), search)
    with pytest.raises(AssertionError, match="searched"):
        find_step_problems(burning, START, ["kitchen.boil"])


def test_a_broken_invariant_is_a_problem_without_a_search_too() -> None:
    domain = replace(
        KITCHEN.domain,
        invariants={
            "stays-raw": KITCHEN.domain.condition(term(f"not {WRAPPED}"), choice_of(KITCHEN.domain, "wrap"))
        },
    )
    (found,) = find_step_problems(StrongCyclicStrategy(domain), START, ["kitchen.wrap", "kitchen.boil"])
    assert found.startswith("step 1, `kitchen.wrap`: after `wrapped`, `stays-raw` does not hold: ")


BURN = skill(
    "boil",
    outcome("cooked", {COOKED: True}),
    outcome("torn", {ALIGNED: True}, failure=True),
    precondition=f"not {ALIGNED}",
)


def test_an_outcome_after_which_the_goal_is_lost_is_refused() -> None:
    (found,) = problems("kitchen.boil", strategy=strategy_of(BURN))
    assert found.startswith("step 1, `kitchen.boil`: after `torn`, the goal needs `dumpling_cooked`")
    assert found.endswith(": dumpling_cooked = false, wrapper_aligned = true")


def test_a_failure_from_which_the_goal_can_still_be_reached_is_accepted() -> None:
    smooth = skill("align", outcome("aligned", {ALIGNED: False}))
    assert problems("kitchen.boil", strategy=strategy_of(BURN, smooth)) == []


def step(*names: str, strategy: StrongCyclicStrategy = KITCHEN, **more: Any) -> PlannedStep:
    return PlannedStep("a step", tuple(choice_of(strategy.domain, name) for name in names), **more)


def judged(
    plan: Part[PlannedStep], start: State = START, strategy: StrongCyclicStrategy = KITCHEN, **known: Any
) -> list[str]:
    return find_plan_problems(strategy, start, plan, known)


def test_a_step_is_skipped_where_it_is_needless() -> None:
    wrap = step("wrap", skip_condition=term(WRAPPED))
    boil = step("boil", skip_condition=term(WRAPPED))
    assert judged(Seq((wrap, step("boil"))), (False, True)) == []
    assert judged(Seq((step("wrap"), boil))) == [
        "it ends, and the goal does not hold: dumpling_cooked = false, dumpling_wrapped = true"
    ]
    assert judged(boil) != []


def test_any_of_several_skills_of_a_step_may_run_so_all_must_start() -> None:
    steam = skill("steam", outcome("cooked", {COOKED: True}))
    strategy = strategy_of(BOIL, READY, steam)
    assert judged(step("boil", "steam", strategy=strategy), (False, True), strategy) == []
    (found,) = judged(step("boil", "steam", strategy=strategy), START, strategy)
    assert "its precondition `dumpling_wrapped` does not hold" in found


def test_a_condition_leads_each_state_its_way() -> None:
    way = If(term(WRAPPED), WRAPPED, step("boil"), Seq((step("wrap"), step("boil"))), SPAN)
    assert judged(way) == judged(way, (False, True)) == []
    half = If(term(WRAPPED), WRAPPED, step("boil"), None, SPAN)
    assert judged(half, (False, True)) == []
    assert judged(half) == [
        f"the plan does not say how to continue if `{WRAPPED}` does not hold: "
        "dumpling_cooked = false, dumpling_wrapped = false"
    ]
    assert judged(way, (False, None)) == [
        f"`if {WRAPPED}`: the condition is unknown where dumpling_cooked = false, dumpling_wrapped = unknown"
    ]


def test_a_condition_may_read_what_no_skill_sets_as_it_was_measured() -> None:
    way: Part[PlannedStep] = If(
        term("fill_level > 0.5"), "full", Seq((step("wrap"), step("boil"))), Seq(()), SPAN
    )
    assert judged(way, fill_level=Fraction(1)) == []
    assert judged(way, fill_level=Fraction(0))[0].startswith("it ends, and the goal does not hold")
    assert "the condition is unknown" in judged(way)[0]


def test_branches_at_the_same_time_are_refused() -> None:
    assert judged(Par((step("wrap"), step("boil")), SPAN)) == ["parallel branches cannot be checked"]


TEAR = skill(
    "wrap",
    outcome("wrapped", {WRAPPED: True}),
    outcome("torn", {ALIGNED: True}, failure=True),
    precondition=f"not {ALIGNED}",
)
MEND = skill("mend", outcome("mended", {ALIGNED: False}), outcome("broken", {ALIGNED: True}, failure=True))


def test_a_further_try_begins_after_a_failure_or_its_recovery() -> None:
    strategy = strategy_of(BOIL, TEAR, MEND)
    assert strategy.domain.names == (COOKED, WRAPPED, ALIGNED)
    start = (False, False, False)

    def plan(**more: Any) -> list[str]:
        return judged(
            Seq((step("wrap", strategy=strategy, **more), step("boil", strategy=strategy))), start, strategy
        )

    assert plan() == plan(retry=2) == []
    assert plan(retry=1, recovery_choices=(choice_of(strategy.domain, "mend"),)) == []


def test_an_outcome_of_a_recovery_that_loses_the_goal_is_refused_if_there_is_a_further_try() -> None:
    ruin = skill("ruin", outcome("ruined", {"area": "pot"}))
    tear = skill(
        "wrap",
        outcome("wrapped", {WRAPPED: True}),
        outcome("torn", {}, failure=True),
        precondition="area == table",
    )
    strategy = strategy_of(BOIL, tear, ruin)
    assert strategy.domain.names == ("area", COOKED, WRAPPED)
    assert isinstance(strategy.domain.variables["area"].type, EnumType)
    start = ("table", False, False)
    ruins = (choice_of(strategy.domain, "ruin"),)

    def plan(retry: int) -> list[str]:
        parts = (
            step("wrap", strategy=strategy, retry=retry, recovery_choices=ruins),
            step("boil", strategy=strategy),
        )
        return judged(Seq(parts), start, strategy)

    assert plan(0) == []
    (found,) = plan(1)
    assert found.startswith("step 1, `a step`: after `ruined`, ")
    assert ": area = pot" in found
