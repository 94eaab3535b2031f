"""The frames of a robot's chain as transforms, each in the one before: world, base, links, tool.

Joints are where they were measured; the chain itself and the base are what the plant said of them.
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


def chain_transforms(
    body: RobotBody, base: Vec3 | None, names: Sequence[str], q: JointVector, when: Time
) -> TFMessage:
    """Where each frame is in the one before it.

    base: where the base is in the world; None where that is not known, and then it is not told.
    names: of the joints, one for each of `q`, rad; the link that joint NAME moves is `NAME_link`.
    """
    found = [] if base is None else [_transform_message(WORLD, BASE, base, when)]
    parent = BASE
    for row, angle, name in zip(body.dh_rows, q, names, strict=True):
        frame, child = child_frame(ORIGIN, mounting_of(row), angle), f"{name}_link"
        turned = Transform(Vector3(*frame.origin), frame_quaternion(frame))
        found.append(TransformStamped(Header(when, parent), child, turned))
        parent = child
    found.append(_transform_message(parent, TOOL, body.tool_offset, when))
    return TFMessage(tuple(found))


def _transform_message(parent: str, child: str, by: Vec3, when: Time) -> TransformStamped:
    return TransformStamped(Header(when, parent), child, Transform(Vector3(*by)))


def frame_quaternion(frame: JointFrame) -> Quaternion:
    """The unit quaternion that turns the parent's axes into those of `frame`.

    Of four ways to write it down, that which divides by the largest component.
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
