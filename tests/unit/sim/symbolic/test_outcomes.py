"""Outcomes are drawn by seed, skill and run alone, and as often as declared."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.sim.gilbert_elliott import GilbertElliottProcess
from aeros.sim.symbolic.outcomes import (
    BurstOutcomes,
    OutcomeProbabilities,
    OutcomeSampler,
    draw_outcome,
    outcome_probabilities_by_skill,
    uniform_burst_draw,
    uniform_draw,
)
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.sim.symbolic.test_plant import module, outcome

SKILL = "handling.lift"
DONE, SLIPPED, LOST = outcome("done"), outcome("slipped"), outcome("lost")


def shares(**given: str) -> OutcomeProbabilities:
    known = {"done": DONE, "slipped": SLIPPED, "lost": LOST}
    return [(known[name], Fraction(share)) for name, share in given.items()]


def sampler(
    *, seed: int = 0, bursts: Mapping[str, BurstOutcomes] | None = None, **given: str
) -> OutcomeSampler:
    return OutcomeSampler({SKILL: shares(**given)}, bursts or {}, seed)


def ids(one: OutcomeSampler, count: int) -> list[str]:
    return [one.outcome(SKILL, run).id for run in range(count)]


def test_a_draw_is_the_hash_of_its_key() -> None:
    key = b"aeros/outcome/1\n7\nhandling.lift\n3"
    expected = Fraction(int(hashlib.sha256(key).hexdigest()[:16], 16), 2**64)
    assert uniform_draw(7, SKILL, 3) == expected
    burst = b"aeros/outcome/1\n7\nhandling.lift/burst\n3"
    assert uniform_burst_draw(7, SKILL, 3) == int(hashlib.sha256(burst).hexdigest()[:16], 16) / 2**64


@given(st.integers(), st.text("ab./", max_size=5), st.integers(0, 99))
def test_a_draw_is_from_0_to_1(seed: int, skill: str, run: int) -> None:
    assert 0 <= uniform_draw(seed, skill, run) < 1


def test_outcomes_share_the_interval_in_their_order() -> None:
    point = uniform_draw(7, SKILL, 3)
    tiny = Fraction(1, 2**64)
    assert draw_outcome([(DONE, point), (SLIPPED, 1 - point)], 7, SKILL, 3) is SLIPPED
    assert draw_outcome([(DONE, point + tiny), (SLIPPED, 1 - point - tiny)], 7, SKILL, 3) is DONE
    assert draw_outcome([(LOST, Fraction(0)), (DONE, Fraction(1))], 7, SKILL, 3) is DONE
    halves = [(LOST, point / 2), (DONE, point / 2), (SLIPPED, 1 - point)]
    assert draw_outcome(halves, 7, SKILL, 3) is SLIPPED


def test_probabilities_that_leave_a_gap_are_misuse() -> None:
    point = uniform_draw(7, SKILL, 3)
    for gap in ([], [(DONE, point)]):
        with pytest.raises(MisuseError, match=r"the outcomes of `handling.lift` are not a distribution"):
            draw_outcome(gap, 7, SKILL, 3)


def test_outcomes_come_as_often_as_declared() -> None:
    counts = Counter(ids(sampler(done="3/5", slipped="3/10", lost="1/10"), 2000))
    # Within some three standard deviations.
    assert counts["done"] == pytest.approx(1200, abs=66)
    assert counts["slipped"] == pytest.approx(600, abs=62)
    assert sum(counts.values()) == 2000


def test_outcomes_depend_on_seed_and_run_and_not_on_the_order_of_calls() -> None:
    one, other = sampler(done="1/2", slipped="1/2"), sampler(done="1/2", slipped="1/2")
    backwards = [other.outcome(SKILL, run).id for run in range(49, -1, -1)]
    assert ids(one, 50) == backwards[::-1]
    assert ids(one, 50) == ids(one, 50)
    assert ids(one, 50) != ids(sampler(seed=1, done="1/2", slipped="1/2"), 50)


def test_skills_are_drawn_each_by_itself() -> None:
    both = OutcomeSampler(
        {name: shares(done="1/2", slipped="1/2") for name in (SKILL, "handling.drop")}, {}, 0
    )
    lift, drop = ([both.outcome(name, run).id for run in range(50)] for name in (SKILL, "handling.drop"))
    assert lift == ids(sampler(done="1/2", slipped="1/2"), 50)
    assert lift != drop


def test_an_unknown_skill_has_no_outcomes() -> None:
    with pytest.raises(KeyError):
        sampler(done="1").outcome("handling.drop", 0)


def burst(leave_good: float, leave_bad: float, start_bad: float) -> Mapping[str, BurstOutcomes]:
    process = GilbertElliottProcess(start_bad, leave_good, leave_bad, 1.0, 0.0)
    return {SKILL: BurstOutcomes(process, shares(done="1"), shares(slipped="1"))}


def test_outcomes_in_bursts_follow_the_chains_state() -> None:
    assert set(ids(sampler(bursts=burst(0.0, 1.0, 0.0), lost="1"), 20)) == {"done"}
    assert set(ids(sampler(bursts=burst(1.0, 1e-12, 1.0), lost="1"), 20)) == {"slipped"}
    assert ids(sampler(bursts=burst(1.0, 1.0, 1.0), lost="1"), 5) == [
        "slipped", "done", "slipped", "done", "slipped",
    ]  # fmt: skip


def test_the_state_of_a_run_is_decided_by_its_own_draw() -> None:
    found = ids(sampler(seed=3, bursts=burst(0.3, 0.5, 0.4), lost="1"), 30)
    is_bad, expected = uniform_burst_draw(3, SKILL, 0) < 0.4, []
    for run in range(30):
        if run:
            is_bad = is_bad != (uniform_burst_draw(3, SKILL, run) < (0.5 if is_bad else 0.3))
        expected.append("slipped" if is_bad else "done")
    assert found == expected
    assert len(set(found)) == 2


def test_bursts_do_not_depend_on_the_order_of_calls() -> None:
    one = sampler(bursts=burst(0.3, 0.5, 0.4), lost="1")
    last = one.outcome(SKILL, 29).id
    assert ids(one, 30) == ids(sampler(bursts=burst(0.3, 0.5, 0.4), lost="1"), 30)
    assert ids(one, 30)[-1] == last


def test_probabilities_are_collected_by_module_and_skill() -> None:
    lifted, lost = outcome("lifted", "0.75"), outcome("lost")
    found = outcome_probabilities_by_skill(module(lifted, lost).values())
    assert found == {SKILL: [(lifted, Fraction(3, 4)), (lost, Fraction(1, 4))]}
    with pytest.raises(MisuseError):
        outcome_probabilities_by_skill(module(outcome("lifted", "0.5")).values())
    assert outcome_probabilities_by_skill([]) == {}
