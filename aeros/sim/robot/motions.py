"""Motion planners: one for each action kind, which check the parameters and prepare the motion tick by tick.

Planning a motion refuses what cannot be done and moves nothing. It returns a plan and an iterator that does
exactly that plan: the iterator sets the motors and yields once per tick. Targets are in W; the tool points
down. `base_motion` is the plan of a base motion under way: the tool then reaches its target when the base
comes to rest, and keeps its speed limit in W.
"""

# Frames live in names (p_WT, R_BT, J): house style (b).
# ruff: noqa: N803, N806
from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, hypot, pi, sqrt
from typing import Final, NamedTuple

import numpy as np

from aeros.runtime.ports import JointPath, NoMotion, PlannedMotion, ServoBounds, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.geometry import Vector3
from aeros.sim.robot.body import PANDA_BODY
from aeros.sim.robot.kinematics import ik_step
from aeros.sim.robot.limits import (
    FINGER_GAP_MAX,
    GRIP_FORCE_MAX,
    Q_MAX,
    Q_MIN,
    QD_MAX,
    QDD_MAX,
    TOOL_SPEED_MAX,
    Vector,
)
from aeros.sim.robot.parameters import ActionParameters, ActionRejectedError
from aeros.sim.robot.profile import (
    ACCELERATION_TO_MEAN,
    JERK_TO_MEAN,
    PEAK_TO_MEAN,
    JointProfile,
    UnreachableError,
    joint_profile,
    line_path,
    line_profile,
    minimum_jerk,
    minimum_jerk_ticks,
)
from aeros.sim.robot.robot import BASE_ACCELERATION_MAX, BRAKED_PARTS, Robot

MotionTicks = Iterator[None]


class PreparedMotion(NamedTuple):
    """A plan, the motion that follows it, and the parts of the robot that it moves (`arm`, `base`)."""

    plan: PlannedMotion
    motion: MotionTicks
    moved_parts: frozenset[str] = frozenset()


_ARM: Final = frozenset(("arm",))
_BASE: Final = frozenset(("base",))


SETTLE_TICKS: Final = 60
"""Longest wait for the arm to come to rest after a profile, ticks (0.25 s)."""

REST_SPEED: Final = 0.01
"""Joint speed below which the arm rests, rad/s."""

ARRIVAL_TOLERANCE: Final = 0.01
"""Greatest distance of the tool from the target of a completed move, m."""

JOINT_ARRIVAL_TOLERANCE: Final = 0.01
"""Greatest distance of a joint from the target of a completed move, rad."""

_CONTACT_SPEED: Final = 0.006
"""Speed of approach to a surface and greatest speed of force control, m/s."""

_CONTACT_SPEED_STEP: Final = 0.5 * TICK
"""Greatest change of that speed per tick, m/s (0.5 m/s²)."""

_SERVO_GAIN: Final = 0.6
"""Share of the way to the servo target made per tick: smooth, and lags by about a tick."""

_SERVO_RATE: Final = QD_MAX / 2.0
_SERVO_RATE_STEP: Final = QDD_MAX * TICK / 2.0
"""Greatest speed of a joint under feedback, rad/s, and change of it per tick."""

_FORCE_GAIN: Final = 0.0005
"""Integral force control: m/s of z per N of error."""

_FORCE_FILTER: Final = 0.3
"""Weight of a new reading of the wrist's force sensor per tick (14 Hz): it also feels the hand accelerate."""

_MIN_SPEED: Final = 1e-3
"""Least speed of a move, m/s."""

_BASE_LIMIT_SHARE: Final = 0.999
"""Share of requested speed and acceleration limit that the base uses: rounding must exceed neither."""

_SURFACE_SEARCH_DEPTH: Final = 0.02
"""Depth below its target down to which a slide searches for the surface, m."""


_SLIDE_PATH_SPACING: Final = 0.005
"""Vertical spacing of the planned paths of a slide, m."""

_MAX_PATH_DEVIATION: Final = 0.01
"""Greatest deviation of a joint from the nearest planned path of a slide, rad."""


class BlockedError(Exception):
    """Something holds the robot back during a motion; the message says where."""


def plan_stop(robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None) -> PreparedMotion:
    """Plan `stop {}`: come to rest and hold.

    Args:
        robot: the robot.
        parameters: none.
        base_motion: plan of the base motion under way, which stops too.

    Returns:
        The motion; it brakes arm and base.

    Raises:
        ActionRejectedError: there are parameters.
    """
    parameters.reject_unread()
    return PreparedMotion(NoMotion("stop: the robot comes to rest"), robot.brake(), BRAKED_PARTS)


