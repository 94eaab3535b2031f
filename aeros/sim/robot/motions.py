"""Motion planners: one for each action kind, which check the parameters and prepare the motion tick by tick.

Planning a motion refuses what cannot be done and moves nothing. It returns a plan and an iterator that does
exactly that plan: the iterator sets the motors and yields once per tick. Targets are in W; the tool points
down. `base_motion` is the plan of a base motion under way: the tool then reaches its target when the base
comes to rest, and keeps its speed limit in W.
"""

# Frames live in names (p_WT, R_BT, J): house style (b).
# ruff: noqa: N803, N806
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil, hypot, pi
from typing import Any, Final, NamedTuple

import numpy as np

from aeros.runtime.ports import MotionCompletion, NoMotion, PlannedMotion, Trajectory
from aeros.sim.clock import TICK
from aeros.sim.geometry import Vector3
from aeros.sim.robot.errors import ActionRejectedError, BlockedError
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.profile import (
    ACCELERATION_TO_MEAN,
    PEAK_TO_MEAN,
    JointProfile,
    UnreachableError,
    joint_profile,
    line_profile,
    minimum_jerk,
    minimum_jerk_ticks,
)
from aeros.sim.robot.robot import BASE_ACCELERATION_MAX, BRAKED_PARTS, SETTLE_TICKS, Robot

MotionTicks = Iterator[None]


