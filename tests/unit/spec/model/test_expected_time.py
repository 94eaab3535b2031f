"""The expected time until success is that of tries drawn at random."""

from __future__ import annotations

from random import Random
from statistics import fmean

import pytest

from aeros.spec.model.expected_time import FAILURE_COST_S, expected_time


def test_a_step_that_never_fails_takes_its_time_and_one_that_always_fails_a_finite_one() -> None:
    assert expected_time(8.0, 1.0) == 8.0
    assert 1e9 < expected_time(8.0, 0.0) < 1e12


@pytest.mark.parametrize(("seconds", "success"), [(8.0, 0.9), (30.0, 0.5), (1.0, 0.25)])
def test_it_is_the_mean_over_drawn_tries(seconds: float, success: float) -> None:
    random = Random(0)  # noqa: S311  a test

    def drawn() -> float:
        took = seconds
        while random.random() >= success:
            took += FAILURE_COST_S + seconds
        return took

    assert expected_time(seconds, success) == pytest.approx(fmean(drawn() for _ in range(20_000)), rel=0.05)
