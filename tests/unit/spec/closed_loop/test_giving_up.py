"""The rule of giving up: the numbers of failures, and the history that a loop's states keep of a run."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import comb, prod

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.spec.closed_loop import giving_up
from aeros.spec.closed_loop.giving_up import (
    LEAST_CHANCE,
    LEAST_FAILURES,
    MOST_FINISHED,
    AgentBeliefs,
    FinishedStreak,
    RunHistory,
    RunRule,
    chance_of_failures,
    chance_of_streak,
    declared_beliefs,
    failure_probability,
    is_beyond_chance,
    success_probability,
)
from aeros.spec.expr.effects import Increment, QuantityRange
from aeros.spec.model.ecm import Outcome
from tests.unit.agent.dumplings import module, skill

TWENTIETH = Fraction(1, 20)
FAILED = Outcome("not_seen", {}, True, TWENTIETH, None)
SEEN = Outcome("seen", {}, False, 1 - TWENTIETH, None)
EMPTIED = Outcome("emptied", {"empty": True}, False, Fraction(1, 2), None)
MORE = Outcome("more_to_do", {"empty": False}, False, Fraction(9, 20), None)
BELIEFS = AgentBeliefs(
    {
        "look": skill("look", SEEN, FAILED),
        "search": skill("search", SEEN, FAILED),
        "drop": skill("drop", EMPTIED, MORE, FAILED),
    }
)
RULE = RunRule(BELIEFS, ["empty"], [0], ())


def failures_until_given_up(expected: Fraction) -> int:
    return next(n for n in range(1, 600) if is_beyond_chance(n, [(expected, n)]))


@pytest.mark.parametrize(
    ("percent", "times"), [(0, 3), (1, 3), (2, 4), (5, 6), (10, 8), (20, 13), (30, 21), (40, 38), (50, 75)]
)
def test_the_likelier_a_failure_the_more_are_borne(percent: int, times: int) -> None:
    assert failures_until_given_up(Fraction(percent, 100)) == times


def test_seven_failures_of_a_skill_that_fails_in_nine_of_ten_tries_are_nothing_unusual() -> None:
    assert chance_of_failures(Fraction(9, 10), 7) > Fraction(2, 5)


@given(st.integers(0, 4), st.integers(1, 12))
def test_the_chance_is_that_of_an_urn(bad: int, times: int) -> None:
    """Of a beta-binomial: drawn from an urn of four balls, each drawn ball put back with another like it."""
    counted = Fraction(comb(bad + times - 1, times), comb(4 + times - 1, times)) if bad else Fraction(0)
    assert chance_of_failures(Fraction(bad, 4), times) == counted


@given(st.lists(st.tuples(st.fractions(0, 1), st.integers(0, 5)), max_size=3))
def test_chances_of_several_skills_are_multiplied(failures: list[tuple[Fraction, int]]) -> None:
    whole = chance_of_streak(failures)
    assert whole == prod((chance_of_failures(*one) for one in failures), start=Fraction(1))
    assert is_beyond_chance(LEAST_FAILURES, failures) is (whole < LEAST_CHANCE)
    assert not is_beyond_chance(LEAST_FAILURES - 1, failures)


@given(st.fractions(Fraction(1, 50), Fraction(1, 2)))
def test_chance_as_declared_is_given_up_less_than_once_in_a_thousand_times(expected: Fraction) -> None:
    assert expected ** failures_until_given_up(expected) < LEAST_CHANCE


def test_an_agent_believes_what_a_module_declares() -> None:
    look = skill("look", SEEN, FAILED)
    assert failure_probability(look) == TWENTIETH
    assert declared_beliefs(module("m", (look,))).skills == {"look": look}


# The history of a run in the states of a loop, each with one predicate.


def after(rule: RunRule, state: tuple[object, ...], *steps: tuple[str, Outcome]) -> tuple[object, ...]:
    for name, outcome in steps:
        state = (*state[:-1], rule.after_step(state, name, outcome, state))
    return state


def history(state: tuple[object, ...]) -> RunHistory:
    found = state[-1]
    assert isinstance(found, RunHistory)
    return found


def test_a_run_is_given_up_at_the_failure_that_chance_does_not_explain() -> None:
    state = after(RULE, RULE.begin((False,)), *[("look", FAILED)] * 5)
    assert not RULE.has_ended(state)
    state = after(RULE, state, ("look", FAILED))
    assert RULE.has_ended(state)
    assert not RULE.has_ended(RULE.continued(state))
    assert history(state).failures == frozenset()


def test_a_success_and_another_state_begin_anew() -> None:
    state = after(RULE, RULE.begin((False,)), *[("look", FAILED)] * 5, ("look", SEEN))
    assert history(state).failures == frozenset()
    state = after(RULE, state, *[("look", FAILED)] * 5)
    elsewhere = after(RULE, (True, state[-1]), *[("look", FAILED)] * 5)
    assert not RULE.has_ended(elsewhere)
    assert RULE.has_ended(after(RULE, (False, elsewhere[-1]), ("look", FAILED)))
    in_any_state = RunRule(replace(BELIEFS, in_any_state=True), ["empty"], [], ())
    state = after(in_any_state, in_any_state.begin((False,)), *[("look", FAILED)] * 5)
    assert in_any_state.has_ended(after(in_any_state, (True, state[-1]), ("look", FAILED)))


def test_failures_of_several_skills_count_together_after_three_of_the_skill() -> None:
    state = after(RULE, RULE.begin((False,)), *[("look", FAILED), ("search", FAILED)] * 2)
    assert not RULE.has_ended(state)
    assert RULE.has_ended(after(RULE, state, ("look", FAILED)))


def test_a_skill_of_which_there_is_another_does_not_end_the_run() -> None:
    rule = RunRule(BELIEFS, ["empty"], [0], ["look"])
    assert not rule.has_ended(after(rule, rule.begin((False,)), *[("look", FAILED)] * 20))


def test_the_second_verdict_ends_the_run() -> None:
    gone = Outcome("gone", {}, True, TWENTIETH, None, verdict="it is not there")
    state = after(RULE, RULE.begin((False,)), ("look", gone))
    assert not RULE.has_ended(state)
    assert RULE.has_ended(after(RULE, state, ("look", gone)))


def finished_in(rule: RunRule, state: tuple[object, ...], *steps: tuple[str, Outcome]) -> tuple[object, ...]:
    """The state after a plan whose steps end so."""
    return rule.finished(after(rule, rule.planned(state, (0, 1)), *steps))


def finishes_until_given_up(rule: RunRule, *steps: tuple[str, Outcome]) -> int:
    state, times = rule.begin((False,)), 0
    while not rule.has_ended(state) and times < 100:
        state, times = finished_in(rule, state, *steps), times + 1
    return times


def test_a_plan_that_surely_leaves_the_same_state_ends_the_run_the_third_time() -> None:
    assert finishes_until_given_up(RULE) == MOST_FINISHED
    assert finishes_until_given_up(RULE, ("look", SEEN)) == MOST_FINISHED


def test_a_plan_whose_outcome_is_declared_ends_the_run_when_chance_does_not_explain_it() -> None:
    steps = (("look", SEEN), ("drop", MORE), ("look", SEEN))
    assert finishes_until_given_up(RULE, *steps) == failures_until_given_up(Fraction(9, 19)) == 62
    rare = skill("drop", replace(EMPTIED, probability=Fraction(19, 20)), replace(MORE, probability=TWENTIETH))
    certain = RunRule(replace(BELIEFS, skills={**BELIEFS.skills, "drop": rare}), ["empty"], [0], ())
    assert finishes_until_given_up(certain, *steps) == failures_until_given_up(TWENTIETH)
    soonest = RunRule(replace(BELIEFS, in_any_state=True), ["empty"], [], ())
    assert finishes_until_given_up(soonest, *steps) == MOST_FINISHED


def test_finishes_are_in_a_row_and_each_plan_has_its_own() -> None:
    twice = finished_in(RULE, finished_in(RULE, RULE.begin((False,))))
    assert RULE.has_ended(finished_in(RULE, twice))
    assert not RULE.has_ended(RULE.finished(RULE.planned(twice, (1,))))
    elsewhere = finished_in(RULE, (True, twice[-1]))
    assert not RULE.has_ended(finished_in(RULE, (False, elsewhere[-1])))
    # A success in the plan before is none of this one.
    assert history(RULE.planned(after(RULE, twice, ("drop", MORE)), ())).least_likely == 1


@given(st.fractions(0, 1), st.integers(1, 9))
def test_finishes_have_the_chance_of_failures(expected: Fraction, times: int) -> None:
    streak = FinishedStreak()
    for _ in range(times):
        streak = streak.with_finish(expected)
    assert streak == FinishedStreak(times, chance_of_failures(expected, times))


def test_a_success_is_as_likely_as_all_that_would_be_measured_like_it() -> None:
    drop = BELIEFS.skills["drop"]
    assert success_probability(drop, lambda one: one is MORE) == Fraction(9, 19)
    assert success_probability(drop, lambda _: True) == 1
    assert success_probability(drop, lambda _: False) == 0
    assert success_probability(skill("never", replace(FAILED, probability=Fraction(1))), lambda _: True) == 1


def test_a_plan_whose_first_step_cannot_start_is_made_twice() -> None:
    state = RULE.not_started(RULE.planned(RULE.begin((False,)), (0,)), 0)
    assert not RULE.has_ended(state)
    assert RULE.not_started((True, state[-1]), 0) == (True, state[-1])  # other steps came between
    assert RULE.has_ended(RULE.not_started(RULE.planned(state, (0,)), 0))


def test_tries_are_counted_where_they_are_limited() -> None:
    limited = AgentBeliefs(BELIEFS.skills, {"look, bad": "look"}, counted_skill="look", most_tries=2)
    rule = RunRule(limited, ["empty"], [0], ())
    state = after(rule, rule.begin((False,)), ("look, bad", FAILED), ("search", FAILED))
    assert not rule.is_spent(state, "look")
    state = after(rule, state, ("look", FAILED))
    assert rule.is_spent(state, "look, bad")
    assert not rule.is_spent(state, "search")


def test_the_history_is_the_last_value_of_a_longer_state() -> None:
    limited = replace(BELIEFS, counted_skill="look", most_tries=1)
    rule = RunRule(limited, ["full", "empty"], [1], ())
    state = after(rule, rule.planned(rule.begin((True, False)), (0,)), ("look", SEEN))
    assert state[:-1] == (True, False)
    assert rule.is_spent(state, "look")
    assert history(state).planned_in == (False,)
    assert (rule.planned(state, ())[:-1], history(rule.planned(state, ())).planned_in) == (state[:-1], ())
    state = after(rule, state, *[("search", FAILED)] * 6)
    assert history(state).gave_up is True
    assert rule.continued(state) == (*state[:-1], history(state)._replace(gave_up=False))
    assert history(rule.continued(state)).gave_up is False
    finished = rule.finished(rule.planned(rule.begin((True, False)), (0,)))
    again = rule.finished(rule.planned(rule.finished(rule.planned(finished, (0,))), (0,)))
    assert history(again) == history(rule.planned(again, (0,)))._replace(gave_up=True)
    assert (again[:-1], history(again).gave_up) == ((True, False), True)
    first = rule.not_started(rule.planned(rule.begin((True, False)), (0,)), 0)
    assert first[:-1] == (True, False)
    assert history(first).not_started == frozenset({(0, (False,))})
    second = rule.not_started(rule.planned(first, (0,)), 0)
    assert (second[:-1], history(second).gave_up) == ((True, False), True)


def test_a_chance_of_exactly_the_least_is_still_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(giving_up, "LEAST_CHANCE", Fraction(1, 8))
    assert not is_beyond_chance(3, [(Fraction(1, 8), 1)])
    assert is_beyond_chance(3, [(Fraction(1, 9), 1)])
    assert not FinishedStreak(3, Fraction(1, 8)).is_useless
    assert FinishedStreak(3, Fraction(1, 9)).is_useless


def test_chances_are_fractions_also_of_nothing() -> None:
    never = skill("never", replace(SEEN, probability=Fraction(1)))
    found = [failure_probability(never), chance_of_failures(TWENTIETH, 0), chance_of_streak([])]
    assert found == [0, 1, 1]
    assert {type(one) for one in found} == {Fraction}
    assert type(success_probability(never, lambda _: False)) is Fraction


def test_verdicts_differ_by_skill_and_outcome() -> None:
    gone, lost = (Outcome(one, {}, True, TWENTIETH, None, verdict="it is not there") for one in ("a", "b"))
    state = after(RULE, RULE.begin((False,)), ("look", gone), ("look", lost), ("search", gone))
    assert history(state).verdicts == {("look", "a"), ("look", "b"), ("search", "a")}
    assert not RULE.has_ended(state)


def test_of_two_branches_the_history_is_that_of_both() -> None:
    before = RunHistory(failures=frozenset({((False,), "look", 1), ((True,), "look", 1)}))
    one = before._replace(
        failures=before.failures - {((False,), "look", 1)},
        verdicts=frozenset({("look", "gone")}),
        least_likely=Fraction(1, 3),
        tries=2,
        plan=(1,),
    )
    other = before._replace(verdicts=frozenset({("drop", "gone")}), least_likely=Fraction(1, 2), tries=1)
    joint = RunHistory(
        failures=frozenset({((True,), "look", 1)}),
        verdicts=frozenset({("look", "gone"), ("drop", "gone")}),
        plan=(1,),
        least_likely=Fraction(1, 3),
        tries=2,
    )
    assert one.with_branch(before, other) == joint
    assert other.with_branch(before, one) == joint._replace(plan=())
    for first, second in [(True, False), (False, True)]:
        ended = one._replace(gave_up=first).with_branch(before, other._replace(gave_up=second))
        assert ended.gave_up


def test_of_two_branches_the_failures_of_both_count() -> None:
    before = after(RULE, RULE.begin((False,)), ("look", FAILED))
    one = after(RULE, before, ("look", SEEN), *[("search", FAILED)] * 2)
    other = after(RULE, before, ("look", FAILED))
    both = history(one).with_branch(history(before), history(other))
    assert both.failures == frozenset({((False,), "search", 2), ((False,), "look", 2)})
    assert not both.gave_up
    longer = after(RULE, other, ("look", FAILED))
    assert history(one).with_branch(history(before), history(longer)).gave_up


@pytest.mark.parametrize(
    ("count", "level", "likely"),
    [
        (0, "1/4", "1/4"),
        (0, "3/4", "1/4"),
        (0, "1/5", "0"),
        (0, "4/5", "0"),
        (1, "1", "3/4"),
        (1, "1/2", "1"),
    ],
)
def test_effects_are_measured_by_increments_and_closed_ranges(count: int, level: str, likely: str) -> None:
    between = QuantityRange("fill_level", None, Fraction(1, 4), Fraction(3, 4))
    filled = Outcome("filled", {}, False, Fraction(1, 4), None, ranges=(between,))
    added = Outcome("added", {"count": Increment(Fraction(1))}, False, Fraction(3, 4), None)
    beliefs = AgentBeliefs({"work": skill("work", filled, added)})
    rule = RunRule(beliefs, ["count", "fill_level"], [0], ())
    before = rule.begin((Fraction(0), Fraction(0)))
    after = (Fraction(count), Fraction(level))
    assert rule.after_step(before, "work", filled, after).least_likely == Fraction(likely)
    # A quantity that the loop does not depend on is not measured.
    alone = RunRule(beliefs, ["count"], [0], ())
    found = alone.after_step(alone.begin((Fraction(0),)), "work", filled, after[:1]).least_likely
    assert found == (1 if count else Fraction(1, 4))
