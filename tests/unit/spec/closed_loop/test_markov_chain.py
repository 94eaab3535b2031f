"""Predictions of a task: exact, and equal to what a geometric series says."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.closed_loop import markov_chain
from aeros.spec.closed_loop.giving_up import declared_beliefs
from aeros.spec.closed_loop.loop_variables import StateSpaceError
from aeros.spec.closed_loop.markov_chain import Prediction, predict, rank_of
from aeros.spec.closed_loop.outcome_probabilities import with_probabilities
from aeros.spec.closed_loop.transition_system import LoopState, TransitionSystem
from aeros.spec.expr import terms as t
from aeros.spec.model.composition import Composition, Step
from aeros.spec.model.ecm import Ecm, PlanningRule, Skill
from aeros.spec.model.step_graph import Seq
from tests.unit.agent.dumplings import SPAN, module, outcome, rule, site, skill, task
from tests.unit.spec.closed_loop.symbolic.test_builder_small_loops import LOOPS, kitchen

NONE = Fraction(0)
BOIL = skill("boil", outcome("cooked", {"dumpling_cooked": True}), outcome("raw", {}, failure=True))


def boiling(failure: Fraction, retry: int) -> Ecm:
    boil = with_probabilities(BOIL, {"cooked": 1 - failure})
    return cooking(rule("dumpling_cooked", "boil", retry), boil)


def cooking(boiled: PlanningRule, boil: Skill) -> Ecm:
    return module("kitchen", (boil,), task("cook", ("cook",), "dumpling_cooked", boiled))


def predicted(ecm: Ecm, replans: int) -> Prediction:
    system = TransitionSystem(ecm, ecm.tasks["cook"], site())
    return predict(system, (False,) * len(system.names), replans)


@pytest.mark.parametrize("retry", [0, 1, 3])
@pytest.mark.parametrize("replans", [0, 1, 10])
def test_independent_tries_are_a_geometric_series(retry: int, replans: int) -> None:
    p = Fraction(3, 10)
    tries, plans = (1 + retry) * (1 + replans), 1 + replans
    found = predicted(boiling(p, retry), replans)
    assert found.success == 1 - p**tries
    assert found.invocations == sum(p**n for n in range(tries))
    assert found.replans == sum(p ** (n * (1 + retry)) for n in range(1, plans))
    assert found.retries == found.invocations - 1 - found.replans
    assert found.recoveries == 0


def test_the_expected_time_is_that_of_the_outcomes_and_an_unknown_one_counts_as_ten_seconds() -> None:
    ecm = boiling(Fraction(1, 4), 1)
    boil = ecm.skills["boil"]
    timed = {
        name: replace(one, duration=None if one.failure else Fraction(8))
        for name, one in boil.outcomes.items()
    }
    found = predicted(replace(ecm, skills={"boil": replace(boil, outcomes=timed)}), 0)
    # The first try: 3/4 of 8 s, 1/4 of 10 s; with 1/4 a second one.
    assert found.seconds == (Fraction(3, 4) * 8 + Fraction(1, 4) * 10) * Fraction(5, 4)
    assert predicted(ecm, 0).seconds == Fraction(5, 4) * 10


def test_a_goal_reached_at_the_start_needs_no_invocation() -> None:
    ecm = boiling(Fraction(1), 0)
    system = TransitionSystem(ecm, ecm.tasks["cook"], site())
    assert predict(system, (True,), 3) == Prediction(Fraction(1), NONE, NONE, NONE, NONE)


@pytest.mark.parametrize(("replans", "counted"), [(0, 0), (1, 1), (5, 1)])
def test_a_plan_that_is_rejected_is_made_once_more(replans: int, counted: int) -> None:
    ecm = cooking(rule("not dumpling_cooked", "boil"), BOIL)
    assert predicted(ecm, replans) == Prediction(NONE, NONE, NONE, NONE, Fraction(counted))


def test_a_chain_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(markov_chain, "MAX_WORK", 20)
    with pytest.raises(StateSpaceError, match=r"^its Markov chain is too large to be solved exactly$"):
        predicted(boiling(Fraction(3, 10), 3), 10)


def test_a_chain_may_be_as_large_as_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    system = TransitionSystem(boiling(Fraction(1), 0), boiling(Fraction(1), 0).tasks["cook"], site())
    monkeypatch.setattr(markov_chain, "MAX_WORK", 2)  # two states, each of a probability of one bit
    assert predict(system, (True,), 0).success == 1
    monkeypatch.setattr(markov_chain, "MAX_WORK", 1)
    with pytest.raises(StateSpaceError, match=r"^its Markov chain is too large to be solved exactly$"):
        predict(system, (True,), 0)


def test_a_recovery_is_counted_between_two_tries() -> None:
    half = Fraction(1, 2)
    boil = with_probabilities(BOIL, {"cooked": half})
    cool = skill("cool", outcome("cooled", {"wrapper_aligned": True}))
    ecm = module(
        "kitchen",
        (boil, cool),
        task("cook", ("cook",), "dumpling_cooked", rule("dumpling_cooked", "boil", 1, "cool")),
    )
    # First try, then with 1/2 recovery and second try, which fails with 1/2 again.
    assert predicted(ecm, 0) == Prediction(Fraction(3, 4), Fraction(2), half, half, NONE)
    assert predicted(ecm, 0).seconds == 20  # ten for each, the recovery included
    # The same again after a new plan, which is made with 1/4.
    assert predicted(ecm, 1) == Prediction(
        Fraction(15, 16), Fraction(5, 2), Fraction(5, 8), Fraction(5, 8), Fraction(1, 4)
    )


def test_a_goal_that_the_last_recovery_reaches_needs_no_new_plan() -> None:
    bake = skill("bake", outcome("baked", {"dumpling_cooked": True}))
    boil = with_probabilities(BOIL, {"cooked": Fraction(1, 2)})
    cooking = rule("dumpling_cooked", "boil", 0, None, "bake")
    ecm = module("kitchen", (boil, bake), task("cook", ("cook",), "dumpling_cooked", cooking))
    for replans in (0, 1, 2):
        assert predicted(ecm, replans) == Prediction(Fraction(1), Fraction(3, 2), NONE, Fraction(1, 2), NONE)


def test_the_steps_of_a_composition_are_counted() -> None:
    steps = tuple(Step(one, one, {}, {}, 0, None, None, SPAN) for one in ("wrap", "boil"))
    wrap = skill("wrap", outcome("wrapped", {"dumpling_wrapped": True}), outcome("torn", {}, failure=True))
    boil = skill("boil", outcome("cooked", {"dumpling_cooked": True}))
    ecm = replace(
        module(
            "kitchen",
            (wrap, boil),
            task("cook", ("cook",), "dumpling_cooked", rule("dumpling_cooked", "cooking")),
        ),
        compositions={"both": Composition("both", t.TRUE, None, Seq(steps), {}, SPAN)},
        capabilities={"cooking": ("both",)},
    )
    # One run has wrapping, and boiling with 1/2.
    assert predicted(ecm, 0) == Prediction(Fraction(1, 2), Fraction(3, 2), NONE, NONE, NONE)
    assert predicted(ecm, 1) == Prediction(Fraction(3, 4), Fraction(9, 4), NONE, NONE, Fraction(1, 2))


def test_states_that_meet_again_add_up() -> None:
    """Both outcomes of the first step lead to the same second step, in different states."""
    shake = skill(
        "shake", outcome("up", {"wrapper_aligned": True}), outcome("down", {"wrapper_aligned": False})
    )
    boil = with_probabilities(BOIL, {"cooked": Fraction(2, 3)})
    ecm = module(
        "kitchen",
        (shake, boil),
        task(
            "cook",
            ("cook",),
            "dumpling_cooked",
            rule("dumpling_wrapped", "shake"),
            rule("dumpling_cooked", "boil"),
        ),
    )
    assert predicted(ecm, 0) == Prediction(Fraction(2, 3), Fraction(2), NONE, NONE, NONE)


@pytest.mark.parametrize("gives_up", [False, True])
def test_every_move_leads_to_a_higher_rank(gives_up: bool) -> None:
    for rules in LOOPS.values():
        ecm, pursued = kitchen(*rules)
        beliefs = declared_beliefs(ecm) if gives_up else None
        system = TransitionSystem(ecm, pursued, site(), beliefs)
        pending = [(0, LoopState("plan", system.start(dict.fromkeys(system.names, False))))]
        seen = set(pending)
        while pending:
            made, node = pending.pop()
            for move in system.transitions(node):
                after = (made + (move.target.phase == "plan"), move.target)
                assert rank_of(*after) > rank_of(made, node)
                if after not in seen and after[0] < 3:
                    seen.add(after)
                    pending.append(after)
