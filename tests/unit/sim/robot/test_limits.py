"""The limits are those of the data sheet, and nobody can change them."""

from __future__ import annotations

import pytest

from aeros.sim.robot import limits
from aeros.sim.robot.kinematics import READY_POSTURE


def test_joint_limits_are_frankas() -> None:
    # frankaemika/docs at 1da6bd3, control_parameters.
    assert limits.Q_MAX.tolist() == [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973]
    assert limits.Q_MIN.tolist() == [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973]
    assert limits.QD_MAX.tolist() == [2.175] * 4 + [2.61] * 3
    assert limits.QDD_MAX.tolist() == [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]
    assert limits.TAU_MAX.tolist() == [87.0] * 4 + [12.0] * 3
    assert (limits.QDDD_MAX == 500.0 * limits.QDD_MAX).all()


@pytest.mark.parametrize("name", ["Q_MIN", "Q_MAX", "QD_MAX", "QDD_MAX", "QDDD_MAX", "TAU_MAX"])
def test_limits_of_joints_cannot_be_written(name: str) -> None:
    array = getattr(limits, name)
    assert array.shape == (7,)
    assert array.dtype == float
    with pytest.raises(ValueError, match="read-only"):
        array[0] = 0.0


def test_the_ready_posture_is_within_the_limits() -> None:
    assert (limits.Q_MIN < READY_POSTURE).all()
    assert (READY_POSTURE < limits.Q_MAX).all()
