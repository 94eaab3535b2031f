"""Providers are chosen by expected time until success, explored a bounded number of times, with a reason."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from hypothesis import given
from hypothesis import strategies as st

from aeros.agent.execution.provider_choice import (
    MAX_EXPLORATIONS,
    ProviderOption,
    choose_provider,
)
from aeros.agent.memory.posterior import RecentRecord, SuccessRecord

NONE = SuccessRecord(0, 0)


def option(name: str, successes: float, failures: float, seconds: float | None = None) -> ProviderOption:
    return ProviderOption(name, NONE, RecentRecord(successes, failures), seconds)


def shares(*options: ProviderOption, explorations: int = 0) -> list[int]:
    random = Random(0)  # noqa: S311  a test
    chosen = [choose_provider(options, random, explorations).chosen for _ in range(400)]
    return [chosen.count(place) for place in range(len(options))]


def test_of_two_that_succeed_alike_the_faster_one_is_preferred() -> None:
    slow, fast = shares(option("slow", 7.0, 1.0, 45.0), option("fast", 7.0, 1.0, 20.0))
    assert fast > 300
    assert slow > 0


def test_success_decides_where_the_times_are_unknown_or_short() -> None:
    good, bad = shares(option("good", 7.0, 1.0, 8.0), option("bad", 2.0, 6.0, 6.0))
    assert good > 350 > bad
    good, bad = shares(option("good", 7.0, 1.0), option("bad", 2.0, 6.0, 6.0))
    assert good > 350 > bad


def test_after_the_last_exploration_the_expected_values_decide() -> None:
    good, bad = option("good", 5.0, 1.0), option("bad", 1.0, 3.0)
    assert shares(good, bad)[1] > 0
    assert shares(good, bad, explorations=MAX_EXPLORATIONS) == [400, 0]
    random = Random(0)  # noqa: S311  a test
    choices = [choose_provider((good, bad), random, 1) for _ in range(200)]
    assert {one.reason for one in choices} == {
        "least expected time until success",
        "explores, 2 of at most 3 in this run",
    }
    assert all(one.is_exploration == (one.chosen == 1) for one in choices)


def test_without_records_none_is_preferred_and_no_choice_explores() -> None:
    new = [option(name, 0.0, 0.0) for name in "ab"]
    first, second = shares(*new, explorations=MAX_EXPLORATIONS)
    assert 150 < first < 250
    assert first + second == 400


def test_a_provider_that_cannot_start_is_not_chosen_and_the_only_one_is_no_exploration() -> None:
    away = ProviderOption("best", NONE, RecentRecord(8.0, 0.0), unavailable_reason="it was denied")
    bad = option("bad", 0.0, 8.0)
    choice = choose_provider((away, bad), Random(0), 0)  # noqa: S311  a test
    assert (choice.chosen, choice.reason, choice.is_exploration) == (1, "only this one can start now", False)
    assert choose_provider((away,), Random(0), 0).chosen is None  # noqa: S311  a test


@given(
    st.lists(
        st.tuples(st.floats(0, 8), st.floats(0, 8), st.none() | st.floats(0, 300)), min_size=1, max_size=4
    ),
    st.integers(0, 2**32),
    st.integers(0, MAX_EXPLORATIONS),
)
def test_the_choice_is_the_best_expectation_or_a_counted_exploration(
    drawn: list[tuple[float, float, float | None]], seed: int, explorations: int
) -> None:
    options = [option(str(n), *one) for n, one in enumerate(drawn)]
    choice = choose_provider(options, Random(seed), explorations)  # noqa: S311  a test
    assert choice.chosen is not None
    expected = [one.expected_s for one in choice.options]
    assert choice.is_exploration == (
        expected[choice.chosen] != min(one for one in expected if one is not None)
    )
    assert not (choice.is_exploration and explorations == MAX_EXPLORATIONS)


def test_wear_counts_as_time() -> None:
    quick = replace(option("quick", 50, 0, 5.0), wear_s=30.0)
    gentle = option("gentle", 50, 0, 20.0)
    names = [choose_provider([quick, gentle], Random(seed), 3).chosen for seed in range(20)]  # noqa: S311
    assert names == [1] * 20
    assert "wear 30 s" in str(quick)
    assert "wear" not in str(gentle)
