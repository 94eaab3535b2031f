"""The plan with the least expected time, within a bound of risk."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from aeros.spec.model.ecm import Outcome, Skill
from aeros.spec.model.expected_time import FAILURE_COST_S
from aeros.spec.planning.domain import PlanningDomain
from aeros.spec.planning.quickest import (
    QuickestPath,
    estimate_step,
    estimate_strategy,
    quickest_strategy,
)
from aeros.spec.planning.search_result import AvoidSet
from tests.unit.agent.dumplings import outcome, skill
from tests.unit.spec.planning.kitchen import UNTOUCHED, chain, choice_of, domain_of


def timed(one: Outcome, seconds: int, probability: Fraction | None = None) -> Outcome:
    return replace(one, duration=Fraction(seconds), probability=probability)


def once(
    name: str, effect: str, seconds: int, failure: Fraction = Fraction(0), needs: str | None = None
) -> Skill:
    outcomes = [timed(outcome("done", {effect: True}), seconds, 1 - failure)]
    if failure:
        outcomes.append(timed(outcome("failed", {}, failure=True), seconds, failure))
    return skill(name, *outcomes, precondition=needs)


WRAP = once("wrap", "dumpling_wrapped", 6)
BOIL = once("boil", "dumpling_cooked", 8, needs="dumpling_wrapped")


def plan(domain: PlanningDomain, retries: int = 0, max_risk: float = 1.0) -> list[str]:
    start = domain.state(UNTOUCHED)
    strategy = quickest_strategy(domain, start, retries, max_risk)
    assert strategy.solves(start)
    names = []
    while domain.goal(start) is not True:
        names.append(strategy.chosen[start].skill.id)
        start = next(then for then, one, _ in domain.after(strategy.chosen[start], start) if not one.failure)
    return names


def test_two_quick_steps_are_preferred_to_a_slow_one_and_a_quick_one_to_both() -> None:
    assert plan(domain_of(WRAP, BOIL, once("fry", "dumpling_cooked", 35))) == ["wrap", "boil"]
    assert plan(domain_of(WRAP, BOIL, once("fry", "dumpling_cooked", 13))) == ["fry"]


def test_a_step_that_fails_often_costs_its_repetitions() -> None:
    fry = once("fry", "dumpling_cooked", 10, Fraction(1, 10))
    domain = domain_of(WRAP, BOIL, fry)
    step = estimate_step(domain, choice_of(domain, "fry"), domain.state(UNTOUCHED), 2)
    assert step.seconds == pytest.approx((10 + FAILURE_COST_S / 10) / 0.9)
    assert step.risk == pytest.approx(1e-3)
    assert plan(domain) == ["wrap", "boil"]


def test_wear_counts_as_time_in_each_try() -> None:
    fry = replace(once("fry", "dumpling_cooked", 13, Fraction(1, 10)), wear=Fraction(5))
    domain = domain_of(WRAP, BOIL, fry)
    step = estimate_step(domain, choice_of(domain, "fry"), domain.state(UNTOUCHED), 2)
    assert step.seconds == pytest.approx((13 + 5 + FAILURE_COST_S / 10) / 0.9)


def test_time_gives_way_to_a_risk_above_the_bound() -> None:
    fry = once("fry", "dumpling_cooked", 1, Fraction(1, 10))
    domain = domain_of(WRAP, BOIL, fry)
    assert plan(domain) == ["fry"]
    assert plan(domain, max_risk=0.05) == ["wrap", "boil"]
    assert plan(domain, retries=1, max_risk=0.05) == ["fry"]  # both tries fail with 1 %
    # Nothing else is there: the least risk is proposed, and its estimate says how large it is.
    alone = domain_of(fry)
    strategy = quickest_strategy(alone, alone.state(UNTOUCHED), 0, 0.05)
    assert estimate_strategy(strategy, alone.state(UNTOUCHED), 0).risk == pytest.approx(0.1)


def test_without_durations_the_plan_has_the_fewest_steps() -> None:
    bare = skill("fry", outcome("done", {"dumpling_cooked": True}))
    wrap, boil = (
        skill("wrap", outcome("done", {"dumpling_wrapped": True})),
        skill("boil", outcome("done", {"dumpling_cooked": True}), precondition="dumpling_wrapped"),
    )
    assert plan(domain_of(wrap, boil, bare)) == ["fry"]


def test_in_a_large_domain_the_path_has_the_fewest_steps() -> None:
    domain = chain(12)
    path = QuickestPath(0.0, 0, most_states=5)(domain, (False,) * 12, AvoidSet())
    assert path is not None
    assert len(path) == 12


def test_no_path_leads_from_or_through_what_is_avoided() -> None:
    domain = domain_of(WRAP, BOIL)
    start, find = domain.state(UNTOUCHED), QuickestPath(0.0, 0)
    assert find(domain, start, AvoidSet({start})) is None
    assert find(domain, start, AvoidSet(set(), {(start, choice_of(domain, "wrap"))})) is None
    assert not quickest_strategy(domain_of(WRAP), domain_of(WRAP).state(UNTOUCHED), 0).solves(
        domain_of(WRAP).state(UNTOUCHED)
    )
