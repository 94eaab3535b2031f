"""The Panda's chain for one posture, in plain numbers: what `sim.kinematics.forward` gives for many.

For a single posture NumPy's calls cost ten times what they compute.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, pi, sin
from typing import Final, NamedTuple

from aeros.sim.geometry import Triple, cross, minus, plus
from aeros.sim.kinematics import LENGTHS, OFFSETS, TOOL_OFFSET, TWISTS


class Posture(NamedTuple):
    """The tool's place p_BT, m, its yaw, rad, and how it moves with each joint: ∂p_BT/∂q, m."""

    place: Triple
    yaw: float
    motion: tuple[Triple, ...]


_ROWS: Final = tuple(
    (length, -sin(twist) * offset, cos(twist) * offset, cos(twist), sin(twist))
    for length, twist, offset in zip(LENGTHS, TWISTS, OFFSETS, strict=True)
)


def posture(q: Sequence[float]) -> Posture:
    """Where the tool is at joint positions `q`, rad, and how each joint moves it."""
    # Columns of the rotation of the last joint's frame in B, and that frame's origin.
    x, y, z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    origin = (0.0, 0.0, 0.0)
    joints: list[tuple[Triple, Triple]] = []
    for angle, (along, aside, above, ct, st) in zip(q, _ROWS, strict=True):
        origin = plus(origin, _of(x, y, z, along, aside, above))
        c, s = cos(angle), sin(angle)
        x, y, z = (
            _of(x, y, z, c, s * ct, s * st),
            _of(x, y, z, -s, c * ct, c * st),
            _of(x, y, z, 0.0, -st, ct),
        )
        joints.append((z, origin))
    tool = plus(origin, (TOOL_OFFSET * z[0], TOOL_OFFSET * z[1], TOOL_OFFSET * z[2]))
    # The hand is mounted turned by -45° about the flange's axis.
    c, s = cos(-pi / 4), sin(-pi / 4)
    yaw = atan2(c * x[1] + s * y[1], c * x[0] + s * y[0])
    return Posture(tool, yaw, tuple(cross(axis, minus(tool, place)) for axis, place in joints))


def _of(x: Triple, y: Triple, z: Triple, a: float, b: float, c: float) -> Triple:
    """a·x + b·y + c·z."""
    return (
        a * x[0] + b * y[0] + c * z[0],
        a * x[1] + b * y[1] + c * z[1],
        a * x[2] + b * y[2] + c * z[2],
    )
