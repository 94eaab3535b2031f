"""The limits are those of the data sheet, and nobody can change them."""

from __future__ import annotations

import pytest

from tests.unit.sim.robot.panda import PANDA, READY_POSTURE

LIMITS = PANDA.limits


def test_joint_limits_are_frankas() -> None:
    # frankaemika/docs at 1da6bd3, control_parameters.
    assert LIMITS.highest.tolist() == [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973]
    assert LIMITS.lowest.tolist() == [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973]
    assert LIMITS.speed.tolist() == [2.175] * 4 + [2.61] * 3
    assert LIMITS.acceleration.tolist() == [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]
    assert LIMITS.torque.tolist() == [87.0] * 4 + [12.0] * 3
    assert LIMITS.torque_rate.tolist() == [1000.0] * 7
    assert (LIMITS.jerk == 500.0 * LIMITS.acceleration).all()


@pytest.mark.parametrize(
    "name", ["lowest", "highest", "speed", "acceleration", "jerk", "torque", "torque_rate"]
)
def test_limits_of_joints_cannot_be_written(name: str) -> None:
    array = getattr(LIMITS, name)
    assert array.shape == (7,)
    assert array.dtype == float
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 0.0


def test_the_ready_posture_is_within_the_limits() -> None:
    assert (LIMITS.lowest < READY_POSTURE).all()
    assert (LIMITS.highest > READY_POSTURE).all()
