"""Simulated choices agree with counts by hand and with the dispatcher's own choice."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

from aeros.agent.execution.provider_choice import ProviderOption, choose_provider
from aeros.agent.memory.posterior import RecentRecord, SuccessRecord
from aeros.experiments.trials.thompson import _choose, oracle, with_memory, without_memory


def test_two_sessions_by_hand() -> None:
    first, second = with_memory([(1.0, 0.0), (1.0, 0.0)])
    assert first == pytest.approx((0.5, 0.5), abs=0.02)
    # Whichever was tried: Beta(2, 1) against Beta(1, 1), or Beta(1, 1) against Beta(1, 2).
    assert second.success == pytest.approx(2 / 3, abs=0.02)


@pytest.mark.parametrize("seconds", [None, (6.0, 60.0)])
def test_the_agent_chooses_as_often(seconds: tuple[float, float] | None) -> None:
    weights = [[3.0, 2.5], [2.0, 0.5]]
    options = [
        ProviderOption(
            name, SuccessRecord(0, 0), RecentRecord(*both), None if seconds is None else seconds[n]
        )
        for n, (name, both) in enumerate(zip("ab", weights, strict=True))
    ]
    one, other = Random(1), Random(2)  # noqa: S311  no secrets
    chosen = [choose_provider(options, one, 0).chosen for _ in range(5000)]
    simulated = [_choose(other, weights, seconds) for _ in range(5000)]
    assert sum(place == 0 for place in chosen) == pytest.approx(simulated.count(0), abs=150)
    assert 500 < simulated.count(0) < 4500


def test_probabilities_stay_probabilities() -> None:
    sessions = with_memory([(0.9 - 0.04 * n, 0.6) for n in range(20)], runs=500)
    assert all(0 < one.first < 1 and 0.1 < one.success < 0.9 for one in sessions)
    assert sessions[5].first > 0.5


def test_nobody_does_better_than_who_knows_or_worse_than_chance_where_nothing_changes() -> None:
    chances = [(0.8, 0.4)] * 12
    knowing, remembers, forgets = (
        [one.success for one in of(chances)] for of in (oracle, with_memory, without_memory)
    )
    assert knowing == [0.8] * 12
    assert forgets == pytest.approx([0.6] * 12)
    assert all(a < b + 0.01 for a, b in pairwise(remembers))
    assert forgets[0] == pytest.approx(remembers[0], abs=0.02)
    assert 0.65 < remembers[-1] < 0.8


def test_a_change_is_noticed_sooner_with_forgetting() -> None:
    chances = [(0.95, 0.7)] * 20 + [(0.1, 0.7)] * 15
    forgetting, remembering = (with_memory(chances, forgetting=factor, runs=2000) for factor in (0.875, 1.0))
    assert forgetting[-1].success > remembering[-1].success + 0.05