def plan_wait(robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None) -> PreparedMotion:
    """Plan `wait {duration: s}`: hold for a while.

    Args:
        robot: the robot.
        parameters: `duration`, 0 to 600 s.
        base_motion: plan of the base motion under way, which goes on.

    Returns:
        The motion, which moves nothing.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range.
    """
    duration = parameters.number("duration", 0.0, 600.0)
    parameters.reject_unread()
    return PreparedMotion(NoMotion("wait: nothing moves"), _wait(ceil(duration / TICK)))


def _wait(ticks: int) -> MotionTicks:
    for _ in range(ticks):
        yield


def plan_move_tool(
    robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None
) -> PreparedMotion:
    """Plan `move_tool {target: m, yaw: rad, speed: m/s}`: a straight line in B whose peak speed is `speed`.

    Args:
        robot: the robot.
        parameters: `target`, the tool position in W, m; `yaw` in [-π, π], rad; `speed`, 0.001 to 1.7 m/s.
        base_motion: plan of the base motion under way; its peak speed is subtracted from `speed`.

    Returns:
        The motion of the arm.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range, the base alone is too fast, or
            the line is unreachable.
    """
    p_WT = parameters.position("target")
    yaw = parameters.number("yaw", -pi, pi)
    speed = parameters.number("speed", _MIN_SPEED, TOOL_SPEED_MAX)
    parameters.reject_unread()
    p_BT, yaw_now = robot.tool_command()
    yaw_now += 2.0 * pi * round((yaw - yaw_now) / (2.0 * pi))
    base = robot.read_sensors().base_position
    target = np.array(p_WT) - np.array(base if base_motion is None else _base_destination(base_motion))
    try:
        profile = line_profile(
            robot.q_command, (p_BT, yaw_now), (target, yaw), _relative_speed(speed, base_motion)
        )
    except UnreachableError as reason:
        raise ActionRejectedError(f"unreachable: {reason}") from reason
    trajectory = Trajectory(PANDA_BODY, (profile.path,), base, _NOWHERE, profile.ticks * TICK)
    return PreparedMotion(trajectory, _move_tool(robot, profile, p_WT), _ARM)


_NOWHERE: Final = (0.0, 0.0, 0.0)


def _relative_speed(speed: float, base_motion: Trajectory | None) -> float:
    """Return the part of a tool speed in W that is left for the arm while the base drives, m/s."""
    if base_motion is None:
        return speed
    carried = PEAK_TO_MEAN * hypot(*base_motion.base_path) / base_motion.duration
    if speed - carried < _MIN_SPEED:
        raise ActionRejectedError(f"out of range: the base alone moves the tool at {carried:.3g} m/s")
    return speed - carried


def _base_destination(base_motion: Trajectory) -> Vector3:
    """Return the position in W at which the base comes to rest, m."""
    x, y, z = (b + w for b, w in zip(base_motion.base, base_motion.base_path, strict=True))
    return (x, y, z)


def _move_tool(robot: Robot, profile: JointProfile, p_WT: Vector3) -> MotionTicks:
    yield from _follow_profile(robot, profile)
    if robot.base_speed_command.any():
        while robot.base_speed_command.any():
            yield
        yield from settle(robot)
    _check_arrival(robot, p_WT)


def _follow_profile(robot: Robot, profile: JointProfile) -> MotionTicks:
    for position, speed in zip(*profile.sample(), strict=True):
        robot.command(position, speed)
        yield
    robot.hold_arm()
    yield from settle(robot)


def plan_move_joints(
    robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None
) -> PreparedMotion:
    """Plan `move_joints {q1 … q7: rad, speed: m/s}`: all joints in step, the tool never faster than `speed`.

    Args:
        robot: the robot.
        parameters: `q1` to `q7`, target positions inside the joint limits, rad; `speed`, 0.001 to 1.7 m/s.
        base_motion: plan of the base motion under way; its peak speed is subtracted from `speed`.

    Returns:
        The motion of the arm.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range, the base alone is too fast, or
            no duration keeps the joints inside their limits.
    """
    limits = zip(Q_MIN.tolist(), Q_MAX.tolist(), strict=True)
    target = np.array([parameters.number(f"q{i}", *limit) for i, limit in enumerate(limits, 1)])
    speed = parameters.number("speed", _MIN_SPEED, TOOL_SPEED_MAX)
    parameters.reject_unread()
    base = robot.read_sensors().base_position
    try:
        profile = joint_profile(robot.q_command, target, _relative_speed(speed, base_motion))
    except UnreachableError as reason:
        raise ActionRejectedError(f"unreachable: {reason}") from reason
    trajectory = Trajectory(PANDA_BODY, (profile.path,), base, _NOWHERE, profile.ticks * TICK)
    return PreparedMotion(trajectory, _move_joints(robot, profile, target), _ARM)


