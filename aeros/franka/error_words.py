"""Errors of the robot in words: its own names, and what each means for a person who stands before it."""

from __future__ import annotations

import re
from typing import Final

_MEANINGS: Final = {
    "joint_position_limits_violation": "a joint was beyond its range",
    "cartesian_position_limits_violation": "the hand was outside the robot's own workspace",
    "self_collision_avoidance_violation": "links came too near to each other",
    "joint_velocity_violation": "a joint was faster than it may be at its position",
    "cartesian_velocity_violation": "the hand was too fast",
    "force_control_safety_violation": "the force controller left its bounds",
    "joint_reflex": "the torque of a joint was not as expected: the arm touched something",
    "cartesian_reflex": "the force at the hand was not as expected: the arm touched something",
    "max_goal_pose_deviation_violation": "the robot was too far from its goal",
    "max_path_pose_deviation_violation": "the robot was too far from its path",
    "cartesian_velocity_profile_safety_violation": "the speed of the hand left its safe profile",
    "joint_position_motion_generator_start_pose_invalid": "a motion did not begin where the arm stood",
    "joint_motion_generator_position_limits_violation": "a commanded position is beyond a joint's range",
    "joint_motion_generator_velocity_limits_violation": "a commanded joint speed is too high",
    "joint_motion_generator_velocity_discontinuity": "a commanded joint speed jumped",
    "joint_motion_generator_acceleration_discontinuity": "a commanded joint acceleration jumped",
    "controller_torque_discontinuity": "a commanded torque jumped",
    "communication_constraints_violation": "20 commands in a row did not reach the robot in time",
    "power_limit_violation": "the motors took more power than they may",
    "joint_p2p_insufficient_torque_for_planning": "the load is too heavy for a motion",
    "tau_j_range_violation": "a torque sensor was beyond its range",
    "instability_detected": "the controller began to swing",
    "joint_move_in_wrong_direction": "a joint beyond its range moved farther outwards",
    "base_acceleration_initialization_timeout": "the sensor of the robot's base did not start",
    "base_acceleration_invalid_reading": "the sensor of the robot's base failed",
}
"""Meaning of the errors of `franka::Errors` that a stream of joint positions can meet."""


def explain_errors(text: str) -> str:
    """Add the meaning of each error that a message of libfranka names.

    Args:
        text: the message.

    Returns:
        The message, and after it each known error with its meaning.
    """
    names = [name for name in re.findall(r"[a-z0-9]+(?:_[a-z0-9]+)+", text) if name in _MEANINGS]
    meanings = [f"`{name}`, {_MEANINGS[name]}" for name in dict.fromkeys(names)]
    words = " ".join(text.split())
    return f"{words} ({'; '.join(meanings)})" if meanings else words
