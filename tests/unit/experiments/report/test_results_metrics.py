"""Metrics of trials: shares, means, medians and maxima, each with its interval."""

from __future__ import annotations

from math import sqrt
from typing import Any

import pytest

from aeros.experiments.catalogue import Metric
from aeros.experiments.report.results import (
    _cell,
    _explanation,
    _is_measured,
    _is_outside,
    _is_within_margin,
    _mean_share,
    _timings,
    measure_metric,
)


def metric(**of: str) -> Metric:
    return Metric("m", "m", **of)


def found(*values: Any, name: str = "x") -> list[dict[str, Any]]:
    return [{name: value} for value in values]


def test_a_share_is_of_the_trials_with_wilsons_interval() -> None:
    one = measure_metric(metric(denominator="x"), found(True, True, True, False))
    assert (one["hits"], one["of"], one["measured"]) == (3, 4, 75.0)
    # (p + z²/2n ± z √(p(1 − p)/n + z²/4n²)) / (1 + z²/n), with z = 1.96
    z2 = 1.959964**2
    middle, half = 0.75 + z2 / 8, 1.959964 * sqrt(0.75 * 0.25 / 4 + z2 / 64)
    assert one["low"] == pytest.approx(100 * (middle - half) / (1 + z2 / 4), rel=1e-5)
    assert one["high"] == pytest.approx(100 * (middle + half) / (1 + z2 / 4), rel=1e-5)


def test_a_share_of_counts_is_of_their_sums() -> None:
    trials = [{"failed": 1, "tries": 4}, {"failed": 1, "tries": 1}, {"failed": 0, "tries": 3}]
    one = measure_metric(metric(numerator="failed", denominator="tries"), trials)
    assert (one["hits"], one["of"], one["measured"]) == (2, 8, 25.0)


def test_a_mean_has_the_interval_of_the_normal_distribution() -> None:
    one = measure_metric(metric(mean="x"), found(2.0, 4.0, 6.0, 8.0))
    half = 1.959964 * sqrt(20 / 3) / 2
    assert one == {
        "measured": 5.0,
        "low": pytest.approx(5.0 - half),
        "high": pytest.approx(5.0 + half),
    }
    assert measure_metric(metric(mean="x"), found(0.0, 0.1, 5.0))["low"] == 0.0  # no count is below none


def test_equal_values_have_an_interval_by_the_rule_of_three_and_one_value_has_none() -> None:
    same = measure_metric(metric(mean="x"), found(*[4.0] * 6))
    assert same == {"measured": 4.0, "low": 3.5, "high": 4.5}
    assert measure_metric(metric(mean="x"), found(4.0)) == {"measured": 4.0, "low": None, "high": None}


def test_a_mean_is_of_the_trials_that_have_it() -> None:
    one = measure_metric(metric(mean="x"), [*found(1.0, 3.0), {"y": 9.0}])
    assert one["measured"] == 2.0


def test_a_median_has_an_interval_where_there_are_enough_values() -> None:
    assert measure_metric(metric(median="x"), found(3.0, 1.0, 2.0)) == {
        "measured": 2.0,
        "low": None,
        "high": None,
    }
    one = measure_metric(metric(median="x"), found(*map(float, range(7))))
    assert one == {"measured": 3.0, "low": 0.0, "high": 6.0}


def test_a_maximum_has_no_interval() -> None:
    assert measure_metric(metric(maximum="x"), found(1.0, 3.0, 2.0)) == {
        "measured": 3.0,
        "low": None,
        "high": None,
    }


