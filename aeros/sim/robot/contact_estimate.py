"""Estimate the force of a contact from the external torques of the joints, as arms with torque sensors do.

A force f (N) at a point of a link gives each joint below it the torque τ_i = (z_i × (p − o_i)) · f, with the
joint's axis z_i and origin o_i, and each prismatic joint the force z_i · f; joints beyond the link feel
nothing of it. So

- a contact on hand or fingers is a wrench at the tool point (3 forces, 3 moments), found from all
  torques by damped least squares, w = (J·Jᵀ + λ²)⁻¹·J·τ, wherever on the hand it is;
- a contact elsewhere is on a link from the last joint with a torque outwards. Where on it is not known: the
  force is found for the outer end of each such link's capsule, and the greatest counts.

Source: S. Haddadin, A. De Luca, A. Albu-Schäffer, Robot Collisions: A Survey on Detection, Isolation, and
Identification, IEEE Transactions on Robotics 33 (2017), sections IV and V.
Not seen: forces whose line passes through every axis, as along a stretched arm.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import hypot
from typing import Final

import numpy as np

from aeros.kinematic_chain import JointFrame, Triple, frames_of, point_derivative
from aeros.sim.robot.model import RobotModel

DAMPING: Final = 0.03
"""λ of the least squares, m: a torque error of 1 N·m gives at most 1/(2·λ) = 17 N; chosen."""

LINK_DAMPING: Final = 0.1
"""The same for a contact on another link, m: near an axis a small torque would be a large force. Chosen, so
that fingers that push sideways with 18 N are not taken for an elbow that is hit with more than 65 N."""

_LEVER_LENGTH: Final = 0.1
"""Lever by which moments at the tool point are compared with forces, m: half of the hand."""

LEAST_TORQUE: Final = 0.3
"""Norm of all external torques below which nothing is felt, N·m: free motion has up to 0.1, as measured.
Forces of prismatic joints count as torques at a lever of 1 m."""

_DAMPING_6: Final = DAMPING**2 * np.eye(6)


def estimate_contact_force(arm: RobotModel, q: Sequence[float], torques: Sequence[float]) -> float:
    """Estimate the magnitude of a contact's force.

    Args:
        arm: the robot.
        q: joint positions, rad or m.
        torques: external torques, N·m; of prismatic joints forces, N.

    Returns:
        The force, N; the greatest if it cannot be told on which link the contact is; 0 if the torques are
        below `LEAST_TORQUE`.
    """
    if hypot(*torques) < LEAST_TORQUE:
        return 0.0
    frames = frames_of(arm.mountings, q)
    force = _on_hand(arm, frames, torques)
    last = max(
        (
            joint
            for joint, (torque, least) in enumerate(zip(torques, arm.servos.felt_torque, strict=True), 1)
            if abs(torque) > least
        ),
        default=arm.joint_count,
    )
    for link in range(max(last, 2), arm.joint_count):
        force = max(force, _on_link(arm, frames, torques, link))
    return force


def _on_hand(arm: RobotModel, frames: Sequence[JointFrame], torques: Sequence[float]) -> float:
    """Return the force of the wrench at the tool point, N."""
    tool = frames[-1].to_base(arm.body.tool_offset)
    jacobian = np.array(
        [
            (
                *point_derivative(frame, mounting, tool),
                *(0.0 if is_sliding else _LEVER_LENGTH * part for part in frame.z),
            )
            for frame, mounting in zip(frames[1:], arm.mountings, strict=True)
            for is_sliding in mounting[-1:]
        ]
    ).T
    wrench = np.linalg.solve(jacobian @ jacobian.T + _DAMPING_6, jacobian @ np.array(torques))
    return hypot(*wrench[:3].tolist())


def _on_link(arm: RobotModel, frames: Sequence[JointFrame], torques: Sequence[float], link: int) -> float:
    """Return the force at the outer end of a link, N."""
    end = frames[link].to_base(_outer_ends(arm)[link])
    # (J·Jᵀ + λ²)·f = J·τ, symmetric: a b c / b d e / c e g.
    a = d = g = LINK_DAMPING**2
    b = c = e = u = v = w = 0.0
    for frame, mounting, torque in zip(frames[1 : link + 1], arm.mountings, torques, strict=False):
        x, y, height = point_derivative(frame, mounting, end)
        a, b, c = a + x * x, b + x * y, c + x * height
        d, e, g = d + y * y, e + y * height, g + height * height
        u, v, w = u + x * torque, v + y * torque, w + height * torque
    p, r, s = d * g - e * e, c * e - b * g, b * e - c * d
    determinant = a * p + b * r + c * s
    return hypot(
        (p * u + r * v + s * w) / determinant,
        (r * u + (a * g - c * c) * v + (b * c - a * e) * w) / determinant,
        (s * u + (b * c - a * e) * v + (a * d - b * b) * w) / determinant,
    )


@cache
def _outer_ends(arm: RobotModel) -> dict[int, Triple]:
    """Return the end of each link's capsule that is farthest from its joint, in that joint's frame, m."""
    return {
        capsule.joint: max(capsule.a, capsule.b, key=lambda end: hypot(*end))
        for capsule in arm.capsules
        if 2 <= capsule.joint < arm.joint_count and capsule.link in arm.own_links
    }
