"""Small loops, of which each shows one turn that a plan may take, against the list of their states."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.expr.effects import Increment
from aeros.spec.model.ecm import ActionCondition, Ecm, Outcome, PlanningRule, Task
from tests.differential.planning.number_loops import term
from tests.unit.agent.dumplings import FORCE, SPAN, module, outcome, rule, skill, task
from tests.unit.spec.closed_loop.symbolic.listed_states import assert_as_listed

WRAPPED, COOKED, ALIGNED = "dumpling_wrapped", "dumpling_cooked", "wrapper_aligned"
TORN = outcome("torn", {}, failure=True)
MORE, LESS = Increment(Fraction(1)), Increment(Fraction(-1))


def condition(text: str) -> ActionCondition:
    return ActionCondition(term(text), text, SPAN)


SKILLS = (
    skill("wrap", outcome("wrapped", {WRAPPED: True}), TORN),
    skill("fold", outcome("folded", {WRAPPED: True}), precondition=ALIGNED),
    skill("boil", outcome("cooked", {COOKED: True}), TORN, precondition=WRAPPED),
    skill("steam", outcome("cooked", {COOKED: True}), outcome("burst", {WRAPPED: False}, failure=True)),
    skill("align", outcome("aligned", {ALIGNED: True}), TORN),
    skill("press", outcome("pressed", {ALIGNED: True}), precondition=f"not {WRAPPED}"),
    skill("tilt", outcome("tilted", {ALIGNED: False, WRAPPED: True}, failure=True)),
    skill("slip", outcome("slipped", {ALIGNED: False}, failure=True), precondition=ALIGNED),
    skill("bake", outcome("baked", {COOKED: True}), outcome("raw", {ALIGNED: True}, failure=True)),
    skill(
        "push",
        outcome("pushed", {ALIGNED: True}),
        inputs={"force": FORCE},
        precondition="inputs.force > 0.4 and not wrapper_aligned",
    ),
    skill("char", outcome("charred", {COOKED: True}, failure=True), TORN),
    skill("sure", replace(outcome("done", {WRAPPED: True}), probability=Fraction(1)), TORN),
    replace(
        skill("add", Outcome("added", {"count": MORE}, False, None, None)),
        precondition=condition("count < 4"),
    ),
    skill(
        "fill",
        outcome("filled", {"count": Fraction(3)}),
        outcome("spilt", {"count": Fraction(0)}, failure=True),
    ),
    replace(
        skill(
            "take",
            Outcome("taken", {"count": LESS, "area": "pot"}, False, None, None),
            Outcome("dropped", {"count": LESS}, True, None, None),
        ),
        precondition=condition("count > 0"),
    ),
    skill("carry", outcome("carried", {"area": "pot"}), outcome("put_back", {"area": "table"}, failure=True)),
)
CAPABILITIES = {
    "wrapping": ("wrap", "fold"),
    "cooking": ("boil", "steam"),
    "helping": ("align", "press"),
    "pressing": ("press", "slip"),
}
WRAPPING, COOKING = rule(WRAPPED, "wrap"), rule(COOKED, "boil")
EITHER = f"{WRAPPED} or {ALIGNED}"

LOOPS: dict[str, tuple[PlanningRule, ...]] = {
    "each step is tried once": (WRAPPING, COOKING),
    "a step is tried again": (rule(WRAPPED, "wrap", 2), COOKING),
    "only the last rule is due in a new plan": (COOKING, WRAPPING),
    "a step cannot start, at a further try": (rule(COOKED, "slip", 2), WRAPPING),
    "so it is after a recovery": (rule(COOKED, "slip", 1, "tilt"), WRAPPING),
    "a recovery lies between two tries": (rule(WRAPPED, "wrap", 2, "align"), COOKING),
    "a recovery cannot always start": (rule(WRAPPED, "tilt", 1, "press"), rule(ALIGNED, "align")),
    "one of several recoveries": (rule(WRAPPED, "wrap", 1, "helping"), COOKING),
    "either recovery may be unable to start": (rule(WRAPPED, "tilt", 1, "pressing"), COOKING),
    "a recovery makes the next try needless": (rule(EITHER, "wrap", 1, "align"), rule(COOKED, "steam")),
    "a recovery reaches the goal": (rule(WRAPPED, "wrap", 1, "bake"),),
    "a reset follows the last try": (rule(WRAPPED, "wrap", 1, None, "align"), COOKING),
    "a reset and recoveries": (rule(WRAPPED, "wrap", 1, "align", "bake"), COOKING),
    "a reset cannot always start": (rule(WRAPPED, "tilt", 0, None, "press"), COOKING),
    "one of several resets": (rule(COOKED, "steam", 1, None, "helping"), WRAPPING),
    "a reset follows a later step": (WRAPPING, rule(COOKED, "steam", 1, None, "align")),
    "a recovery of a later step": (WRAPPING, rule(COOKED, "steam", 2, "tilt")),
    "a failure reaches the goal": (rule(WRAPPED, "char", 1, "align"), rule(ALIGNED, "align")),
    "a failure makes the only step needless": (rule(COOKED, "char", 1, "align"),),
    "a last failure reaches the goal": (rule(WRAPPED, "char", 0, None, "align"), rule(ALIGNED, "align")),
    "a failed step is done all the same": (rule(EITHER, "bake", 1, "align"), COOKING),
    "a failure makes the next step needless": (rule(COOKED, "bake"), rule(EITHER, "fold")),
    "a step is left out as another has done it": (
        rule(EITHER, "align"),
        rule(ALIGNED, "wrap"),
        rule(COOKED, "steam", 1),
    ),
    "a recovery has inputs": (rule(WRAPPED, "wrap", 1, "push"), COOKING),
    "a reset has inputs": (WRAPPING, rule(COOKED, "steam", 0, None, "push")),
    "a reset follows a try that cannot start": (rule(COOKED, "slip", 2, None, "press"), WRAPPING),
    "the agent chooses a skill": (rule(WRAPPED, "wrapping"), rule(COOKED, "cooking")),
    "it chooses at each try": (rule(COOKED, "cooking", 1), rule(WRAPPED, "wrap")),
    "an outcome has no probability": (rule(WRAPPED, "sure", 1), COOKING),
    "an unlikely failure is reset": (rule(WRAPPED, "sure", 1, "press", "tilt"), COOKING),
    "a plan is rejected": (rule(WRAPPED, "wrap", 0, None, "wrap"), COOKING),
    "two rules are rejected together": (
        rule(WRAPPED, "wrap", 0, None, "boil"),
        rule(COOKED, "boil", 0, None, "wrap"),
    ),
    "a plan has too many tries": (rule(WRAPPED, "wrap", 4), COOKING),
    "no rule applies before the goal": (rule(EITHER, "wrap"),),
}


def counted(unless: str, do: str, retry: int = 0, between: str | None = None) -> PlanningRule:
    return replace(rule(WRAPPED, do, retry, between), satisfied_condition=term(unless), text=unless)


COUNTS: dict[str, tuple[str, tuple[PlanningRule, ...]]] = {
    "one more in each plan": ("count >= 3", (counted("count >= 3", "add"),)),
    "two more in each plan": ("count == 4", (counted("count >= 4", "add"), counted("count == 4", "add"))),
    "a goal that may be missed": ("count == 3", (counted("count == 3", "add"), counted("count < 4", "fill"))),
    "a step that cannot start at the limit": ("count == 0", (counted("count == 0", "add"),)),
    "a failure that counts": ("area == pot", (counted("area == pot", "take", 2),)),
    "a recovery that counts": ("area == pot", (counted("area == pot", "carry", 1, "take"),)),
    "a failure that loses all": ("count >= 2", (counted("count >= 2", "fill", 1, "add"),)),
    "a count and a place": (
        "count == 2 and area == pot",
        (counted("count >= 2", "add"), counted("area == pot", "carry")),
    ),
}


def kitchen(*rules: PlanningRule, **initial: bool) -> tuple[Ecm, Task]:
    pursued = replace(task("cook", ("cook",), COOKED, *rules), initial=initial)
    return replace(module("kitchen", SKILLS, pursued), capabilities=CAPABILITIES), pursued


@pytest.mark.parametrize(
    "initial", [{}, dict.fromkeys((COOKED, WRAPPED, ALIGNED), False)], ids=["any", "none"]
)
@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_comes_through_the_states_that_are_listed(name: str, initial: dict[str, bool]) -> None:
    assert_as_listed(*kitchen(*LOOPS[name], **initial))


@pytest.mark.parametrize("retry", [1, 2])
@pytest.mark.parametrize("between", [None, "tilt", "align"])
@pytest.mark.parametrize("last", [None, "press", "align"])
def test_a_step_that_cannot_start_at_a_further_try_counts_as_failed(
    retry: int, between: str | None, last: str | None
) -> None:
    slipping = rule(COOKED, "slip", retry, between, last)
    assert_as_listed(*kitchen(slipping, WRAPPING, **{COOKED: False, WRAPPED: False, ALIGNED: True}))


@pytest.mark.parametrize("name", COUNTS)
def test_a_loop_that_counts_comes_through_the_states_that_are_listed(name: str) -> None:
    goal, rules = COUNTS[name]
    ecm, pursued = kitchen(*rules)
    assert_as_listed(ecm, replace(pursued, goal=term(goal), goal_text=goal, initial={"area": "table"}))
