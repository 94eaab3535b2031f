from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import inf, nan
from random import Random

import pytest

from aeros.runtime.gate.decision import Decision, DecisionKind, Reason
from aeros.runtime.gate.quotas import ClockError, QuotaUsageCounter, clock_denial
from aeros.spec.diagnostics.source import Source
from aeros.spec.model.policy import Quota

HERE = Source("site.yaml", "").span(0, 0)
RATE = Quota("grip-rate", frozenset({"grip"}), 3, Fraction(10), HERE)
TOTAL = Quota("all", frozenset({"grip", "move"}), 100, Fraction(1, 10), HERE)


def test_each_quota_counts_its_own_kinds() -> None:
    usage = QuotaUsageCounter([RATE, TOTAL])
    usage.count_execution("grip", 1.0)
    usage.count_execution("move", 1.0)
    usage.count_execution("look", 1.0)
    assert usage.usage_at(1.0) == {"grip-rate": 1, "all": 2}


def test_the_window_is_closed_and_exact() -> None:
    usage = QuotaUsageCounter([RATE])
    usage.count_execution("grip", 0.5)
    assert usage.usage_at(10.5) == {"grip-rate": 1}
    assert usage.usage_at(10.500000000000002) == {"grip-rate": 0}


def test_memory_is_bounded_by_the_quota() -> None:
    usage = QuotaUsageCounter([RATE])
    for tick in range(1000):
        usage.count_execution("grip", tick / 1000)
    assert usage.usage_at(1.0) == {"grip-rate": 3}


def test_counts_agree_with_counting_everything() -> None:
    chance = Random(3)  # noqa: S311 - a test, the same every time
    usage, times, now = QuotaUsageCounter([RATE]), list[float](), 0.0
    for _ in range(2000):
        now += chance.choice([0.0, 0.5, 3.0, 10.0])
        expected = sum(1 for time in times if now - time <= 10)
        assert usage.usage_at(now)["grip-rate"] == expected
        if expected < RATE.max_count:
            usage.count_execution("grip", now)
            times.append(now)


@pytest.mark.parametrize("time", [4.9, nan, inf, -inf])
def test_a_time_that_goes_back_or_is_not_finite_is_an_error(time: float) -> None:
    usage = QuotaUsageCounter([RATE])
    usage.count_execution("grip", 5.0)
    with pytest.raises(ClockError):
        usage.usage_at(time)
    with pytest.raises(ClockError):
        usage.count_execution("grip", time)
    assert usage.usage_at(5.0) == {"grip-rate": 1}


@pytest.mark.parametrize("time", [5, 5.0])
def test_a_whole_number_is_a_time_like_the_double_that_equals_it(time: float) -> None:
    usage = QuotaUsageCounter([RATE])
    usage.count_execution("grip", time)
    assert usage.usage_at(15) == {"grip-rate": 1}
    assert usage.usage_at(15.000000000000002) == {"grip-rate": 0}


@pytest.mark.parametrize("time", ["5.0", None, 2**53 + 1, 10**400, b""])
def test_a_time_that_is_no_double_is_an_error_that_shows_it(time: object) -> None:
    usage = QuotaUsageCounter([RATE])
    with pytest.raises(ClockError) as found:
        usage.usage_at(time)  # type: ignore[arg-type]
    assert str(found.value) == f"the time {time} is not a valid time"


def test_a_clock_that_goes_back_is_denied_with_both_times() -> None:
    usage = QuotaUsageCounter([RATE])
    usage.count_execution("grip", 5.0)
    with pytest.raises(ClockError) as found:
        usage.count_execution("grip", 4.5)
    reason = Reason("AE707", "clock", "the clock went back from 5 s to 4.5 s")
    assert clock_denial(found.value) == Decision(DecisionKind.DENY, None, (reason,))


def test_quotas_that_stay_keep_their_counts_when_the_site_changes() -> None:
    usage = QuotaUsageCounter([RATE])
    usage.count_execution("grip", 5.0)
    changed = usage.set_quotas([RATE, TOTAL])
    assert changed.usage_at(5.0) == {"grip-rate": 1, "all": 0}
    changed.count_execution("grip", 5.0)
    assert usage.usage_at(5.0) == {"grip-rate": 1}
    assert usage.set_quotas([TOTAL]).usage_at(5.0) == {"all": 0}


@pytest.mark.parametrize(
    "changed",
    [
        replace(RATE, kinds=frozenset({"grip", "move"})),
        replace(RATE, max_count=RATE.max_count + 1),
        replace(RATE, window_s=2 * RATE.window_s),
    ],
)
def test_a_quota_that_differs_in_anything_but_its_name_begins_with_nothing(changed: Quota) -> None:
    usage = QuotaUsageCounter([RATE])
    usage.count_execution("grip", 5.0)
    assert usage.set_quotas([changed]).usage_at(5.0) == {RATE.id: 0}


def test_the_clock_goes_on_when_the_site_changes() -> None:
    usage = QuotaUsageCounter([RATE])
    usage.count_execution("grip", 5.0)
    with pytest.raises(ClockError):
        usage.set_quotas([TOTAL]).usage_at(4.5)
