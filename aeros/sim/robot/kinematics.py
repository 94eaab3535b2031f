"""The kinematic chain of an arm: forward and inverse kinematics for many poses at once.

Frames: B is the arm's base, T the tool centre point between the fingertips. Every tool pose here points
down: R_BT = Rz(yaw)·Rx(π), so that at yaw 0 the fingers close along y of B.
Units: metres and radians; positions of prismatic joints are metres. Shapes: q is (n, joints), p_BT is (n,
3), yaw is (n,).
Source: J. J. Craig, Introduction to Robotics, modified Denavit–Hartenberg parameters.
"""

# Frames live in names (p_WT, R_BT, J): house style (b).
# ruff: noqa: N803, N806
from __future__ import annotations

from typing import Final

import numpy as np

from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel

_DAMPING: Final = 1e-2
"""Damping per squared pose error: large far from the target, vanishing at the solution."""

_TOLERANCE: Final = 2e-5
"""Greatest pose error of a solution, m and rad."""

_IDENTITY_6: Final = np.eye(6)
_SMALL_DAMPING: Final = 1e-6 * _IDENTITY_6
"""Damping of `ik_step`, which starts near its solution."""


_IDENTITY_3: Final = np.eye(3)


def forward_kinematics(arm: RobotModel, q: Vector) -> tuple[Vector, Vector, Vector]:
    """Compute tool poses and Jacobians.

    Args:
        arm: the robot.
        q: joint positions (n, joints), rad.

    Returns:
        (p_BT, R_BT, J): tool positions (n, 3) in B, m; tool rotations (n, 3, 3); geometric Jacobians (n, 6,
        joints) in B, linear rows (m/rad) above angular rows (rad/rad); of prismatic joints m/m and 0.
    """
    n, joints = q.shape
    cosines, sines = arm.twists
    angles = q.T + arm.zero_angles if arm.all_turn else q.T * (1.0 - arm.slides[:, None]) + arm.zero_angles
    c, s = np.cos(angles), np.sin(angles)
    turns = np.zeros((joints, n, 3, 3))
    turns[:, :, 0, 0], turns[:, :, 0, 1] = c, -s
    turns[:, :, 1, 0], turns[:, :, 1, 1], turns[:, :, 1, 2] = s * cosines, c * cosines, -sines
    turns[:, :, 2, 0], turns[:, :, 2, 1], turns[:, :, 2, 2] = s * sines, c * sines, cosines
    rotations = np.empty((joints + 1, n, 3, 3))
    rotations[0] = _IDENTITY_3
    for i in range(joints):
        np.matmul(rotations[i], turns[i], out=rotations[i + 1])
    steps = (rotations[:joints] @ arm.joint_origins)[..., 0]
    axes = rotations[1:, :, :, 2]
    if not arm.all_turn:
        steps += (q.T * arm.slides[:, None])[:, :, None] * axes
    origins = np.cumsum(steps, axis=0)
    p_BT = origins[-1] + arm.body.tool_offset[2] * axes[-1]
    R_BT = rotations[-1] @ arm.hand_rotation
    jacobian = np.empty((n, 6, joints))
    jacobian[:, :3, :] = _cross(axes.transpose(1, 2, 0), p_BT[:, :, None] - origins.transpose(1, 2, 0))
    jacobian[:, 3:, :] = axes.transpose(1, 2, 0)
    if not arm.all_turn:
        jacobian[:, :3, :] += arm.slides * (jacobian[:, 3:, :] - jacobian[:, :3, :])
        jacobian[:, 3:, :] *= 1.0 - arm.slides
    return p_BT, R_BT, jacobian


