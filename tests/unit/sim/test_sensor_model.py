"""Errors of a quantity: which are possible, and which need values of earlier ticks."""

from __future__ import annotations

from math import inf, nan

import pytest

from aeros.sim.clock import TICK
from aeros.sim.sensor_model import SensorModel
from aeros.spec.diagnostics.errors import MisuseError


@pytest.mark.parametrize(
    "errors", [{"noise": -1.0}, {"bias": inf}, {"latency": nan}, {"dropout": 1.1}, {"colour_noise": -0.1}]
)
def test_impossible_errors_are_refused(errors: dict[str, float]) -> None:
    with pytest.raises(MisuseError, match="invalid sensor model"):
        SensorModel(**errors)


def test_only_latency_and_dropout_need_earlier_values() -> None:
    assert not SensorModel(noise=1.0, bias=1.0, resolution=1.0).needs_history
    assert SensorModel(latency=TICK).needs_history
    assert SensorModel(dropout=0.1).needs_history


@pytest.mark.parametrize(("latency", "ticks"), [(0.0, 0), (TICK, 1), (1.5 * TICK, 2), (2.0 * TICK, 2)])
def test_a_latency_is_rounded_up_to_ticks(latency: float, ticks: int) -> None:
    assert SensorModel(latency=latency).latency_ticks == ticks
