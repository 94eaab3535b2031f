"""The rule of giving up in the prediction against the agent's own loop, run on every sequence of outcomes.

The agent has a module whose probabilities are not those by which outcomes happen, as where a manifest is
wrong.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from aeros.experiments.failure_models import module_with_failure_rate
from aeros.spec.closed_loop.giving_up import LEAST_FAILURES, failure_probability
from aeros.spec.closed_loop.markov_chain import Prediction
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.model.ecm import Ecm, Outcome, Skill
from tests.differential.planning.small_tasks import START, Case, cases
from tests.differential.planning.test_prediction import measured
from tests.differential.planning.tree_expansion import Expected
from tests.differential.real_loop import every_run
from tests.differential.reference_cases import (
    as_tuple,
    in_small,
    predicted,
    predicted_without_giving_up,
    reference,
)
from tests.hypothesis_profiles import examples
from tests.unit.agent import dumplings
from tests.unit.agent.dumplings import PREDICATES, skill

HELD, DONE = PREDICATES[:2]

FAILING = {
    "make_dumplings": ("wrap", "not_sealed"),
    "clean_table": ("wipe", "streaky"),
    "fetch_object": ("detect", "not_seen"),
}
"""The skill and outcome of each reference module that fail here, as in the paper; no other does."""


def enumerated(case: Case, believed: Ecm, most: int) -> Expected | None:
    """The mean over every run of an agent that has the module `believed`; None for more than `most` runs."""
    means, whole = [Fraction(0)] * 5, Fraction(0)
    runs = every_run(believed, case.task, case.site, case.start, case.ecm)
    for number, (probability, run) in enumerate(runs):
        if number == most:
            return None
        whole += probability
        means = [m + probability * x for m, x in zip(means, measured(run.report), strict=True)]
    assert whole == 1
    return Expected(*means)


def with_failures(skill: Skill, share: Fraction) -> Skill:
    """The skill, with failures of this probability together; as it is if it has none, or nothing else."""
    shares = outcome_probabilities(skill.outcomes.values())
    fails = failure_probability(skill)
    if fails in (0, 1):
        return skill

    def scaled(one: Outcome, old: Fraction) -> Outcome:
        return replace(one, probability=old * (share / fails if one.failure else (1 - share) / (1 - fails)))

    return replace(skill, outcomes={one.id: scaled(one, old) for one, old in shares})


def with_all_failures(ecm: Ecm, share: Fraction) -> Ecm:
    """The module, in which each skill fails as often."""
    return replace(ecm, skills={name: with_failures(one, share) for name, one in ecm.skills.items()})


def paper_case(name: str, rate: Fraction) -> tuple[Case, Ecm]:
    """A reference module of which one skill fails at a rate, with 10 re-plans; and one that declares 10 %."""
    case = in_small(reference(name, 10))
    skill, outcome = FAILING[name]
    failing = module_with_failure_rate(case.ecm, {"skill": skill, "outcome": outcome}, rate)
    return replace(case, ecm=failing), with_all_failures(case.ecm, Fraction(1, 10))


def compared(name: str, rate: Fraction) -> tuple[Expected, Prediction, Prediction]:
    """The mean over every run, its prediction, and that of an agent that never gives up."""
    world, believed = paper_case(name, rate)
    found = enumerated(world, believed, most=3_000)
    assert found is not None
    return found, predicted(world, believed), predicted_without_giving_up(world)


@pytest.mark.parametrize("rate", ["1/10", "1/2", "9/10"])
@pytest.mark.parametrize("name", FAILING)
def test_reference_modules_are_predicted_under_a_wrong_manifest_and_a_chain_without_the_rule_is_refuted(
    name: str, rate: str
) -> None:
    found, exact, without_the_rule = compared(name, Fraction(rate))
    assert as_tuple(exact) == found
    assert as_tuple(without_the_rule) != found
    assert without_the_rule.success > exact.success


@pytest.mark.parametrize(
    ("name", "declared", "tries"),
    [("make_dumplings", "1/10", 8), ("clean_table", "1/20", 6), ("fetch_object", "1/20", 6)],
)
def test_the_numbers_of_the_page_on_experiments(name: str, declared: str, tries: int) -> None:
    world, _ = paper_case(name, Fraction(9, 10))
    believed = with_all_failures(world.ecm, Fraction(declared))
    assert predicted(world, believed).success == 1 - Fraction(9, 10) ** tries
    assert predicted(world).success > predicted(world, believed).success  # if the manifest declares the rate
    world, _ = paper_case(name, Fraction(2, 5))
    cost = predicted_without_giving_up(world).success - predicted(world, believed).success
    assert 0 < cost < Fraction(1, 200)


def with_first_success(ecm: Ecm, share: Fraction) -> Ecm:
    """The module, in which each success of a skill is its first outcome that is one as often."""

    def changed(skill: Skill) -> Skill:
        shares = outcome_probabilities(skill.outcomes.values())
        successes = [(one, old) for one, old in shares if not one.failure]
        whole = sum((old for _, old in successes), Fraction(0))
        if len(successes) < 2 or not whole:
            return skill
        others = (1 - share) / (len(successes) - 1)
        found = {one.id: replace(one, probability=old) for one, old in shares}
        for number, (one, _) in enumerate(successes):
            found[one.id] = replace(one, probability=whole * (others if number else share))
        return replace(skill, outcomes=found)

    return replace(ecm, skills={name: changed(one) for name, one in ecm.skills.items()})


def tidying(more_to_do: Fraction) -> Case:
    """A task of two steps, of which the second often leaves the state in which the plan was made."""
    pick = skill("pick", Outcome("picked", {HELD: True}, False, Fraction(1), None))
    emptied = Outcome("emptied", {HELD: False, DONE: True}, False, 1 - more_to_do, None)
    more = Outcome("more_to_do", {HELD: False, DONE: False}, False, more_to_do, None)
    drop = skill("drop", emptied, more, precondition=HELD)
    rules = (dumplings.rule(f"{HELD} or {DONE}", "pick"), dumplings.rule(DONE, "drop"))
    tidy = dumplings.task("tidy", ("tidy",), DONE, *rules)
    return Case(dumplings.module("small", (pick, drop), tidy), tidy, dumplings.site(replans=10), dict(START))


@pytest.mark.parametrize(("declared", "plans"), [("9/20", 11), ("1/20", 6), ("1/10", 8), ("1/100", 3)])
def test_a_declared_outcome_that_leaves_the_state_is_given_up_where_chance_does_not_explain_it(
    declared: str, plans: int
) -> None:
    often = Fraction(9, 20)
    world, believed = tidying(often), tidying(Fraction(declared)).ecm
    found = enumerated(world, believed, most=100)
    assert as_tuple(predicted(world, believed)) == found
    assert found is not None
    assert found.success == 1 - often**plans


def test_a_plan_that_surely_leaves_the_state_is_given_up_the_third_time() -> None:
    world, believed = tidying(Fraction(9, 20)), tidying(Fraction(1)).ecm
    found = enumerated(world, believed, most=100)
    assert as_tuple(predicted(world, believed)) == found
    assert found is not None
    assert found.success == 1 - Fraction(9, 20) ** 3


@examples(25)
@given(cases(most_rules=2, most_retries=1, most_replans=3), st.sampled_from(["1/100", "1/2", "99/100"]))
def test_random_tasks_whose_successes_the_agent_does_not_expect(case: Case, share: str) -> None:
    assume(not any("force" in one.precondition.text for one in case.ecm.skills.values() if one.precondition))
    believed = with_first_success(case.ecm, Fraction(share))
    assume(any(believed.skills[name] is not one for name, one in case.ecm.skills.items()))
    found = enumerated(case, believed, most=400)
    assume(found is not None)
    assert as_tuple(predicted(case, believed)) == found


@examples(25)
@given(cases(most_rules=2, most_retries=2, most_replans=3))
def test_random_tasks_whose_failures_the_agent_does_not_expect(case: Case) -> None:
    # A number that is not met is waited for, and no plan that fails: predictions assume that it is met.
    assume(not any("force" in one.precondition.text for one in case.ecm.skills.values() if one.precondition))
    believed = with_all_failures(case.ecm, Fraction(1, 100))
    assume(any(failure_probability(one) == Fraction(1, 100) for one in believed.skills.values()))
    found = enumerated(case, believed, most=400)
    assume(found is not None)
    assert as_tuple(predicted(case, believed)) == found


def test_the_rule_needs_three_failures_of_the_skill() -> None:
    world, believed = paper_case("clean_table", Fraction(1))
    assert predicted(world, believed).retries + predicted(world, believed).replans == 8 - 1
    surely = with_all_failures(believed, Fraction(0))
    found = predicted(world, surely)
    assert found.retries + found.replans == LEAST_FAILURES - 1