def _cross(a: Vector, b: Vector) -> Vector:
    """Compute cross products along axis 1 (np.cross costs ten times as much at these sizes)."""
    out = np.empty_like(b)
    out[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    out[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    out[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return out


def downward_rotations(yaw: Vector) -> Vector:
    """Compute the rotations of tools that point down.

    Args:
        yaw: angles about the vertical (n,), rad.

    Returns:
        R_BT = Rz(yaw)·Rx(π), (n, 3, 3).
    """
    c, s = np.cos(yaw), np.sin(yaw)
    out = np.zeros((len(yaw), 3, 3))
    out[:, 0, 0], out[:, 0, 1] = c, s
    out[:, 1, 0], out[:, 1, 1] = s, -c
    out[:, 2, 2] = -1.0
    return out


def pose_error(p_BT: Vector, R_BT: Vector, p_target: Vector, R_target: Vector) -> Vector:
    """Compute the twists from poses to their targets, to first order in the rotation.

    Args:
        p_BT: tool positions (n, 3) in B, m.
        R_BT: tool rotations (n, 3, 3).
        p_target: target positions (n, 3) in B, m.
        R_target: target rotations (n, 3, 3).

    Returns:
        Twists (n, 6) in B: translation, m, then rotation, rad.
    """
    error = np.empty((len(p_BT), 6))
    error[:, :3] = p_target - p_BT
    error[:, 3:] = 0.5 * np.sum(_cross(R_BT, R_target), axis=2)
    return error


def solve_ik(arm: RobotModel, p_BT: Vector, yaw: Vector, start: Vector) -> Vector | None:
    """Solve inverse kinematics for tools that point down, many poses at once.

    Damped least squares from `start`. The spare degree of freedom minimises the distance to
    the ready posture, which makes the solution a function of the pose, so the arm does not drift over many
    moves. Accuracy: 0.02 mm and 0.02 mrad. Solutions keep 0.02 rad inside the official limits.

    Args:
        arm: the robot.
        p_BT: tool positions (n, 3) in B, m.
        yaw: tool yaws (n,), rad.
        start: joint positions (n, joints) to start from, rad.

    Returns:
        Joint positions (n, joints), rad; None unless every pose has a solution within 60 iterations.
    """
    R_target = downward_rotations(yaw)
    ready, weights = arm.postures.ready, arm.postures.lean_weights
    q = _clamp_to_limits(arm, start)
    for _ in range(60):
        p, R, J = forward_kinematics(arm, q)
        error = pose_error(p, R, p_BT, R_target)
        # An upside-down tool has a vanishing first-order error; the third axis tells it from a solution.
        flipped = R[:, 2, 2] > 0.0
        lean = weights * (ready - q)
        step, drift = _ik_moves(J, error, lean, weights)
        if not arm.all_turn:
            free = _free_joints(arm, q, step + drift)
            if not free.all():
                step, drift = _ik_moves(J * free[:, None, :], error, lean * free, weights)
        if not flipped.any() and np.abs(error).max() < _TOLERANCE and np.abs(drift).max() < 1e-3:
            return q
        move = step + 0.7 * drift
        largest = np.abs(move).max(axis=1, keepdims=True)
        q = _clamp_to_limits(arm, q + move * np.minimum(1.0, 0.4 / np.maximum(largest, 1e-12)))
    p, R, _ = forward_kinematics(arm, q)
    good = np.abs(pose_error(p, R, p_BT, R_target)).max() < _TOLERANCE and not (R[:, 2, 2] > 0.0).any()
    return q if good else None


def _ik_moves(J: Vector, error: Vector, lean: Vector, weights: Vector) -> tuple[Vector, Vector]:
    """Return the damped step that corrects errors, and the way in its null space towards the lean."""
    JT = J.transpose(0, 2, 1)
    damping = 1e-9 + _DAMPING * np.sum(error * error, axis=1)
    A = J @ JT + damping[:, None, None] * _IDENTITY_6
    inner = np.linalg.solve(A, np.stack((error, (J @ lean[:, :, None])[:, :, 0]), axis=2))
    step = (JT @ inner[:, :, :1])[:, :, 0]
    null = lean - (JT @ inner[:, :, 1:])[:, :, 0]
    length = np.sum(null * null, axis=1)
    curvature = np.sum(weights * null * null, axis=1) / np.maximum(length, 1e-18)
    return step, null / np.maximum(curvature, 0.2)[:, None]


def _free_joints(arm: RobotModel, q: Vector, move: Vector) -> Vector:
    """Return 1.0 for each joint that can make a move, and 0.0 for one at a limit that it would go beyond.

    A prismatic joint is often at one, and the others then have to do what it cannot. Arms whose joints all
    turn are solved without this, as their recorded runs were.
    """
    below = (q <= arm.lowest_solution) & (move < 0.0)
    above = (q >= arm.highest_solution) & (move > 0.0)
    return np.where(below | above, 0.0, 1.0)


def solve_ik_one(arm: RobotModel, p_BT: Vector, yaw: float, start: Vector) -> Vector | None:
    """Solve inverse kinematics for one pose, from several starting postures in turn.

    Args:
        arm: the robot.
        p_BT: tool position (3,) in B, m.
        yaw: tool yaw, rad.
        start: joint positions to try first, rad or m; then postures turned to the pose's bearing, then
            the ready posture.

    Returns:
        Joint positions, rad; None if no start leads to a solution.
    """
    bearing = float(np.arctan2(p_BT[1], p_BT[0]))
    ready, lowest, highest = arm.postures.ready, arm.limits.lowest, arm.limits.highest
    turned = ready.copy()
    first, last = arm.turning_ends
    turned[first] = np.clip(ready[first] + bearing, lowest[first], highest[first])
    wrist = ready[last] + bearing - yaw
    turned[last] = np.clip(wrist, lowest[last], highest[last])
    # The same yaw, a whole turn on: for a wrist that would be beyond its limits.
    whole = turned.copy()
    whole[last] = wrist - 2.0 * np.pi * np.sign(wrist - turned[last])
    guesses = [start, turned, *(turned + one for one in arm.postures.search), ready]
    for guess in (*guesses, whole) if wrist != turned[last] else guesses:
        solutions = solve_ik(arm, p_BT[None, :], np.array([yaw]), guess[None, :])
        if solutions is not None:
            solution: Vector = solutions[0]
            return solution
    return None


def ik_step(arm: RobotModel, p_BT: Vector, yaw: float, q: Vector, posture: Vector) -> Vector:
    """Take one Newton step towards a pose nearby, for servoing at every tick.

    The spare degrees of freedom go half of their way to `posture`. Of an arm with prismatic joints, the
    correction of the pose is shared as `RobotModel.servo_shares` says: with equal shares a linear axis
    would follow the tool, and the arm would leave the posture of its planned path.

    Args:
        arm: the robot.
        p_BT: target tool position (3,) in B, m.
        yaw: target tool yaw, rad.
        q: current joint positions, rad.
        posture: joint positions that the spare degree of freedom approaches, rad.

    Returns:
        Joint positions, rad, clamped to 0.02 rad inside the limits.
    """
    p, R, J = forward_kinematics(arm, q[None, :])
    error = pose_error(p, R, p_BT[None, :], downward_rotations(np.array([yaw])))[0]
    jacobian = J[0]
    lean = 0.5 * (posture - q)
    moved = jacobian if arm.all_turn else jacobian * arm.servo_shares
    inner = np.linalg.solve(moved @ jacobian.T + _SMALL_DAMPING, error - jacobian @ lean)
    return _clamp_to_limits(arm, q + lean + moved.T @ inner)


def _clamp_to_limits(arm: RobotModel, q: Vector) -> Vector:
    """Clamp joint positions to 0.02 rad inside the limits."""
    # np.clip does the same and takes five times as long at these sizes.
    nearest: Vector = np.minimum(np.maximum(q, arm.lowest_solution), arm.highest_solution)
    return nearest
