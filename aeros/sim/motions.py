"""What each action kind does, tick by tick.

Planning a motion refuses what cannot be done and moves nothing; the iterator it returns sets the
motors and yields once per tick.  Targets are in W; the tool points down.
"""

# Frames live in names (p_WT, R_BT, J): house style (b).
# ruff: noqa: N803, N806
from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, pi
from typing import Final

import numpy as np

from aeros.sim.kinematics import solve_one, track
from aeros.sim.limits import FINGER_GAP_MAX, GRIP_FORCE_MAX, QD_MAX, QDD_MAX, TOOL_SPEED_MAX, Vector
from aeros.sim.panda import BASE_ACCELERATION_MAX, Panda
from aeros.sim.parameters import Parameters, RefusedError
from aeros.sim.profile import TICK, UnreachableError, minimum_jerk, minimum_jerk_ticks, straight_profile
from aeros.sim.world import Triple

Motion = Iterator[None]

SETTLE_TICKS: Final = 60
"""Longest wait for the arm to come to rest after a profile, ticks (0.25 s)."""

REST_SPEED: Final = 0.01
"""Joint speed below which the arm rests, rad/s."""

ARRIVAL: Final = 0.01
"""Distance from the target beyond which a move did not arrive, m."""

_DESCENT: Final = 0.006
"""Speed of approach to a surface and greatest speed of force control, m/s."""

_DESCENT_CHANGE: Final = 0.5 * TICK
"""Greatest change of that speed per tick, m/s (0.5 m/s²)."""

_SERVO_GAIN: Final = 0.6
"""Share of the way to the servo target made per tick: smooth, and lags by about a tick."""

_FORCE_GAIN: Final = 0.0005
"""Integral force control: m/s of z per N of error."""

_FORCE_FILTER: Final = 0.3
"""Weight of a new reading of the wrist's force sensor per tick (14 Hz): it also feels the hand accelerate."""

_SEARCH: Final = 0.02
"""How far below its target a slide looks for the surface, m."""


class BlockedError(Exception):
    """The motion was under way and something holds the robot back; the message says where."""


def plan_stop(robot: Panda, parameters: Parameters) -> Motion:
    """`stop {}`: come to rest and hold."""
    parameters.done()
    return robot.stopping()


def plan_wait(robot: Panda, parameters: Parameters) -> Motion:
    """`wait {duration: s}`: hold for a while."""
    duration = parameters.number("duration", 0.0, 600.0)
    parameters.done()
    return _wait(robot, ceil(duration / TICK))


def _wait(robot: Panda, ticks: int) -> Motion:
    robot.hold()
    for _ in range(ticks):
        yield


def plan_move_tool(robot: Panda, parameters: Parameters) -> Motion:
    """`move_tool {target: m, yaw: rad, speed: m/s}`: along a straight line, peaking at `speed`."""
    p_WT = parameters.triple("target")
    yaw = parameters.number("yaw", -pi, pi)
    speed = parameters.number("speed", 1e-3, TOOL_SPEED_MAX)
    parameters.done()
    p_BT, yaw_now = robot.tool_command()
    yaw_now += 2.0 * pi * round((yaw - yaw_now) / (2.0 * pi))
    target = np.array(p_WT) - np.array(robot.sense().base_position)
    try:
        profile = straight_profile(robot.q_command, (p_BT, yaw_now), (target, yaw), speed)
    except UnreachableError as reason:
        raise RefusedError(f"unreachable: {reason}") from reason
    return _move_tool(robot, profile.q, profile.qd, p_WT)


def _move_tool(robot: Panda, q: Vector, qd: Vector, p_WT: Triple) -> Motion:
    for position, speed in zip(q, qd, strict=True):
        robot.command(position, speed)
        yield
    robot.hold()
    yield from settle(robot)
    _arrived(robot, p_WT)


def settle(robot: Panda) -> Motion:
    """Wait until the arm rests, at most `SETTLE_TICKS`."""
    for _ in range(SETTLE_TICKS):
        yield
        if max(map(abs, robot.sense().qd)) < REST_SPEED:
            return


def _arrived(robot: Panda, p_WT: Triple) -> None:
    miss = float(np.linalg.norm(np.array(robot.sense().tool_position) - np.array(p_WT)))
    if miss > ARRIVAL:
        raise BlockedError(f"blocked: the tool rests {1000 * miss:.0f} mm from its target")


def plan_grip(robot: Panda, parameters: Parameters) -> Motion:
    """`grip {width: m, force: N}`: move the fingers to `width`; ends when they rest."""
    width = parameters.number("width", 0.0, FINGER_GAP_MAX)
    force = parameters.number("force", 0.1, GRIP_FORCE_MAX)
    parameters.done()
    return _grip(robot, width, force)


def _grip(robot: Panda, width: float, force: float) -> Motion:
    robot.hold()
    robot.grip(width, force)
    still = 0
    for _ in range(480):
        yield
        still = still + 1 if robot.sense().finger_speed < 1e-3 else 0
        if still >= 24:
            return
    raise BlockedError("blocked: the fingers do not come to rest")