def _move_joints(robot: Robot, profile: JointProfile, target: Vector) -> MotionTicks:
    yield from _follow_profile(robot, profile)
    miss = float(np.abs(np.array(robot.read_sensors().q) - target).max())
    if miss > JOINT_ARRIVAL_TOLERANCE:
        raise BlockedError(f"blocked: a joint stopped {miss:.3f} rad from its target")


def settle(robot: Robot) -> MotionTicks:
    """Wait until the arm rests: all joints below `REST_SPEED`, or `SETTLE_TICKS` have passed.

    Args:
        robot: the robot.

    Yields:
        Once per tick.
    """
    for _ in range(SETTLE_TICKS):
        yield
        if max(map(abs, robot.read_sensors().qd)) < REST_SPEED:
            return


def _check_arrival(robot: Robot, p_WT: Vector3) -> None:
    miss = float(np.linalg.norm(np.array(robot.read_sensors().tool_position) - np.array(p_WT)))
    if miss > ARRIVAL_TOLERANCE:
        raise BlockedError(f"blocked: the tool stopped {1000 * miss:.0f} mm from its target")


def plan_grip(robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None) -> PreparedMotion:
    """Plan `grip {width: m, force: N}`: move the fingers to `width`; ends when they rest.

    Args:
        robot: the robot.
        parameters: `width` between the fingers, 0 to 0.08 m; `force` on each, 0.1 to 70 N.
        base_motion: plan of the base motion under way, which goes on.

    Returns:
        The motion, which moves only the fingers.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range.
    """
    width = parameters.number("width", 0.0, FINGER_GAP_MAX)
    force = parameters.number("force", 0.1, GRIP_FORCE_MAX)
    parameters.reject_unread()
    return PreparedMotion(NoMotion("grip: only the fingers move"), _grip(robot, width, force))


def _grip(robot: Robot, width: float, force: float) -> MotionTicks:
    robot.grip(width, force)
    still = 0
    for _ in range(480):
        yield
        still = still + 1 if robot.read_sensors().finger_speed < 1e-3 else 0
        if still >= 24:
            return
    raise BlockedError("blocked: the fingers do not come to rest")


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
        ActionRejectedError: a parameter is missing, unknown or out of range, the base drives, or a path is
            unreachable.
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
        ticks = line_profile(q, (start, yaw), (_at_height(target, start[2]), yaw), along).ticks
        # Paths for every height of the surface: down over the start, then along at that height.
        paths = [line_path(q, (start, yaw), (_at_height(start, lowest), yaw))]
        heights = np.arange(lowest, max(start[2], lowest) + _SLIDE_PATH_SPACING, _SLIDE_PATH_SPACING)
        paths += [line_path(q, (_at_height(start, h), yaw), (_at_height(target, h), yaw)) for h in heights]
    except UnreachableError as reason:
        raise ActionRejectedError(f"unreachable: {reason}") from reason
    ticks = max(ticks, 120)
    servo = _servo_plan(float(np.linalg.norm((target - start)[:2])), ticks * TICK)
    trajectory = Trajectory(PANDA_BODY, tuple(paths), base, _NOWHERE, ticks * TICK, servo)
    return PreparedMotion(trajectory, _slide(robot, target, force, ticks, lowest, _SlidePaths(paths)), _ARM)


def _at_height(p: Vector, height: float) -> Vector:
    return np.array([p[0], p[1], height])


def _servo_plan(distance: float, duration: float) -> ServoBounds:
    """Return the bounds that `_servo_tick` keeps: of the joints, and of the set point along and in height."""
    rise = _CONTACT_SPEED_STEP / TICK
    return ServoBounds(
        joint_tolerance=(_MAX_PATH_DEVIATION,) * 7,
        speed=tuple((QD_MAX / 2.0).tolist()),
        acceleration=tuple((QDD_MAX / 2.0).tolist()),
        jerk=tuple((QDD_MAX / TICK).tolist()),
        tool_speed=hypot(PEAK_TO_MEAN * distance / duration, _CONTACT_SPEED),
        tool_acceleration=hypot(ACCELERATION_TO_MEAN * distance / duration**2, rise),
        tool_jerk=hypot(JERK_TO_MEAN * distance / duration**3, 2.0 * rise / TICK),
    )


