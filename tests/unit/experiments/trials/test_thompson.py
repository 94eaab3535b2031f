"""Exact results of Thompson sampling agree with counts by hand and with sampled runs."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

from aeros.agent.memory.posterior import SuccessRecord
from aeros.experiments.trials.thompson import _ProbabilityAbove, oracle, with_memory, without_memory


def test_a_posterior_above_another_by_hand() -> None:
    above = _ProbabilityAbove()
    assert above(1, 1, 1, 1) == pytest.approx(1 / 2)
    # P(max of two uniform > third) and P(min of two > third)
    assert above(2, 1, 1, 1) == pytest.approx(2 / 3)
    assert above(1, 2, 1, 1) == pytest.approx(1 / 3)
    assert above(5, 3, 2, 6) + above(2, 6, 5, 3) == pytest.approx(1.0)


def test_a_posterior_above_another_as_the_agent_draws_it() -> None:
    random, one, other = Random(0), SuccessRecord(6, 2), SuccessRecord(3, 3)  # noqa: S311  no secret
    drawn = sum(one.sample(random) > other.sample(random) for _ in range(20_000)) / 20_000
    assert _ProbabilityAbove()(7, 3, 4, 4) == pytest.approx(drawn, abs=0.015)


def test_two_sessions_by_hand() -> None:
    first, second = with_memory([(1.0, 0.0), (1.0, 0.0)])
    assert first == pytest.approx((0.5, 0.5))
    # Whichever was tried: Beta(2, 1) against Beta(1, 1), or Beta(1, 1) against Beta(1, 2).
    assert second.success == pytest.approx(2 / 3)


def test_probabilities_stay_probabilities() -> None:
    sessions = with_memory([(0.9 - 0.04 * n, 0.6) for n in range(20)])
    assert all(0 < one.first < 1 and 0.1 < one.success < 0.9 for one in sessions)
    assert sessions[5].first > 0.5


def test_nobody_does_better_than_who_knows_or_worse_than_chance_where_nothing_changes() -> None:
    chances = [(0.8, 0.4)] * 12
    knowing, remembers, forgets = (
        [one.success for one in of(chances)] for of in (oracle, with_memory, without_memory)
    )
    assert knowing == [0.8] * 12
    assert forgets == pytest.approx([0.6] * 12)
    assert all(a < b for a, b in pairwise(remembers))
    assert forgets[0] == pytest.approx(remembers[0])
    assert remembers[-1] < 0.8
