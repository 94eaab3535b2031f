"""The stop of a part leaves open what its condition reads, and what parallel steps may set."""

from __future__ import annotations

from fractions import Fraction

from aeros.spec.consequences.stopped_parts import parallel_skills, stop_of_part
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Part, Step
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.hold_conditions import HOLD_LOST, STOPPED, hold_loss_outcomes
from aeros.spec.model.step_graph import HeldPart, Par, Seq, TimedPart
from tests.unit.agent.dumplings import SPAN, STATE, outcome, skill, term

SKILLS = {
    one.id: one
    for one in (
        skill("dough", outcome("there", {"dough_on_workspace": True})),
        skill("align", outcome("aligned", {"wrapper_aligned": True})),
        skill("cure", outcome("cured", {"filling_on_workspace": False})),
    )
}
HANDLERS = {"cure": Step("cure", "cure", {}, {}, 0, None, None, SPAN)}
DOUGH = Step("dough", "dough", {}, {}, 0, None, "cure", SPAN)
ALIGN = Step("align", "align", {}, {}, 0, None, None, SPAN)


def read_by_stop(part: HeldPart[Step] | TimedPart[Step]) -> set[str]:
    stop = stop_of_part(part, HANDLERS, SKILLS, STATE, {})
    assert [one.id for one in stop.outcomes.values()] == [STOPPED]
    return set() if stop.hold_condition is None else set(t.variables_of(stop.hold_condition.term))


def held(part: Part, text: str) -> HeldPart[Step]:
    return HeldPart(part, SPAN, True, ActionCondition(term(text), text, SPAN))


def test_a_time_out_leaves_nothing_open_but_what_the_steps_do() -> None:
    assert read_by_stop(TimedPart(Seq((DOUGH, ALIGN)), SPAN, True, Fraction(1))) == set()


def test_a_lost_condition_leaves_open_what_it_reads() -> None:
    part = held(Seq((DOUGH, ALIGN)), "dumpling_wrapped and not dumpling_cooked")
    assert read_by_stop(part) == {"dumpling_wrapped", "dumpling_cooked"}
    stop = stop_of_part(part, HANDLERS, SKILLS, STATE, {})
    after = hold_loss_outcomes(stop, {"dumpling_wrapped"})
    assert {one.id for one in after} == {HOLD_LOST}
    assert [one.effects for one in after] == [{"dumpling_wrapped": False}, {"dumpling_wrapped": True}]


def test_parallel_steps_and_their_handlers_may_have_come_to_any_point() -> None:
    par: TimedPart[Step] = TimedPart(Seq((Par((DOUGH, ALIGN), SPAN),)), SPAN, True, Fraction(1))
    assert read_by_stop(par) == {"dough_on_workspace", "filling_on_workspace", "wrapper_aligned"}
    assert [one.id for one in parallel_skills(par, HANDLERS, SKILLS)] == ["dough", "cure", "align"]
    assert parallel_skills(held(DOUGH, "dumpling_wrapped"), HANDLERS, SKILLS) == []
