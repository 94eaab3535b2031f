"""Tool kinematics of an arm for one posture in plain numbers; `robot.kinematics` does it for many.

For a single posture, NumPy's call overhead is ten times the computation.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, sin
from typing import NamedTuple

from aeros.kinematic_chain import Triple, frames_of, point_derivative
from aeros.sim.robot.model import RobotModel


class ToolKinematics(NamedTuple):
    """Pose and Jacobian of the tool.

    Attributes:
        position: p_BT, m.
        yaw: in B, rad.
        jacobian: ∂p_BT/∂q, for each joint a vector in B, m/rad; of a prismatic joint m/m.
    """

    position: Triple
    yaw: float
    jacobian: tuple[Triple, ...]


def tool_kinematics(arm: RobotModel, q: Sequence[float]) -> ToolKinematics:
    """Compute the tool's position, its yaw, and the derivatives of the position by the joints.

    Args:
        arm: the robot.
        q: joint positions, rad or m.

    Returns:
        Pose and Jacobian in B.
    """
    frames = frames_of(arm.mountings, q)
    _, x, y, _ = frames[-1]
    tool = frames[-1].to_base(arm.body.tool_offset)
    c, s = cos(arm.hand.turn), sin(arm.hand.turn)
    yaw = atan2(c * x[1] + s * y[1], c * x[0] + s * y[0])
    joints = zip(frames[1:], arm.mountings, strict=True)
    return ToolKinematics(
        tool, yaw, tuple([point_derivative(frame, mounting, tool) for frame, mounting in joints])
    )
