"""Slide: a line along a surface, pressed on it with a force under feedback.

The plan states a path for every height at which the surface may be; the motion stays near these paths.
"""

# Frames live in names (p_WT, R_BT, J): house style (b).
# ruff: noqa: N803, N806
from __future__ import annotations

from math import hypot, sqrt
from typing import Final

import numpy as np

from aeros.runtime.ports import JointPath, ServoBounds, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.robot.errors import ActionRejectedError, BlockedError
from aeros.sim.robot.kinematics import ik_step
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.motions import (
    ARM,
    NO_TRAVEL,
    ActionParameters,
    MotionTicks,
    PreparedMotion,
)
from aeros.sim.robot.profile import (
    ACCELERATION_TO_MEAN,
    JERK_TO_MEAN,
    PEAK_TO_MEAN,
    UnreachableError,
    line_path,
    line_profile,
    minimum_jerk,
)
from aeros.sim.robot.robot import Robot

_CONTACT_SPEED: Final = 0.006
"""Speed of approach to a surface and greatest speed of force control, m/s."""

_CONTACT_SPEED_STEP: Final = 0.5 * TICK
"""Greatest change of that speed per tick, m/s (0.5 m/s²)."""

_SERVO_GAIN: Final = 0.6
"""Share of the way to the servo target made per tick: smooth, and lags by about a tick."""

_FORCE_GAIN: Final = 0.0005
"""Integral force control: m/s of z per N of error."""

_FORCE_FILTER: Final = 0.3
"""Weight of a new reading of the wrist's force sensor per tick (14 Hz): it also feels the hand accelerate."""

_SURFACE_SEARCH_DEPTH: Final = 0.02
"""Depth below its target down to which a slide searches for the surface, m."""


_SLIDE_PATH_SPACING: Final = 0.005
"""Vertical spacing of the planned paths of a slide, m."""

_MAX_PATH_DEVIATION: Final = 0.01
"""Greatest deviation of a joint from the nearest planned path of a slide, rad."""

_CHORDS: Final = 8
"""Chords by which each piece of a planned path is approximated."""

_POSTURE_WIDTH: Final = 0.005
"""Distance over which neighbouring paths share in the posture of a slide, rad; paths are 0.01 rad apart."""

_TINY: Final = 1e-18
"""Least squared length of a chord, rad²: a path that stands still has none."""


def plan_slide(robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None) -> PreparedMotion:
    """Plan `slide {target: m, force: N, speed: m/s}`: a line along x and y, pressing down with `force`.

    First the tool descends until the wrist measures half the force, at most 20 mm below the target's z.
    Then it moves for at least half a second, while integral control on z holds the force. The descent is
    slow (6 mm/s, so that contact peaks near 10 N): start it close to the surface.

    Args:
        robot: the robot.
        parameters: `target`, the tool position in W, m, its z near the surface; `force`, 0.5 to 60 N;
            `speed`, 0.001 to 0.5 m/s.
        base_motion: plan of the base motion under way; must be None.

    Returns:
        The motion of the arm, under feedback.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range, the arm has a prismatic joint,
            the base drives, or a path is unreachable.
    """
    p_WT = parameters.position("target")
    force = parameters.number("force", 0.5, 60.0)
    speed = parameters.number("speed", 1e-3, 0.5)
    parameters.reject_unread()
    if base_motion is not None:
        raise ActionRejectedError("not allowed while the base drives: the pressed object would be dragged")
    start, yaw = robot.tool_command()
    base = robot.read_sensors().base_position
    target = np.array(p_WT) - np.array(base)
    lowest = float(target[2]) - _SURFACE_SEARCH_DEPTH
    q = robot.q_command
    try:
        # The speed of both along and down together must not exceed `speed`; at least half of it goes along.
        along = sqrt(max(speed * speed - _CONTACT_SPEED * _CONTACT_SPEED, speed * speed / 4.0))
        ticks = line_profile(robot.model, q, (start, yaw), (_at_height(target, start[2]), yaw), along).ticks
        # Paths for every height of the surface: down over the start, then along at that height.
        paths = [line_path(robot.model, q, (start, yaw), (_at_height(start, lowest), yaw))]
        heights = np.arange(lowest, max(start[2], lowest) + _SLIDE_PATH_SPACING, _SLIDE_PATH_SPACING)
        paths += [
            line_path(robot.model, q, (_at_height(start, h), yaw), (_at_height(target, h), yaw))
            for h in heights
        ]
    except UnreachableError as reason:
        raise ActionRejectedError(f"unreachable: {reason}") from reason
    ticks = max(ticks, 120)
    servo = _servo_plan(robot.model, float(np.linalg.norm((target - start)[:2])), ticks * TICK)
    trajectory = Trajectory(robot.model.body, tuple(paths), base, NO_TRAVEL, ticks * TICK, servo)
    return PreparedMotion(trajectory, _slide(robot, target, force, ticks, lowest, _SlidePaths(paths)), ARM)


def _at_height(p: Vector, height: float) -> Vector:
    return np.array([p[0], p[1], height])


