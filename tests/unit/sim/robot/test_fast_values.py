"""The values of a tick are those of the robot and of its sensors."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from aeros.sim.robot.fast_values import fast_values
from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.sim.robot.robot import RobotState, braking_link_speed

STATE = RobotState(
    q=(0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.7),
    qd=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7),
    torque=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0),
    tool_position=(0.5, 0.1, 0.3),
    tool_speed=0.2,
    finger_gap=0.04,
    finger_speed=0.01,
    base_position=(1.0, 2.0, 0.0),
    base_velocity=(0.3, 0.4, 0.0),
)
RATES = (0.5,) * 7
ROBOT: Any = SimpleNamespace(
    tracking_distance=lambda state: state.finger_speed,
    contact_force=lambda: 12.0,
    finger_forces=lambda: (9.0, 8.0),
)


def test_each_value_is_of_its_sensor() -> None:
    values = fast_values(ROBOT, STATE, RATES)
    assert values.pop("base_speed") == pytest.approx(0.5)
    assert values.pop("link_speed") == braking_link_speed(STATE.q, STATE.qd, STATE.base_velocity)
    assert values == {
        "joint_position": STATE.q,
        "joint_velocity": STATE.qd,
        "joint_torque": STATE.torque,
        "joint_torque_rate": RATES,
        "tool_position": STATE.tool_position,
        "tool_speed": 0.2,
        "tracking_error": 0.01,
        "contact_force": 12.0,
        "finger_gap": 0.04,
        "grip_force": 8.0,
        "human_distance": SCANNER_RANGE,
        "estop_pressed": False,
        "base_position": STATE.base_position,
    }
