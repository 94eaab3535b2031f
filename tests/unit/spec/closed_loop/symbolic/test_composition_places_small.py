"""Small compositions, of which each shows one form that a part may have, against the list of their states."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop.symbolic.analysis import SymbolicLoop
from aeros.spec.closed_loop.symbolic.program import PLAN
from aeros.spec.closed_loop.transition_system import TransitionSystem
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import QuantityRange
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.ecm import ActionCondition, Ecm, Task
from aeros.spec.model.perception import Definition
from aeros.spec.model.rules import Conjunct
from aeros.spec.model.step_graph import (
    FailingPart,
    Fallback,
    HeldPart,
    If,
    Par,
    RetriedPart,
    Seq,
    TimedPart,
)
from tests.unit.agent.dumplings import SPAN, module, outcome, rule, skill, task, term
from tests.unit.spec.closed_loop.symbolic.listed_states import SITE, assert_as_listed

WRAPPED, COOKED, ALIGNED, DOUGH = (
    "dumpling_wrapped",
    "dumpling_cooked",
    "wrapper_aligned",
    "dough_on_workspace",
)
TORN = outcome("torn", {}, failure=True)
FULL = QuantityRange("fill_level", None, Fraction(1), Fraction(1))
SKILLS = (
    skill("wrap", outcome("wrapped", {WRAPPED: True}), TORN),
    skill("fold", outcome("folded", {WRAPPED: True}), precondition=ALIGNED),
    skill("unfold", outcome("unfolded", {WRAPPED: False}), precondition=WRAPPED),
    skill("boil", outcome("cooked", {COOKED: True}), TORN, precondition=WRAPPED),
    skill("bake", outcome("baked", {COOKED: True}), outcome("burst", {WRAPPED: False}, failure=True)),
    skill("align", outcome("aligned", {ALIGNED: True})),
    skill("tilt", outcome("tilted", {ALIGNED: False})),
    skill("slip", outcome("slipped", {ALIGNED: False}, failure=True), precondition=ALIGNED),
    skill("knead", outcome("kneaded", {DOUGH: True}), outcome("dry", {ALIGNED: True}, failure=True)),
    skill("roll", outcome("rolled", {DOUGH: True})),
    skill("slump", outcome("slumped", {}, failure=True)),
    skill("sure", replace(outcome("done", {WRAPPED: True}), probability=Fraction(1)), TORN),
    skill("pour", replace(outcome("poured", {}), ranges=(FULL,)), TORN),
)


def step(
    name: str, retry: int = 0, between: str | None = None, last: str | None = None, *choices: str
) -> Step:
    return Step(name, name, {}, {}, retry, between, last, SPAN, choices)


def seq(*parts: Part | str) -> Part:
    return Seq(tuple(step(one) if isinstance(one, str) else one for one in parts))


def when(text: str, then: Part | str, otherwise: Part | str | None = None) -> Part:
    return If(term(text), text, seq(then), None if otherwise is None else seq(otherwise), SPAN)


def check(text: str) -> Part:
    return If(term(text), text, Seq(()), FailingPart(text, SPAN), SPAN)


def hold(text: str, *parts: Part | str) -> Part:
    held = ActionCondition(term(text), text, SPAN, (Conjunct(term(text), SPAN),))
    return HeldPart(seq(*parts), SPAN, True, held)


def within(*parts: Part | str) -> Part:
    return TimedPart(seq(*parts), SPAN, True, Fraction(10))


def either(*parts: Part | str) -> Part:
    return Fallback(tuple(seq(one) for one in parts), SPAN)


def par(*parts: Part | str) -> Part:
    return Par(tuple(seq(one) for one in parts), SPAN)


PARTS: dict[str, Part] = {
    "a sequence": seq("wrap", "boil"),
    "a step that cannot start": seq("boil", "wrap"),
    "a step that reaches the goal is the last": seq("bake", "align"),
    "a step with more tries": seq(step("wrap", 2), "bake"),
    "a further try that cannot start": seq(step("slip", 2), "bake"),
    "a handler between tries": seq(step("bake", 2, "align"), "wrap"),
    "a handler between tries that cannot start": seq(step("bake", 1, "slip"), "wrap"),
    "a handler after the last try": seq(step("bake", 1, None, "align"), "wrap"),
    "a handler after the last try that cannot start": seq(step("bake", 1, None, "slip"), "wrap"),
    "both handlers": seq(step("knead", 2, "wrap", "tilt"), "bake"),
    "a step that chooses a skill": seq(step("any", 0, None, None, "wrap", "fold"), "boil"),
    "a choice at each try": seq(step("any", 1, None, "align", "slip", "fold"), "bake"),
    "a failure of no probability": seq(step("sure", 1, None, "align"), "bake"),
    "a condition": seq(when(ALIGNED, "wrap", "align"), "bake"),
    "a condition without an alternative": seq(when(f"{ALIGNED} or {WRAPPED}", "wrap"), "bake"),
    "a condition that a step before decides": seq("knead", when(DOUGH, "bake", "align"), "wrap"),
    "a check": seq("knead", check(ALIGNED), "bake"),
    "a check after the goal": seq("bake", check(ALIGNED)),
    "alternatives": either(seq("wrap", "boil"), "bake"),
    "alternatives of which the last fails": seq(either("slip", seq("bake", check(DOUGH)), "slip"), "align"),
    "a failure that is tolerated": seq(either("bake", Seq(())), "wrap"),
    "alternatives whose tries may be left out": seq(either(step("knead", 1), step("bake", 1)), "wrap"),
    "alternatives after a step with tries": seq(step("knead", 1), either("fold", "bake")),
    "a part with more tries": RetriedPart(seq("wrap", "bake", check(ALIGNED)), 2, SPAN),
    "tries of parts and of steps": RetriedPart(seq(step("knead", 1), check(ALIGNED), "bake"), 1, SPAN),
    "a held part": seq(hold(ALIGNED, "wrap", "bake")),
    "a held part that loses its condition": seq(either(hold(ALIGNED, "tilt", "wrap"), "align"), "bake"),
    "a held part that fails": seq(either(hold(ALIGNED, "knead", "fold"), "wrap"), "bake"),
    "a held part around a check": hold(f"not {DOUGH}", "knead", check(ALIGNED), "bake"),
    "a held part after the goal": seq("bake", hold(ALIGNED, "roll")),
    "tries that are left out": seq(step("slump", 1, "roll", "align"), "bake"),
    "tries left out before alternatives": seq(
        either(seq(step("slump", 1, "roll"), either("fold", "tilt")), "wrap"), "bake"
    ),
    "tries left out after alternatives": seq(
        either(seq(either("fold", "tilt"), step("slump", 1, "roll")), "wrap"), "bake"
    ),
    "a part held within another": hold(f"not {COOKED}", hold(ALIGNED, "fold", "unfold"), "wrap"),
    "a part within a time": seq(within("wrap", "align"), "bake"),
    "alternatives to a part within a time": seq(either(within("knead", "roll"), "tilt"), "bake"),
    "a choice within a time": seq(
        either(within(step("any", 0, None, None, "fold", "roll")), Seq(())), "boil"
    ),
    "a step with tries within a time": seq(within(step("bake", 1, "align", "tilt")), "wrap"),
    "a held part within a time": within(hold(ALIGNED, step("bake", 1)), "roll"),
    "branches": seq(par(seq("align", "roll"), seq("bake", "unfold")), "wrap"),
    "branches with conditions": par(
        when(ALIGNED, "tilt", "align"), seq("roll", when(WRAPPED, "unfold", "roll"))
    ),
    "a branch that reaches the goal": par("align", seq("bake", "wrap")),
    "branches of which one may fail": seq(either(par("align", "bake"), "roll"), "wrap"),
    "branches within a time": seq(within(par("align", "roll")), "bake"),
    "branches that are held": seq(hold(f"not {DOUGH}", par(seq("tilt", "align"), "roll")), "bake"),
    "a stop leaves a level open": seq(within("pour"), when("fill_level > 0.5", "bake", "align")),
    "three branches": seq(par("align", "roll", either("unfold", "wrap")), "bake"),
}
HANDLERS = {one.id: step(one.id) for one in SKILLS}


NONE = dict.fromkeys((COOKED, WRAPPED, ALIGNED, DOUGH), False)


def compare(body: Part, retry: int, initial: dict[str, Any], margin: Fraction | None = None) -> None:
    """Compare the loop whose one step is a composition, with a margin of the definition of a predicate."""
    assert_as_listed(*cooking_by(body, retry, initial, margin))


def cooking_by(body: Part, retry: int, initial: dict[str, Any], margin: Fraction | None) -> tuple[Ecm, Task]:
    cooking = rule(COOKED, "cooking", retry, "align" if retry else None, "roll" if retry != 1 else None)
    pursued = replace(task("cook", ("cook",), COOKED, cooking), initial=initial)
    made = Composition("made", t.TRUE, None, body, HANDLERS, SPAN)
    text = "fill_level > 0.5"
    defined = {} if margin is None else {ALIGNED: Definition(term(text), text, SPAN, margin)}
    ecm = replace(module("kitchen", SKILLS, pursued), definitions=defined)
    return replace(ecm, compositions={"made": made}, capabilities={"cooking": ("made",)}), pursued


@pytest.mark.parametrize(
    ("retry", "initial"), [(1, {}), (0, {**NONE, "fill_level": Fraction(0)})], ids=["any", "none"]
)
@pytest.mark.parametrize("name", PARTS)
def test_a_composition_comes_through_the_states_that_are_listed(
    name: str, retry: int, initial: dict[str, Any]
) -> None:
    compare(PARTS[name], retry, initial)


@pytest.mark.parametrize("body", [step("bake"), either(seq("knead", "bake"), "slip"), par("roll", "bake")])
def test_further_tries_of_a_composition_may_be_left_out_before_a_reset(body: Part) -> None:
    compare(body, 2, {COOKED: False, DOUGH: False})


@pytest.mark.parametrize("margin", [Fraction(0), Fraction(1)], ids=["sharp", "with a margin"])
@pytest.mark.parametrize(
    "body",
    [
        seq(when(ALIGNED, "wrap", "wrap"), "roll"),
        seq(when(f"{ALIGNED} or {WRAPPED}", "wrap"), "roll"),
        seq("roll", when(f"{ALIGNED} and not {WRAPPED}", "tilt", "align"), "wrap"),
        seq("bake", when(ALIGNED, "roll")),
        seq(either(when(ALIGNED, "roll", "roll"), "unfold"), "wrap"),
        either(when(ALIGNED, "roll", "roll"), "bake"),
    ],
)
def test_a_condition_on_a_predicate_that_may_be_unknown_may_fail(body: Part, margin: Fraction) -> None:
    compare(body, 0, {one: False for one in NONE if one != ALIGNED}, margin)


@pytest.mark.parametrize(
    "part", [within("roll"), within(par("align", "roll")), hold(f"not {COOKED}", par("align", "roll"))]
)
def test_a_stop_is_no_way_to_the_goal(part: Part) -> None:
    system = TransitionSystem(*cooking_by(either(part, "bake"), 0, NONE, None), SITE)
    assert SymbolicLoop(system).dead_end() is not None


@pytest.mark.parametrize(("margin", "fails"), [(Fraction(0), False), (Fraction(1), True)])
def test_a_branch_fails_whose_condition_may_be_unknown(margin: Fraction, fails: bool) -> None:
    initial = {COOKED: False, WRAPPED: False, DOUGH: False}
    ecm, pursued = cooking_by(par(when(ALIGNED, "wrap", "unfold"), "roll"), 0, initial, margin)
    surely = skill("wrap", outcome("wrapped", {WRAPPED: True}))
    also = skill("unfold", outcome("unfolded", {WRAPPED: True}))
    ecm = replace(ecm, skills={**ecm.skills, "wrap": surely, "unfold": also})
    loop = SymbolicLoop(TransitionSystem(ecm, pursued, SITE))
    states = loop.fixpoints.reachable[PLAN] & loop.fixpoints.sets.where(term(f"{DOUGH} and not {WRAPPED}"))
    assert (states != loop.fixpoints.sets.none) is fails
