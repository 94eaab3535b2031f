"""Values that a simulated robot gives its monitor at every control tick."""

from __future__ import annotations

from math import hypot
from typing import Any

from aeros.sim.robot.limits import SCANNER_RANGE
from aeros.sim.robot.robot import Robot, RobotState, braking_link_speed


def fast_values(robot: Robot, state: RobotState, torque_rates: tuple[float, ...]) -> dict[str, Any]:
    """Return the ground truth of a robot that nobody is near.

    Args:
        robot: the simulated robot.
        state: what its sensors measured at this tick.
        torque_rates: rates of the joint torques (7), N·m/s.

    Returns:
        The values by vocabulary name, SI, positions in W.
    """
    return {
        "joint_position": state.q,
        "joint_velocity": state.qd,
        "joint_torque": state.torque,
        "joint_torque_rate": torque_rates,
        "tool_position": state.tool_position,
        "tool_speed": state.tool_speed,
        "link_speed": braking_link_speed(state.q, state.qd, state.base_velocity),
        "tracking_error": robot.tracking_distance(state),
        "contact_force": robot.contact_force(),
        "finger_gap": state.finger_gap,
        "grip_force": min(robot.finger_forces()),
        "human_distance": SCANNER_RANGE,
        "estop_pressed": False,
        "base_position": state.base_position,
        "base_speed": hypot(*state.base_velocity),
    }