def plan_slide(robot: Panda, parameters: Parameters) -> Motion:
    """`slide {target: m, force: N, speed: m/s}`: along x and y, pressing down with `force`.

    First descends until the wrist feels half the force, at most 20 mm below the target's z, then
    moves while integral control on z holds the force, at least half a second.  The descent is slow
    (6 mm/s, so that contact peaks near 10 N): start it close to the surface.
    """
    p_WT = parameters.triple("target")
    force = parameters.number("force", 0.5, 60.0)
    speed = parameters.number("speed", 1e-3, 0.5)
    parameters.done()
    p_BT, yaw = robot.tool_command()
    base = np.array(robot.sense().base_position)
    target = np.array(p_WT) - base
    lowest = target - np.array([0.0, 0.0, _SEARCH])
    if solve_one(lowest, yaw, robot.q_command) is None:
        raise RefusedError("unreachable: the surface is outside the arm's reach")
    above = np.array([target[0], target[1], p_BT[2]])
    try:
        ticks = len(straight_profile(robot.q_command, (p_BT, yaw), (above, yaw), speed).q)
    except UnreachableError as reason:
        raise RefusedError(f"unreachable: {reason}") from reason
    return _slide(robot, target, force, max(ticks, 120), float(lowest[2]))


def _slide(robot: Panda, target: Vector, force: float, ticks: int, lowest: float) -> Motion:
    robot.hold()
    yield from settle(robot)
    tare = robot.wrist_load()
    start, yaw = robot.tool_command()
    p_BT = start.copy()
    pressed = pace = 0.0
    while pressed < force / 2.0:
        pace = min(_DESCENT, pace + _DESCENT_CHANGE)
        p_BT[2] -= pace * TICK
        if p_BT[2] < lowest:
            raise BlockedError("no contact: the surface is not where the target says")
        _follow(robot, p_BT, yaw)
        yield
        pressed += _FORCE_FILTER * (robot.wrist_load() - tare - pressed)
    share, _, _ = minimum_jerk(np.arange(1, ticks + 1) / ticks)
    for part in share:
        pressed += _FORCE_FILTER * (robot.wrist_load() - tare - pressed)
        wanted = min(_DESCENT, max(-_DESCENT, _FORCE_GAIN * (force - pressed)))
        pace = min(pace + _DESCENT_CHANGE, max(pace - _DESCENT_CHANGE, wanted))
        p_BT[2] -= pace * TICK
        if p_BT[2] < lowest:
            raise BlockedError("no contact: the surface fell away")
        p_BT[:2] = start[:2] + part * (target[:2] - start[:2])
        _follow(robot, p_BT, yaw)
        yield
    robot.hold()
    yield from settle(robot)


def _follow(robot: Panda, p_BT: Vector, yaw: float) -> None:
    """One tick of servoing, at most half of any joint's speed and acceleration limit."""
    rate = _SERVO_GAIN * (track(p_BT, yaw, robot.q_command) - robot.q_command) / TICK
    rate = np.clip(rate, -QD_MAX / 2.0, QD_MAX / 2.0)
    change = QDD_MAX * TICK / 2.0
    rate = np.clip(rate, robot.qd_command - change, robot.qd_command + change)
    robot.command(robot.q_command + rate * TICK, rate)


def plan_move_base(robot: Panda, parameters: Parameters) -> Motion:
    """`move_base {x: m, y: m, speed: m/s}`: drive the carriage along a straight line, arm at rest."""
    x = parameters.number("x", -10.0, 10.0)
    y = parameters.number("y", -10.0, 10.0)
    speed = parameters.number("speed", 1e-3, 1.0)
    parameters.done()
    if not robot.has_carriage:
        raise RefusedError("unknown kind: `move_base` on a robot without a carriage")
    return _move_base(robot, np.array([x, y]), speed)


def _move_base(robot: Panda, target: Vector, speed: float) -> Motion:
    start = robot.base_command
    way = target - robot.base_origin - start
    distance = float(np.linalg.norm(way))
    # The profile's peak acceleration is 5.774 · distance / T² (at u = 0.211).
    slowest = ceil((5.774 * distance / BASE_ACCELERATION_MAX) ** 0.5 / TICK)
    ticks = max(minimum_jerk_ticks(distance, speed), slowest, 1)
    share, rate, _ = minimum_jerk(np.arange(1, ticks + 1) / ticks)
    robot.hold()
    for part, pace in zip(share, rate / (ticks * TICK), strict=True):
        robot.command_base(start + part * way, pace * way)
        yield
    robot.hold()
    yield from _wait(robot, SETTLE_TICKS)
    at = np.array(robot.sense().base_position[:2])
    miss = float(np.linalg.norm(at - target))
    if miss > ARRIVAL:
        raise BlockedError(f"blocked: the base rests {1000 * miss:.0f} mm from its target")


PLANNERS: Final[dict[str, Callable[[Panda, Parameters], Motion]]] = {
    "stop": plan_stop,
    "wait": plan_wait,
    "move_tool": plan_move_tool,
    "grip": plan_grip,
    "slide": plan_slide,
    "move_base": plan_move_base,
}
"""Motion planners by action kind; `look` moves nothing and is the plant's own."""
