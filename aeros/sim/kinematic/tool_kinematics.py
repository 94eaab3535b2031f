"""The Panda's tool for one posture, in plain numbers: what `sim.kinematics.forward` computes for many.

For a single posture NumPy's calls cost ten times what they compute.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, pi, sin
from typing import Final, NamedTuple

from aeros.kinematic_chain import Triple, frames_of, mounting_of
from aeros.sim.geometry import cross, minus
from aeros.sim.robot.body import PANDA

_MOUNTINGS: Final = tuple(mounting_of(row) for row in PANDA.rows)


class Posture(NamedTuple):
    """The tool's place p_BT, m, its yaw, rad, and how it moves with each joint: ∂p_BT/∂q, m."""

    place: Triple
    yaw: float
    motion: tuple[Triple, ...]


def posture(q: Sequence[float]) -> Posture:
    """Compute the tool's place, its yaw, and its derivatives by the joints, at joint positions `q`, rad."""
    frames = frames_of(_MOUNTINGS, q)
    _, x, y, _ = frames[-1]
    tool = frames[-1].place(PANDA.tool)
    # The hand is mounted turned by -45° about the flange's axis.
    c, s = cos(-pi / 4), sin(-pi / 4)
    yaw = atan2(c * x[1] + s * y[1], c * x[0] + s * y[0])
    return Posture(tool, yaw, tuple(cross(z, minus(tool, origin)) for origin, _, _, z in frames[1:]))
