"""Exact values at the share of attempts that did fail."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.experiments.condition import TrialCondition
from aeros.experiments.report.sampled_rate import exact_at_sampled_rate
from tests.unit.experiments.support.common import condition, premises


def found(*counts: tuple[int, int]) -> list[dict[str, Any]]:
    return [{"tries": tries, "failed_tries": failed} for tries, failed in counts]


def test_the_share_is_of_all_tries_and_decides_what_is_exact() -> None:
    at = exact_at_sampled_rate(condition(rate="9/10"), found((3, 1), (1, 0)), premises())
    assert at is not None
    assert at["share"] == 0.25
    # the flat pipeline has one try, so it succeeds in three of four
    assert at["exact"]["success"] == pytest.approx(0.75)
    assert at["exact"]["attempt"] == pytest.approx(0.25)


def test_where_nothing_failed_everything_succeeds() -> None:
    at = exact_at_sampled_rate(condition(rate="9/10"), found((5, 0)), premises())
    assert at is not None
    assert (at["share"], at["exact"]["success"]) == (0.0, 1.0)


def test_trials_without_the_skill_count_for_nothing() -> None:
    listed = [*found((2, 1)), {"reached": True, "failed_tries": 0}]
    at = exact_at_sampled_rate(condition(), listed, premises())
    assert at is not None
    assert at["share"] == 0.5


@pytest.mark.parametrize("listed", [[], found((0, 0)), [{"reached": True}]])
def test_without_a_try_there_is_no_share(listed: list[dict[str, Any]]) -> None:
    assert exact_at_sampled_rate(condition(), listed, premises()) is None


def test_a_condition_without_a_rate_or_with_bursts_has_none() -> None:
    tried = found((2, 1))
    without = TrialCondition.create("requests", "symbolic", {"policy": True, "requests": []})
    assert exact_at_sampled_rate(without, tried, premises()) is None
    assert exact_at_sampled_rate(condition(bursts=["1/10", 3]), tried, premises()) is None


def test_an_unpredictable_case_has_no_prediction() -> None:
    endless = condition(architecture="tests.unit.experiments.support.entered:Dicey")
    assert exact_at_sampled_rate(endless, found((2, 1)), premises()) is None