class ActionParameters:
    """Parameters of one action: missing, unknown, mistyped and out-of-range ones are refused.

    Each is read once, and `reject_unread` refuses the rest.
    """

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    def number(self, name: str, low: float, high: float) -> float:
        """Read a number.

        Args:
            name: of the parameter.
            low: least allowed value, SI.
            high: greatest allowed value, SI.

        Returns:
            The number, in [low, high].

        Raises:
            ActionRejectedError: it is missing, no number or out of range.
        """
        return self._check(name, self._take(name), low, high)

    def position(self, name: str, limit: float = 10.0) -> Vector3:
        """Read a position in W.

        Args:
            name: of the parameter.
            limit: greatest absolute value of a coordinate, m.

        Returns:
            The position, m.

        Raises:
            ActionRejectedError: it is missing, no 3-tuple of numbers or out of range.
        """
        value = self._take(name)
        if not isinstance(value, tuple) or len(value) != 3:
            raise ActionRejectedError(f"bad parameter: `{name}` is not a 3-tuple")
        x, y, z = (self._check(name, part, -limit, limit) for part in value)
        return (x, y, z)

    def string(self, name: str) -> str:
        """Read a string.

        Args:
            name: of the parameter.

        Returns:
            The string.

        Raises:
            ActionRejectedError: it is missing or no string.
        """
        value = self._take(name)
        if not isinstance(value, str):
            raise ActionRejectedError(f"bad parameter: `{name}` is not a string")
        return value

    def reject_unread(self) -> None:
        """Refuse parameters that were not read.

        Raises:
            ActionRejectedError: there is one.
        """
        if self._values:
            raise ActionRejectedError(f"unknown parameter: `{min(self._values)}`")

    def _take(self, name: str) -> Any:
        if name not in self._values:
            raise ActionRejectedError(f"missing parameter: `{name}`")
        return self._values.pop(name)

    @staticmethod
    def _check(name: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
            raise ActionRejectedError(f"bad parameter: `{name}` is not a number")
        if not low <= value <= high:
            raise ActionRejectedError(f"out of range: `{name}` is outside [{low:g}, {high:g}]")
        return float(value)


class PreparedMotion(NamedTuple):
    """A motion that is ready to start.

    Attributes:
        plan: the plan, for the check before it starts.
        motion: the motion that follows the plan, tick by tick.
        moved_parts: parts of the robot that it moves, of `arm` and `base`.
    """

    plan: PlannedMotion
    motion: MotionTicks
    moved_parts: frozenset[str] = frozenset()


ARM: Final = frozenset(("arm",))
_BASE: Final = frozenset(("base",))

NO_TRAVEL: Final = (0.0, 0.0, 0.0)
"""Displacement of a base that stands still, m."""

ARRIVAL_TOLERANCE: Final = 0.01
"""Greatest distance of the tool from the target of a completed move, m."""

JOINT_ARRIVAL_TOLERANCE: Final = 0.01
"""Greatest distance of a joint from the target of a completed move, rad or m."""

_MIN_SPEED: Final = 1e-3
"""Least speed of a move, m/s."""

_BASE_LIMIT_SHARE: Final = 0.999
"""Share of requested speed and acceleration limit that the base uses: rounding must exceed neither."""


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
        parameters: `target`, the tool position in W, m; `yaw` in [-π, π], rad; `speed`, from 0.001 m/s to the
            tool's limit.
        base_motion: plan of the base motion under way; its peak speed is subtracted from `speed`.

    Returns:
        The motion of the arm.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range, the base alone is too fast, or
            the line is unreachable.
    """
    line = _ToolLine.read(parameters, robot.model)
    base = robot.read_sensors().base_position
    target = base if base_motion is None else _base_destination(base_motion)
    speed = _relative_speed(line.speed, base_motion)
    profile = _tool_line_profile(robot.model, robot.q_command, robot.tool_command(), line, target, speed)
    trajectory = Trajectory(robot.model.body, (profile.path,), base, NO_TRAVEL, profile.ticks * TICK)
    return PreparedMotion(trajectory, _move_tool(robot, profile, line.target), ARM)


class _ToolLine(NamedTuple):
    """Parameters of `move_tool`: target in W (m), yaw there (rad) and peak speed (m/s)."""

    target: Vector3
    yaw: float
    speed: float

    @classmethod
    def read(cls, parameters: ActionParameters, arm: RobotModel) -> _ToolLine:
        line = cls(
            parameters.position("target"),
            parameters.number("yaw", -pi, pi),
            parameters.number("speed", _MIN_SPEED, arm.tool_limits.speed),
        )
        parameters.reject_unread()
        return line


def _tool_line_profile(
    arm: RobotModel,
    q: Vector,
    pose: tuple[Vector, float],
    line: _ToolLine,
    base: Vector3,
    speed: float,
) -> JointProfile:
    """Plan the profile of a line from a joint position and the tool's pose there, in B.

    Raises:
        ActionRejectedError: the line is unreachable.
    """
    p_BT, yaw_now = pose
    yaw_now += 2.0 * pi * round((line.yaw - yaw_now) / (2.0 * pi))
    target = np.array(line.target) - np.array(base)
    try:
        return line_profile(arm, q, (p_BT, yaw_now), (target, line.yaw), speed)
    except UnreachableError as reason:
        raise ActionRejectedError(f"unreachable: {reason}") from reason


def plan_tool_lines(robot: Robot, lines: Sequence[ActionParameters]) -> list[PlannedMotion]:
    """Plan `move_tool` actions one after the other, each from where the one before it ends.

    Args:
        robot: the robot; its base stands.
        lines: the parameters of each.

    Returns:
        The trajectories; in place of the first that is refused, the reason, and none after it.
    """
    base = robot.read_sensors().base_position
    q, pose = robot.q_command, robot.tool_command()
    plans: list[PlannedMotion] = []
    for parameters in lines:
        try:
            line = _ToolLine.read(parameters, robot.model)
            profile = _tool_line_profile(robot.model, q, pose, line, base, line.speed)
        except ActionRejectedError as refusal:
            return [*plans, MotionCompletion(False, str(refusal))]
        plans.append(Trajectory(robot.model.body, (profile.path,), base, NO_TRAVEL, profile.ticks * TICK))
        q, pose = np.array(profile.path[-1][3]), (np.array(line.target) - np.array(base), line.yaw)
    return plans


def _relative_speed(speed: float, base_motion: Trajectory | None) -> float:
    """Return the part of a tool speed in W that is left for the arm while the base drives, m/s.

    Raises:
        ActionRejectedError: the base alone is as fast as that.
    """
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
        yield from robot.settle()
    _check_arrival(robot, p_WT)


def _follow_profile(robot: Robot, profile: JointProfile) -> MotionTicks:
    for position, speed in zip(*profile.sample(), strict=True):
        robot.command(position, speed)
        yield
    robot.hold_arm()
    yield from robot.settle()


def plan_move_joints(
    robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None
) -> PreparedMotion:
    """Plan `move_joints {q1 … qn, speed: m/s}`: all joints in step, the tool never faster than `speed`.

    Args:
        robot: the robot.
        parameters: `q1` to `qn`, target positions inside the joint limits, rad or m; `speed`, from 0.001 m/s
            to the tool's limit.
        base_motion: plan of the base motion under way; its peak speed is subtracted from `speed`.

    Returns:
        The motion of the arm.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range, the base alone is too fast, or
            no duration keeps the joints inside their limits.
    """
    limits = zip(robot.model.limits.lowest.tolist(), robot.model.limits.highest.tolist(), strict=True)
    target = np.array([parameters.number(f"q{i}", *limit) for i, limit in enumerate(limits, 1)])
    speed = parameters.number("speed", _MIN_SPEED, robot.model.tool_limits.speed)
    parameters.reject_unread()
    base = robot.read_sensors().base_position
    try:
        profile = joint_profile(robot.model, robot.q_command, target, _relative_speed(speed, base_motion))
    except UnreachableError as reason:
        raise ActionRejectedError(f"unreachable: {reason}") from reason
    trajectory = Trajectory(robot.model.body, (profile.path,), base, NO_TRAVEL, profile.ticks * TICK)
    return PreparedMotion(trajectory, _move_joints(robot, profile, target), ARM)


def _move_joints(robot: Robot, profile: JointProfile, target: Vector) -> MotionTicks:
    yield from _follow_profile(robot, profile)
    misses = np.abs(np.array(robot.read_sensors().q) - target)
    worst = int(misses.argmax())
    miss = float(misses[worst])
    if miss > JOINT_ARRIVAL_TOLERANCE:
        unit = "m" if robot.model.slides[worst] else "rad"
        raise BlockedError(f"blocked: a joint stopped {miss:.3f} {unit} from its target")


def _check_arrival(robot: Robot, p_WT: Vector3) -> None:
    miss = float(np.linalg.norm(np.array(robot.read_sensors().tool_position) - np.array(p_WT)))
    if miss > ARRIVAL_TOLERANCE:
        raise BlockedError(f"blocked: the tool stopped {1000 * miss:.0f} mm from its target")


def plan_grip(robot: Robot, parameters: ActionParameters, base_motion: Trajectory | None) -> PreparedMotion:
    """Plan `grip {width: m, force: N}`: move the fingers to `width`; ends when they rest.

    Args:
        robot: the robot.
        parameters: `width` between the fingers, 0 to the hand's widest gap, m; `force` on each, from 0.1 N to
            its greatest force.
        base_motion: plan of the base motion under way, which goes on.

    Returns:
        The motion, which moves only the fingers.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range.
    """
    width = parameters.number("width", 0.0, robot.model.hand.widest_gap)
    force = parameters.number("force", 0.1, robot.model.hand.greatest_force)
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
    target, speed = _read_base_line(robot, parameters)
    z = robot.read_sensors().base_position[2]
    trajectory, way, ticks = _base_line(robot, robot.base_origin + robot.base_command, target, speed, z)
    return PreparedMotion(trajectory, _move_base(robot, target, way, ticks), _BASE)


def plan_base_lines(robot: Robot, lines: Sequence[ActionParameters]) -> list[PlannedMotion]:
    """Plan `move_base` actions one after the other, each from where the one before it ends.

    Args:
        robot: the robot; its arm rests.
        lines: the parameters of each.

    Returns:
        The trajectories; in place of the first that is refused, the reason, and none after it.
    """
    z, start = robot.read_sensors().base_position[2], robot.base_origin + robot.base_command
    plans: list[PlannedMotion] = []
    for parameters in lines:
        try:
            target, speed = _read_base_line(robot, parameters)
        except ActionRejectedError as refusal:
            return [*plans, MotionCompletion(False, str(refusal))]
        plans.append(_base_line(robot, start, target, speed, z)[0])
        start = target
    return plans


def _read_base_line(robot: Robot, parameters: ActionParameters) -> tuple[Vector, float]:
    """Return target (2,) in W, m, and peak speed of a base motion, m/s.

    Raises:
        ActionRejectedError: a parameter is missing, unknown or out of range, or the robot has no carriage.
    """
    x = parameters.number("x", -10.0, 10.0)
    y = parameters.number("y", -10.0, 10.0)
    speed = parameters.number("speed", 1e-3, 1.0)
    parameters.reject_unread()
    if not robot.has_carriage:
        raise ActionRejectedError("unknown kind: `move_base` on a robot without a carriage")
    return np.array([x, y]), speed


def _base_line(
    robot: Robot, start: Vector, target: Vector, speed: float, z: float
) -> tuple[Trajectory, Vector, int]:
    """Return a straight motion of the base, its displacement (2,), m, and its number of ticks."""
    way = target - start
    distance = float(np.linalg.norm(way))
    most = BASE_ACCELERATION_MAX * _BASE_LIMIT_SHARE
    slowest = ceil((ACCELERATION_TO_MEAN * distance / most) ** 0.5 / TICK)
    ticks = max(minimum_jerk_ticks(distance, speed * _BASE_LIMIT_SHARE), slowest, 1)
    at_rest = (tuple(robot.q_command.tolist()),) * 4
    px, py = start.tolist()
    travel = (float(way[0]), float(way[1]), 0.0)
    return Trajectory(robot.model.body, ((at_rest,),), (px, py, z), travel, ticks * TICK), way, ticks


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