@pytest.mark.parametrize(
    ("of", "trials", "measured"),
    [
        ({"mean": "x"}, [{}, {"x": 1}], True),
        ({"mean": "x"}, [{}], False),
        ({"median": "x"}, [{}, {"x": 1}], False),
        ({"maximum": "x"}, [{"x": 1}], True),
        ({"denominator": "x"}, [{"x": 0}], True),
        ({"numerator": "n", "denominator": "x"}, [{"x": 0, "n": 0}], False),
        ({"numerator": "n", "denominator": "x"}, [{"x": 0, "n": 0}, {"x": 1, "n": 0}], True),
        ({"numerator": "n", "denominator": "x"}, [{"x": 1}], False),
    ],
)
def test_objects_not_found_are_not_measured(
    of: dict[str, str], trials: list[dict[str, Any]], *, measured: bool
) -> None:
    assert _is_measured(metric(**of), trials) is measured


@pytest.mark.parametrize(
    ("value", "outside"), [(None, False), (50.0, False), (40.0 - 1e-10, False), (39.9, True), (60.1, True)]
)
def test_a_value_is_outside_beyond_rounding(value: float | None, *, outside: bool) -> None:
    assert _is_outside({"low": 40.0, "high": 60.0}, value) is outside
    assert _is_outside({"low": None, "high": None}, value) is False


def test_a_cell_has_its_references_in_the_unit_of_what_was_measured() -> None:
    share = {"hits": 5, "of": 10, "measured": 50.0, "low": 40.0, "high": 60.0}
    assert _cell(share, {"exact": 0.7, "independent": None}, 55.0) == {
        **share,
        "exact": 70.0,
        "independent": None,
        "paper": 55.0,
        "misses": ["exact"],
    }
    mean = {"measured": 5.0, "low": 4.0, "high": 6.0}
    assert _cell(mean, {"exact": 5.5}, 9.0) == {**mean, "exact": 5.5, "paper": 9.0, "misses": ["paper"]}


def test_a_mean_over_tasks_needs_every_share() -> None:
    assert _mean_share([50.0, 70.0]) == pytest.approx(0.6)
    assert _mean_share([50.0, None]) is None


def test_a_trial_that_shares_has_the_time_that_it_would_take_alone() -> None:
    alone = [{"processor_s": 1.0, "alone_s": 2.0}, {"processor_s": 3.0, "alone_s": 4.0}]
    assert _timings(alone) == {"alone_s": 3.0}
    assert _timings([{"processor_s": 1.0, "swap_s": 0.5}, {"processor_s": 3.0}]) == {"processor_s": 2.0}


MISSED = {"success": {"exact": 30.0, "low": 40.0, "high": 60.0, "misses": ["paper"]}}


def test_a_known_reason_explains_the_rows_and_marks_that_it_is_of() -> None:
    texts, left = _explanation("4/flat/clean_table", "symbolic", MISSED, None)
    assert (len(texts), left) == (1, [])
    assert texts[0].startswith("One attempt succeeds with 1 − p")
    assert _explanation("4/flat_/clean_table", "symbolic", MISSED, None) == ([], ["success: paper"])
    both = {"success": {**MISSED["success"], "misses": ["paper", "exact"]}}
    assert _explanation("4/flat/clean_table", "symbolic", both, None)[1] == ["success: exact"]


def test_chance_in_the_draws_explains_what_it_recomputes() -> None:
    cells = {
        name: {"exact": 1.0, "low": 4.0, "high": 6.0, "misses": ["exact"]} for name in ("success", "steps")
    }
    drawn = {"exact": {"success": 5.0, "steps": 9.0}, "misses": ["steps"]}
    assert _explanation("none/such", "symbolic", cells, drawn) == ([], ["steps: exact"])
    assert _explanation("none/such", "symbolic", cells, None) == ([], ["steps: exact", "success: exact"])


@pytest.mark.parametrize(
    ("exact", "drawn", "within"),
    [(38.0, None, True), (37.9, None, False), (0.0, 62.0, True), (50.0, 62.1, False)],
)
def test_a_margin_is_beyond_the_interval(exact: float, drawn: float | None, *, within: bool) -> None:
    assert _is_within_margin({"exact": exact, "low": 40.0, "high": 60.0}, drawn, 2.0) is within
