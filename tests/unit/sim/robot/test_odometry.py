"""Wheel odometry drifts as declared: with the way, by a scale error and by slip, seeded and without jumps."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from aeros.sim.randomness import RandomSource
from aeros.sim.robot.odometry import WheelOdometry


def drift_after(
    way: float, seed: int, scale: float, noise: float, step: float = 0.002
) -> tuple[float, float]:
    odometry = WheelOdometry(RandomSource(seed), scale, noise)
    for _ in range(round(way / step)):
        odometry.drive(step, 0.0)
    assert odometry.way == pytest.approx(way)
    return odometry.drift


def test_without_errors_it_never_drifts() -> None:
    assert drift_after(3.0, 1, 0.0, 0.0) == (0.0, 0.0)


def test_standing_is_no_drift() -> None:
    odometry = WheelOdometry(RandomSource(1), 0.01, 0.005)
    odometry.drive(0.0, 0.0)
    assert odometry.drift == (0.0, 0.0)


def test_a_scale_error_is_a_share_of_the_way_and_goes_back_with_it() -> None:
    odometry = WheelOdometry(RandomSource(3), 0.01, 0.0)
    odometry.drive(2.0, 0.0)
    out = odometry.drift
    assert 0.0 < abs(out[0]) < 0.08
    assert out[1] == 0.0
    odometry.drive(-2.0, 0.0)
    assert odometry.drift == pytest.approx((0.0, 0.0))


def test_slip_grows_with_the_root_of_the_way() -> None:
    drifts = np.array([drift_after(4.0, seed, 0.0, 0.005, step=0.02) for seed in range(300)])
    assert drifts.std(axis=0) == pytest.approx((0.010, 0.010), rel=0.2)
    assert np.abs(drifts.mean(axis=0)).max() < 0.003


def test_the_same_seed_repeats_and_another_does_not() -> None:
    assert drift_after(1.0, 5, 0.01, 0.005) == drift_after(1.0, 5, 0.01, 0.005)
    assert drift_after(1.0, 5, 0.01, 0.005) != drift_after(1.0, 6, 0.01, 0.005)


def test_the_drift_never_jumps() -> None:
    odometry = WheelOdometry(RandomSource(2), 0.0, 0.005)
    rates = []
    for _ in range(1000):
        before = odometry.drift
        odometry.drive(0.002, 0.0)
        rates.append(tuple((a - b) / 0.002 for a, b in zip(odometry.drift, before, strict=True)))
    changes = np.abs(np.diff(rates, axis=0))
    # From one tick to the next the share that slips changes by a fiftieth of what it may at most.
    assert changes.max() < 0.003 < np.abs(rates).max()
    assert hypot(*odometry.drift) > 0.0


@pytest.mark.parametrize("seed", range(5))
def test_the_scale_error_is_one_share_of_each_axis_however_the_way_is_cut(seed: int) -> None:
    def drift(*steps: tuple[float, float]) -> tuple[float, float]:
        odometry = WheelOdometry(RandomSource(seed), 0.01, 0.0)
        for step in steps:
            odometry.drive(*step)
        return odometry.drift

    (x, _), (_, y) = drift((1.0, 0.0)), drift((0.0, 1.0))
    assert drift((3.0, -0.5)) == pytest.approx((3.0 * x, -0.5 * y))
    assert drift(*[(0.03, -0.005)] * 100) == pytest.approx((3.0 * x, -0.5 * y))
    assert x != y
