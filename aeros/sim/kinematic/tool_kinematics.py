"""The Panda's tool for one posture, in plain numbers: what `sim.kinematics.forward` computes for many.

For a single posture NumPy's calls cost ten times what they compute.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, pi, sin
from typing import Final, NamedTuple

from aeros.kinematic_chain import Triple, frames_of, mounting_of
from aeros.sim.geometry import cross, subtract
from aeros.sim.robot.body import PANDA_BODY

_MOUNTINGS: Final = tuple(mounting_of(row) for row in PANDA_BODY.dh_rows)


class ToolKinematics(NamedTuple):
    """The tool's place p_BT, m, its yaw, rad, and how it moves with each joint: ∂p_BT/∂q, m."""

    position: Triple
    yaw: float
    jacobian: tuple[Triple, ...]


def tool_kinematics(q: Sequence[float]) -> ToolKinematics:
    """Compute the tool's place, its yaw, and its derivatives by the joints, at joint positions `q`, rad."""
    frames = frames_of(_MOUNTINGS, q)
    _, x, y, _ = frames[-1]
    tool = frames[-1].to_base(PANDA_BODY.tool_offset)
    # The hand is mounted turned by -45° about the flange's axis.
    c, s = cos(-pi / 4), sin(-pi / 4)
    yaw = atan2(c * x[1] + s * y[1], c * x[0] + s * y[0])
    return ToolKinematics(
        tool, yaw, tuple(cross(z, subtract(tool, origin)) for origin, _, _, z in frames[1:])
    )
