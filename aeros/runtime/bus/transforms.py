"""Transforms of a robot's chain of frames: world, base, links, tool; each in its parent frame.

Joint positions are measured; chain and base pose come from the plant's planned motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Final

from aeros.kinematic_chain import ORIGIN, JointFrame, child_frame, mounting_of
from aeros.runtime.bus.measurement_messages import WORLD
from aeros.runtime.bus.messages import (
    Header,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)
from aeros.runtime.ports import JointVector, RobotBody, Vec3

BASE: Final = "base"
TOOL: Final = "tool"


def link_frame(joint: str) -> str:
    """Name the frame of the link that a joint moves.

    Args:
        joint: Name of the joint.

    Returns:
        Name of the frame.
    """
    return f"{joint}_link"


def chain_transforms(
    body: RobotBody, base: Vec3 | None, names: Sequence[str], q: JointVector, when: Time
) -> TFMessage:
    """Make the transforms of all frames of a chain.

    Args:
        body: the chain.
        base: position of the base in the world frame, m; None if unknown, then its transform is left out.
        names: names of the joints, one for each of `q`; the link that joint NAME moves is `NAME_link`.
        q: joint positions, rad or m.
        when: time stamp.

    Returns:
        Pose of each frame in its parent.
    """
    messages = [] if base is None else [_transform_message(WORLD, BASE, base, when)]
    parent = BASE
    for row, angle, name in zip(body.dh_rows, q, names, strict=True):
        frame, child = child_frame(ORIGIN, mounting_of(row), angle), link_frame(name)
        turned = Transform(Vector3(*frame.origin), frame_quaternion(frame))
        messages.append(TransformStamped(Header(when, parent), child, turned))
        parent = child
    messages.append(_transform_message(parent, TOOL, body.tool_offset, when))
    return TFMessage(tuple(messages))


def _transform_message(parent: str, child: str, by: Vec3, when: Time) -> TransformStamped:
    return TransformStamped(Header(when, parent), child, Transform(Vector3(*by)))


def frame_quaternion(frame: JointFrame) -> Quaternion:
    """Convert the rotation of a frame to a quaternion.

    Of four equivalent formulas, uses the one that divides by the largest component.

    Args:
        frame: rotation relative to its parent frame.

    Returns:
        Unit quaternion that rotates the parent's axes into those of `frame`.
    """
    _, (a, b, c), (d, e, f), (g, h, i) = frame  # the columns of the rotation
    # Four times the squares of w, x, y and z.
    squares = (1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i)
    largest = max(range(4), key=squares.__getitem__)
    twice = sqrt(squares[largest])
    half = 0.5 / twice
    first = 0.5 * twice
    if largest == 0:
        return Quaternion((f - h) * half, (g - c) * half, (b - d) * half, first)
    if largest == 1:
        return Quaternion(first, (b + d) * half, (g + c) * half, (f - h) * half)
    if largest == 2:
        return Quaternion((b + d) * half, first, (f + h) * half, (g - c) * half)
    return Quaternion((g + c) * half, (f + h) * half, first, (b - d) * half)
