"""Learned probabilities and durations take the place of the declared ones as results come in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.memory.experience import (
    ExperiencedEnd,
    ExperiencedModules,
    expected_skill,
    experienced_beliefs,
    with_experience,
)
from aeros.agent.memory.posterior import FORGETTING
from aeros.spec.closed_loop.giving_up import PRIOR_TRIES, failure_probability
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.model.ecm import Ecm, Outcome, Skill
from tests.unit.agent.dumplings import module, outcome, skill


def chance(one: Outcome, probability: Fraction, seconds: int = 6) -> Outcome:
    return replace(one, probability=probability, duration=Fraction(seconds))


COOKED = chance(outcome("cooked", {"dumpling_cooked": True}), Fraction(9, 10))
COLD = chance(outcome("cold", {}, failure=True), Fraction(1, 10))
BURNT = chance(outcome("burnt", {}, failure=True), Fraction(0))
BOIL = skill("boil", COOKED, COLD, BURNT)
KITCHEN = replace(module("kitchen", (BOIL, skill("rest", outcome("rested", {})))), code_digest="1")


def learned(*ends: ExperiencedEnd) -> Skill:
    def source(ecm: str, name: str, code: str) -> Sequence[ExperiencedEnd]:
        assert (ecm, code) == ("kitchen", "1")
        return ends if name == "boil" else ()

    return with_experience(KITCHEN, source).skills["boil"]


def probability(one: Skill, name: str) -> float:
    found = one.outcomes[name].probability
    assert found is not None
    return float(found)


def test_without_results_a_module_is_as_declared() -> None:
    assert with_experience(KITCHEN, lambda *_: ()) is KITCHEN


def test_results_change_only_the_skill_that_had_them_also_of_another_module() -> None:
    shop = replace(module("shop", (BOIL,)), code_digest="2")
    resting = skill("rest", outcome("rested", {}))
    foreign = replace(
        KITCHEN.foreign, skills={"shop.boil": BOIL, "shop.rest": resting}, owners={"shop": shop}
    )
    kitchen = replace(KITCHEN, foreign=foreign)
    seen = [ExperiencedEnd("cold", True, 20.0)]
    own = with_experience(kitchen, lambda *asked: seen if asked == ("kitchen", "boil", "1") else ())
    assert own.skills == {**KITCHEN.skills, "boil": learned(*seen)}
    assert own.foreign == foreign
    other = with_experience(kitchen, lambda *asked: seen if asked == ("shop", "boil", "2") else ())
    assert other.skills == KITCHEN.skills
    assert other.foreign.skills == {"shop.boil": learned(*seen), "shop.rest": resting}


def test_a_result_moves_the_probability_by_its_weight() -> None:
    after = learned(ExperiencedEnd("cold", True, 20.0))
    assert probability(after, "cold") == pytest.approx((1 + 0.4) / 5, abs=1e-3)
    assert after.outcomes["cold"].duration == 20
    assert after.outcomes["cooked"].duration == 6  # not seen yet
    assert probability(after, "burnt") == 0.0  # neither declared nor seen


def test_many_results_outweigh_the_declaration_and_new_ones_the_old() -> None:
    cold, cooked = ExperiencedEnd("cold", True, 8.0), ExperiencedEnd("cooked", False, 9.0)
    assert probability(learned(*[cold] * 60), "cold") > 0.6
    assert probability(learned(*[cooked] * 10, *[cold] * 60), "cold") < 0.35


def test_a_failure_without_an_outcome_counts_for_the_declared_failures() -> None:
    after = learned(ExperiencedEnd(None, True, 20.0))
    assert probability(after, "cold") == pytest.approx((1 + 0.4) / 5, abs=1e-3)
    assert after.outcomes["cold"].duration == 6


@given(
    st.lists(st.tuples(st.sampled_from(["cooked", "cold", "burnt", None]), st.floats(0.1, 99)), max_size=80)
)
def test_the_result_is_a_distribution_near_the_definition(drawn: list[tuple[str | None, float]]) -> None:
    ends = [ExperiencedEnd(name, name != "cooked", seconds) for name, seconds in drawn]
    after = learned(*ends)
    shares = {one.id: share for one, share in outcome_probabilities(after.outcomes.values())}
    assert sum(shares.values()) == 1
    if ends and all(name is not None for name, _ in drawn):
        weights = [FORGETTING**age for age in range(len(ends))]
        cold = sum(weight for weight, end in zip(weights, ends, strict=True) if end.outcome == "cold")
        exact = (cold + PRIOR_TRIES * 0.1) / (sum(weights) + PRIOR_TRIES)
        assert float(shares["cold"]) == pytest.approx(exact, abs=3e-3)


def ends(results: str) -> list[ExperiencedEnd]:
    """The ends of `boil`, oldest first: `+` for cooked, `-` for cold."""
    return [ExperiencedEnd("cooked" if one == "+" else "cold", one == "-", 6.0) for one in reversed(results)]


def expected_failure(skill: Skill, ends: list[ExperiencedEnd]) -> Fraction:
    return failure_probability(expected_skill(skill, ends))


def test_an_agent_expects_as_many_failures_as_it_saw_and_could_explain() -> None:
    declared = Fraction(1, 10)
    assert expected_failure(BOIL, []) == declared
    assert expected_failure(BOIL, ends("+" * 20)) < declared / 2
    assert expected_failure(BOIL, ends("+-" * 10 + "+")) > 3 * declared
    # What chance does not explain may have had a cause, as may what was not followed by a success.
    assert expected_failure(BOIL, ends("-" * 7)) == declared
    assert expected_failure(BOIL, ends("+++" + "-" * 7)) == expected_failure(BOIL, ends("+++"))
    assert expected_failure(BOIL, ends("+" + "-" * 8 + "++")) == expected_failure(BOIL, ends("+++"))
    assert expected_failure(BOIL, ends("+" + "-" * 7 + "++")) > 2 * declared


def test_beliefs_are_of_all_skills_that_a_module_may_call() -> None:
    believed = experienced_beliefs(KITCHEN, lambda _, name, __: ends("+" * 9) if name == "boil" else ())
    assert set(believed.skills) == {"boil", "rest"}
    assert failure_probability(believed.skills["boil"]) < Fraction(1, 20)
    assert believed.skills["rest"] is KITCHEN.skills["rest"]


def test_a_module_is_read_when_it_is_asked_for_and_once() -> None:
    asked: list[str] = []

    def source(ecm: str, name: str, code: str) -> Sequence[ExperiencedEnd]:
        asked.append(name)
        return ()

    modules = ExperiencedModules({"kitchen": KITCHEN, "other": Ecm.__new__(Ecm)}, source)
    assert (list(modules), len(modules), asked) == (["kitchen", "other"], 2, [])
    assert modules["kitchen"] is KITCHEN
    assert modules["kitchen"] is KITCHEN
    assert sorted(asked) == ["boil", "rest"]
