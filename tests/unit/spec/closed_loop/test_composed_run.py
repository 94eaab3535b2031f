"""Runs of a composition inside the loop: where they end, how likely, and how many skills they submit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import pytest

from aeros.spec.closed_loop import composed_run
from aeros.spec.closed_loop.composed_run import ComposedRun, HandlerCycleError, RunTooLargeError, Weights
from aeros.spec.closed_loop.definition_facts import OutcomeValues
from aeros.spec.closed_loop.giving_up import RunHistory
from aeros.spec.closed_loop.invocation import Invocation, State, StateCondition
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.consequences.durations import may_be_late
from aeros.spec.consequences.stopped_parts import stop_of_part
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, Part, Step
from aeros.spec.model.ecm import ActionCondition, Outcome, Skill
from aeros.spec.model.hold_conditions import STOPPED
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
from tests.unit.agent.dumplings import PREDICATES, SPAN, STATE, outcome, skill, term

NAMES = PREDICATES[:3]
DOUGH, FILLING, ALIGNED = NAMES
HALF = Fraction(1, 2)
SKILLS = {
    one.id: one
    for one in (
        skill("dough", outcome("there", {DOUGH: True}), outcome("torn", {}, failure=True)),
        skill("filling", outcome("there", {FILLING: True}), precondition=DOUGH),
        skill("water", outcome("wet", {FILLING: True})),
        skill("align", outcome("aligned", {ALIGNED: True}), outcome("askew", {}, failure=True)),
    )
}


def step(name: str, retry: int = 0, between: str | None = None, last: str | None = None) -> Step:
    return Step(name, name, {}, {}, retry, between, last, SPAN)


def made_run(
    body: Part,
    goal: t.Term,
    uncertain: tuple[str, ...],
    skills: Mapping[str, Skill],
    handlers: Mapping[str, Step],
    is_late: Callable[[TimedPart[Step]], bool],
) -> ComposedRun:
    """A composition inside the loop; its skills measure all of `NAMES`."""
    return ComposedRun(
        Composition("c", t.TRUE, None, body, dict(handlers), SPAN),
        lambda name, inputs: Invocation(skills[name], inputs, NAMES),
        lambda condition: StateCondition(condition, NAMES),
        StateCondition(goal, NAMES),
        lambda part: Invocation(stop_of_part(part, handlers, skills, STATE, {}), {}, NAMES, NAMES),
        is_late,
        uncertain,
    )


def run(
    body: Part, goal: t.Term = t.FALSE, uncertain: tuple[str, ...] = (), **handlers: Step
) -> tuple[Weights, Weights, ComposedRun]:
    made = made_run(body, goal, uncertain, SKILLS, handlers, lambda part: may_be_late(part, handlers, SKILLS))
    done, failed, _ = made.run((False, False, False), "step")
    return done, failed, made


def shown(weights: Weights) -> dict[State, tuple[Any, ...]]:
    return {state: (one.probability, *one.counts) for state, one in weights.items()}


def test_a_sequence_ends_with_its_first_failure() -> None:
    done, failed, _ = run(Seq((step("dough"), step("filling"))))
    assert shown(done) == {(True, True, False): (HALF, 1, 0, 0)}
    assert shown(failed) == {(False, False, False): (HALF, HALF, 0, 0)}


def test_a_branch_on_an_uncertain_predicate_may_fail_with_probability_0() -> None:
    choice = If(term(DOUGH), DOUGH, step("filling"), step("water"), SPAN)
    body = Seq((step("align"), choice))
    aligned = (False, False, True)
    certain, uncertain = run(body)[1], run(body, uncertain=(DOUGH,))[1]
    assert aligned not in certain
    assert shown(uncertain)[aligned] == (0, 0, 0, 0)
    assert run(body, uncertain=(ALIGNED,))[1] == certain
    assert run(body)[0] == run(body, uncertain=(DOUGH,))[0]
    both = If(term(f"{FILLING} and {DOUGH}"), "both", step("filling"), step("water"), SPAN)
    # It is false whatever `dough` is, as there is no filling; but a run takes no branch with a value unknown.
    assert shown(run(Seq((step("align"), both)), uncertain=(DOUGH,))[1])[aligned] == (0, 0, 0, 0)


def test_tries_and_recoveries_are_counted() -> None:
    done, failed, _ = run(step("dough", 1, "water", "align"), water=step("water"), align=step("align"))
    quarter = Fraction(1, 4)
    assert shown(done) == {
        (True, False, False): (HALF, HALF, 0, 0),
        (True, True, False): (quarter, quarter, quarter, quarter),
    }
    eighth = Fraction(1, 8)
    # The states of probability 0 are those of runs in which memory leaves out the second try.
    assert {state: one for state, one in shown(failed).items() if one[0]} == {
        (False, True, True): (eighth, eighth, eighth, quarter),
        (False, True, False): (eighth, eighth, eighth, quarter),
    }
    assert {state for state, one in shown(failed).items() if not one[0]} == {
        (False, False, True),
        (False, False, False),
    }


def test_a_step_that_cannot_start_fails() -> None:
    done, failed, _ = run(step("filling"))
    assert done == {}
    assert shown(failed) == {(False, False, False): (1, 0, 0, 0)}


def test_a_condition_chooses_and_one_that_says_nothing_fails() -> None:
    choice = If(term(DOUGH), DOUGH, step("filling"), step("water"), SPAN)
    assert shown(run(choice)[0]) == {(False, True, False): (1, 1, 0, 0)}
    silent = If(term(DOUGH), DOUGH, step("filling"), None, SPAN)
    assert shown(run(silent)[1]) == {(False, False, False): (1, 0, 0, 0)}


def test_branches_succeed_together_and_fail_at_any_point_of_the_others() -> None:
    done, failed, made = run(Par((step("dough"), step("water")), SPAN))
    assert shown(done) == {(True, True, False): (HALF, 1, 0, 0)}
    assert {state: one.probability for state, one in failed.items()} == {
        (False, False, False): 0,
        (False, True, False): 0,
    }
    assert not made.is_exact
    assert run(Par((step("water"), step("align")), SPAN))[2].is_exact is False
    _, failed, made = run(Par((step("water"), step("water")), SPAN))
    assert (failed, made.is_exact) == ({}, True)


def test_once_the_goal_is_reached_nothing_more_starts() -> None:
    done, failed, _ = run(Seq((step("water"), step("dough"), step("align"))), term(FILLING))
    assert shown(done) == {(False, True, False): (1, 1, 0, 0)}
    assert failed == {}


def test_alternatives_and_tries_share_the_probability_of_failures() -> None:
    done, failed, made = run(Fallback((step("dough"), step("align"), step("water")), SPAN))
    quarter = Fraction(1, 4)
    assert shown(done) == {
        (True, False, False): (HALF, HALF, 0, 0),
        (False, False, True): (quarter, HALF, 0, 0),
        (False, True, False): (quarter, 3 * quarter, 0, 0),
    }
    assert failed == {}
    assert made.is_exact
    done, failed, _ = run(RetriedPart(step("dough"), 1, SPAN))
    assert shown(done) == {(True, False, False): (3 * quarter, 3 * quarter, quarter, 0)}
    assert shown(failed) == {(False, False, False): (quarter, quarter, quarter, 0)}
    done, failed, _ = run(Fallback((step("dough"), Seq(())), SPAN))
    assert sum(one.probability for one in done.values()) == 1
    assert failed == {}


def test_after_a_failed_par_no_probability_is_known() -> None:
    both = Par((step("align"), step("water")), SPAN)
    _, _, made = run(Fallback((both, step("dough")), SPAN))
    assert not made.is_exact
    assert not made.is_success_known


def test_a_try_that_memory_leaves_out_leads_to_the_next_alternative() -> None:
    wet = (False, True, False)
    body = Fallback((Seq((step("water"), step("dough", retry=1))), step("align")), SPAN)
    _, failed, _ = run(body)
    assert wet in failed
    check: Part = If(term(DOUGH), DOUGH, Seq(()), FailingPart(DOUGH, SPAN), SPAN)
    done, failed, _ = run(Seq((check, step("dough"))))
    assert (done, set(failed)) == ({}, {(False, False, False)})
    done, failed, _ = run(FailingPart(DOUGH, SPAN), goal=t.TRUE)
    assert (len(done), failed) == (1, {})


def held(part: Part, text: str) -> HeldPart[Step]:
    clause = ActionCondition(term(text), text, SPAN, (Conjunct(term(text), SPAN),))
    return HeldPart(part, SPAN, True, clause)


NONE, DONE = (False, False, False), (True, False, False)


def test_a_held_part_may_fail_before_and_after_each_step_with_probability_0() -> None:
    done, failed, made = run(held(step("dough"), f"not {ALIGNED}"))
    assert shown(done) == {DONE: (HALF, HALF, 0, 0)}
    assert shown(failed)[NONE] == (HALF, HALF, 0, 0)
    # What the condition reads may have any value, whatever the step has done.
    others = {DONE, (False, False, True), (True, False, True)}
    assert failed.keys() == {NONE} | others
    assert all(failed[state].probability == 0 for state in others)
    assert made.is_exact
    assert not made.is_open


def test_a_held_part_fails_where_its_condition_does_not_hold_or_a_step_ends_it() -> None:
    assert run(held(step("dough"), ALIGNED))[0] == {}
    done, failed, _ = run(held(Seq((step("dough"), step("align"))), f"not {DOUGH}"))
    assert done == {}
    assert shown(failed)[DONE][0] == HALF
    assert run(held(step("dough"), ALIGNED), goal=term(f"not {DOUGH}"))[0].keys() == {NONE}


def test_a_part_that_may_be_late_has_no_known_probability() -> None:
    late = TimedPart(step("dough"), SPAN, True, Fraction(1))
    done, failed, made = run(late)
    assert (shown(done), made.is_open) == ({DONE: (HALF, HALF, 0, 0)}, True)
    assert failed.keys() == {NONE, DONE}
    assert not run(TimedPart(step("dough"), SPAN, True, Fraction(10**6)))[2].is_open


def test_one_order_of_branches_may_end_a_condition_around_them() -> None:
    both = Par((step("dough"), step("align")), SPAN)
    assert not run(held(both, f"not {FILLING}"))[2].is_open
    done, failed, made = run(held(both, f"not ({DOUGH} and {ALIGNED})"))
    assert made.is_open
    assert done == {}
    assert {(True, False, True), (True, True, False)} <= failed.keys() | {(True, True, False)}


def test_handlers_that_lead_back_to_each_other_are_named_with_their_composition() -> None:
    with pytest.raises(HandlerCycleError, match=r"^the handlers of `c` lead back to each other$") as found:
        run(step("dough", last="again"), again=step("water", last="again"))
    assert found.value.composition.id == "c"


def test_a_run_comes_through_so_many_states_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    body = Seq((step("water"), step("dough")))  # through two states after the start
    monkeypatch.setattr(composed_run, "MAX_STATES", 2)
    assert run(body)[0]
    monkeypatch.setattr(composed_run, "MAX_STATES", 1)
    with pytest.raises(RunTooLargeError):
        run(body)


MAYBE = skill("maybe", outcome("done", {DOUGH: True}), outcome("nothing", {}))


def test_the_goal_may_be_reached_while_a_branch_that_changes_nothing_still_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(SKILLS, "maybe", MAYBE)
    both = Par((step("maybe"), step("water")), SPAN)
    assert run(both)[2].is_exact is True
    done, failed, made = run(both, term(f"{FILLING} and not {DOUGH}"))
    assert (made.is_exact, made.is_success_known, failed) == (False, False, {})
    reached = ((False, False, False), DONE, (False, True, False), (True, True, False))
    assert shown(done) == dict.fromkeys(reached, (0, 0, 0, 0))


def test_the_changes_of_branches_are_put_together() -> None:
    before = RunHistory()
    one, other = RunHistory(tries=1, gave_up=True), RunHistory(tries=2)
    merged = composed_run._merged(
        (False, False, True, before), [(True, False, True, one), (False, False, False, other)]
    )
    assert merged == (True, False, False, RunHistory(tries=2, gave_up=True))
    first = RunHistory(failures=frozenset({((), "look", 1)}))
    longer = RunHistory(failures=frozenset({((), "look", 2)}))
    gone = RunHistory(failures=frozenset({((), "wipe", 1)}))
    # A failure that one of them has from before counts once.
    merged = composed_run._merged((first,), [(longer,), (gone._replace(failures=first.failures),)])
    assert merged == (longer,)


def test_a_further_try_that_cannot_start_leads_to_the_last_handler(monkeypatch: pytest.MonkeyPatch) -> None:
    once = skill(
        "once",
        outcome("there", {DOUGH: True}),
        outcome("spilt", {FILLING: True}, failure=True),
        precondition=f"not {FILLING}",
    )
    monkeypatch.setitem(SKILLS, "once", once)
    _, failed, _ = run(step("once", 1, last="align"), align=step("align"))
    quarter = Fraction(1, 4)
    assert {state: one.probability for state, one in failed.items()} == {
        (False, True, True): quarter,
        (False, True, False): quarter,
    }


def test_a_stop_that_leaves_too_much_open_is_refused() -> None:
    def find(_: Skill, one: Outcome) -> OutcomeValues:
        return OutcomeValues({DOUGH: tuple(range(300))} if one.id == STOPPED else {}, {}, ())

    made = Invocation(SKILLS["align"], {}, NAMES, (), find)
    with pytest.raises(StateSpaceError, match=r"^`align` leaves 1 variables of it at any value$"):
        composed_run._stopped(made, (False, False, False))