def _servo_plan(arm: RobotModel, distance: float, duration: float) -> ServoBounds:
    """Return the bounds that `_servo_tick` keeps: of the joints, and of the set point along and in height."""
    rise = _CONTACT_SPEED_STEP / TICK
    return ServoBounds(
        joint_tolerance=(_MAX_PATH_DEVIATION,) * arm.joint_count,
        speed=tuple((arm.limits.speed / 2.0).tolist()),
        acceleration=tuple((arm.limits.acceleration / 2.0).tolist()),
        jerk=tuple((arm.limits.acceleration / TICK).tolist()),
        tool_speed=hypot(PEAK_TO_MEAN * distance / duration, _CONTACT_SPEED),
        tool_acceleration=hypot(ACCELERATION_TO_MEAN * distance / duration**2, rise),
        tool_jerk=hypot(JERK_TO_MEAN * distance / duration**3, 2.0 * rise / TICK),
    )


class _SlidePaths:
    """The paths of a slide as chords, to detect when the arm leaves them and to choose its posture."""

    def __init__(self, paths: list[JointPath]) -> None:
        corners = np.concatenate([np.array(path) for path in paths])
        u = np.linspace(0.0, 1.0, _CHORDS + 1)[None, :, None]
        v = 1.0 - u
        a, b, c, d = (corners[:, corner, None, :] for corner in range(4))
        points = v**3 * a + 3.0 * v * u * (v * b + u * c) + u**3 * d
        # A row for each joint: sums and extremes over joints then add whole rows, in half the time.
        self._starts = np.ascontiguousarray(points[:, :-1].reshape(-1, points.shape[-1]).T)
        self._chords = np.ascontiguousarray(np.diff(points, axis=1).reshape(-1, points.shape[-1]).T)
        self._squares = np.maximum((self._chords**2).sum(axis=0), _TINY)
        self._last_query: tuple[Vector, Vector] | None = None

    def posture(self, q: Vector) -> Vector:
        """Return the posture that the slide leans to at `q`, rad.

        It is the mean of the nearest points of all chords, each weighted by its distance from `q`:
        exp(-d²/2σ²) with σ = `_POSTURE_WIDTH`. So it follows `q` without steps, also between paths.

        Raises:
            BlockedError: every path is farther away than `_MAX_PATH_DEVIATION` (largest joint distance).
        """
        # Each set point is queried twice: at the end of a tick and at the beginning of the next.
        if self._last_query is not None and self._last_query[0] is q:
            return self._last_query[1]
        column = q[:, None]
        shares = ((column - self._starts) * self._chords).sum(axis=0) / self._squares
        points = self._starts + np.minimum(np.maximum(shares, 0.0), 1.0) * self._chords
        away = points - column
        deviation = float(np.abs(away).max(axis=0).min())
        if deviation > _MAX_PATH_DEVIATION:
            raise BlockedError(f"blocked: the slide leaves its planned paths by {deviation:.3f} rad")
        squares = (away * away).sum(axis=0)
        weights = np.exp((squares.min() - squares) / (2.0 * _POSTURE_WIDTH**2))
        posture: Vector = weights @ np.ascontiguousarray(points.T) / weights.sum()
        self._last_query = (q, posture)
        return posture


def _slide(
    robot: Robot, target: Vector, force: float, ticks: int, lowest: float, paths: _SlidePaths
) -> MotionTicks:
    yield from robot.settle()
    tare = robot.wrist_vertical_force()
    start, yaw = robot.tool_command()
    p_BT = start.copy()
    pressed = pace = 0.0
    while pressed < force / 2.0:
        pace = min(_CONTACT_SPEED, pace + _CONTACT_SPEED_STEP)
        p_BT[2] -= pace * TICK
        if p_BT[2] < lowest:
            raise BlockedError("no contact: no surface down to 20 mm below the target")
        _servo_tick(robot, p_BT, yaw, paths)
        yield
        pressed += _FORCE_FILTER * (robot.wrist_vertical_force() - tare - pressed)
    share, _, _ = minimum_jerk(np.arange(1, ticks + 1) / ticks)
    for part in share:
        pressed += _FORCE_FILTER * (robot.wrist_vertical_force() - tare - pressed)
        correction = min(_CONTACT_SPEED, max(-_CONTACT_SPEED, _FORCE_GAIN * (force - pressed)))
        pace = min(pace + _CONTACT_SPEED_STEP, max(pace - _CONTACT_SPEED_STEP, correction))
        p_BT[2] -= pace * TICK
        if p_BT[2] < lowest:
            raise BlockedError("contact lost: no surface down to 20 mm below the target")
        p_BT[:2] = start[:2] + part * (target[:2] - start[:2])
        _servo_tick(robot, p_BT, yaw, paths)
        yield
    robot.hold_arm()
    yield from robot.settle()


def _servo_tick(robot: Robot, p_BT: Vector, yaw: float, paths: _SlidePaths) -> None:
    """Servo for one tick, with at most half of any joint's speed and acceleration limit."""
    here, limits = robot.q_command, robot.model.limits
    fastest, step = limits.speed / 2.0, limits.acceleration * TICK / 2.0
    rate = _SERVO_GAIN * (ik_step(robot.model, p_BT, yaw, here, paths.posture(here)) - here) / TICK
    before = robot.qd_command
    rate = np.minimum(np.maximum(rate, -fastest), fastest)
    rate = np.minimum(np.maximum(rate, before - step), before + step)
    q = here + rate * TICK
    paths.posture(q)
    robot.command(q, rate)
