from __future__ import annotations

from fractions import Fraction
from math import inf, nan
from random import Random

import pytest

from aeros.runtime.gate.quotas import ClockError, Usage
from aeros.spec.diagnostics.source import Source
from aeros.spec.model.model import Quota

HERE = Source("site.yaml", "").span(0, 0)
RATE = Quota("grip-rate", frozenset({"grip"}), 3, Fraction(10), HERE)
TOTAL = Quota("all", frozenset({"grip", "move"}), 100, Fraction(1, 10), HERE)


def test_each_quota_counts_its_own_kinds() -> None:
    usage = Usage([RATE, TOTAL])
    usage.executed("grip", 1.0)
    usage.executed("move", 1.0)
    usage.executed("look", 1.0)
    assert usage.count(1.0) == {"grip-rate": 1, "all": 2}


def test_the_window_is_closed_and_exact() -> None:
    usage = Usage([RATE])
    usage.executed("grip", 0.5)
    assert usage.count(10.5) == {"grip-rate": 1}
    assert usage.count(10.500000000000002) == {"grip-rate": 0}


def test_memory_is_bounded_by_the_quota() -> None:
    usage = Usage([RATE])
    for tick in range(1000):
        usage.executed("grip", tick / 1000)
    assert usage.count(1.0) == {"grip-rate": 3}


def test_counts_agree_with_counting_everything() -> None:
    chance = Random(3)  # noqa: S311 - a test, the same every time
    usage, times, now = Usage([RATE]), list[float](), 0.0
    for _ in range(2000):
        now += chance.choice([0.0, 0.5, 3.0, 10.0])
        expected = sum(1 for time in times if now - time <= 10)
        assert usage.count(now)["grip-rate"] == expected
        if expected < RATE.at_most:
            usage.executed("grip", now)
            times.append(now)


@pytest.mark.parametrize("time", [4.9, nan, inf, -inf])
def test_a_time_that_goes_back_or_is_none_is_an_error(time: float) -> None:
    usage = Usage([RATE])
    usage.executed("grip", 5.0)
    with pytest.raises(ClockError):
        usage.count(time)
    with pytest.raises(ClockError):
        usage.executed("grip", time)
    assert usage.count(5.0) == {"grip-rate": 1}