class _SlidePaths:
    """The paths of a slide as sampled points, to detect when the arm leaves them."""

    def __init__(self, paths: list[JointPath]) -> None:
        corners = np.concatenate([np.array(path) for path in paths])
        u = np.linspace(0.0, 1.0, 4)[None, :, None]
        v = 1.0 - u
        a, b, c, d = (corners[:, corner, None, :] for corner in range(4))
        self._q = (v**3 * a + 3.0 * v * u * (v * b + u * c) + u**3 * d).reshape(-1, 7)
        self._by_joint = np.ascontiguousarray(self._q.T)
        self._away = np.empty_like(self._by_joint)
        self._last_query: tuple[Vector, Vector] | None = None

    def nearest(self, q: Vector) -> Vector:
        """Return the sampled point nearest to `q` (largest joint distance), rad.

        Raises BlockedError if it is farther away than `_MAX_PATH_DEVIATION`.
        """
        # Each set point is queried twice: at the end of a tick and at the beginning of the next.
        if self._last_query is not None and self._last_query[0] is q:
            return self._last_query[1]
        away = np.abs(np.subtract(self._by_joint, q[:, None], out=self._away), out=self._away).max(axis=0)
        index = int(away.argmin())
        if away[index] > _MAX_PATH_DEVIATION:
            raise BlockedError(f"blocked: the slide leaves its planned paths by {away[index]:.3f} rad")
        nearest: Vector = self._q[index]
        self._last_query = (q, nearest)
        return nearest


def _slide(
    robot: Robot, target: Vector, force: float, ticks: int, lowest: float, paths: _SlidePaths
) -> MotionTicks:
    yield from settle(robot)
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
    yield from settle(robot)


def _servo_tick(robot: Robot, p_BT: Vector, yaw: float, paths: _SlidePaths) -> None:
    """Servo for one tick, with at most half of any joint's speed and acceleration limit."""
    here = robot.q_command
    rate = _SERVO_GAIN * (ik_step(p_BT, yaw, here, paths.nearest(here)) - here) / TICK
    before = robot.qd_command
    rate = np.minimum(np.maximum(rate, -_SERVO_RATE), _SERVO_RATE)
    rate = np.minimum(np.maximum(rate, before - _SERVO_RATE_STEP), before + _SERVO_RATE_STEP)
    q = here + rate * TICK
    paths.nearest(q)
    robot.command(q, rate)


def plan_move_base(
    robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None
) -> PreparedMotion:
    """Plan `move_base {x: m, y: m, speed: m/s}`: drive the carriage along a straight line, arm at rest.

    Args:
        robot: the robot.
        parameters: `x` and `y` of the arm's base in W, within ±10 m; `speed`, 0.001 to 1 m/s.
        base_motion: plan of the base motion under way; ignored.

    Returns:
        The motion of the base.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range, or the robot has no carriage.
    """
    x = parameters.number("x", -10.0, 10.0)
    y = parameters.number("y", -10.0, 10.0)
    speed = parameters.number("speed", 1e-3, 1.0)
    parameters.reject_unread()
    if not robot.has_carriage:
        raise ActionRejectedError("unknown kind: `move_base` on a robot without a carriage")
    target = np.array([x, y])
    way = target - robot.base_origin - robot.base_command
    distance = float(np.linalg.norm(way))
    most = BASE_ACCELERATION_MAX * _BASE_LIMIT_SHARE
    slowest = ceil((ACCELERATION_TO_MEAN * distance / most) ** 0.5 / TICK)
    ticks = max(minimum_jerk_ticks(distance, speed * _BASE_LIMIT_SHARE), slowest, 1)
    rest = robot.q_command.tolist()
    at_rest = (tuple(rest),) * 4
    px, py = (robot.base_origin + robot.base_command).tolist()
    base = (px, py, robot.read_sensors().base_position[2])
    travel = (float(way[0]), float(way[1]), 0.0)
    trajectory = Trajectory(PANDA_BODY, ((at_rest,),), base, travel, ticks * TICK)
    return PreparedMotion(trajectory, _move_base(robot, target, way, ticks), _BASE)


def _move_base(robot: Robot, target: Vector, way: Vector, ticks: int) -> MotionTicks:
    start = robot.base_command
    share, rate, _ = minimum_jerk(np.arange(1, ticks + 1) / ticks)
    for part, pace in zip(share, rate / (ticks * TICK), strict=True):
        robot.command_base(start + part * way, pace * way)
        yield
    robot.hold_base()
    yield from _wait(SETTLE_TICKS)
    at = np.array(robot.read_sensors().base_position[:2])
    miss = float(np.linalg.norm(at - target))
    if miss > ARRIVAL_TOLERANCE:
        raise BlockedError(f"blocked: the base stopped {1000 * miss:.0f} mm from its target")


PLANNERS: Final[dict[str, Callable[[Robot, ActionParameters, Trajectory | None], PreparedMotion]]] = {
    "stop": plan_stop,
    "wait": plan_wait,
    "move_tool": plan_move_tool,
    "move_joints": plan_move_joints,
    "grip": plan_grip,
    "slide": plan_slide,
    "move_base": plan_move_base,
}
"""Motion planners by action kind; the plant itself handles `look`, which moves nothing."""
