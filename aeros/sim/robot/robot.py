"""The robot as motions use it: set points in, measured values out; simulators implement it.

Frames: W the world, B the arm's base, T the tool centre point.
"""

# Frames live in names (p_WT, R_BT, J): house style (b).
# ruff: noqa: N806
from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import zip_longest
from math import cos, sin, sqrt
from operator import sub
from typing import Final, NamedTuple

import numpy as np

from aeros.kinematic_chain import Mounting, Triple
from aeros.sim.clock import TICK
from aeros.sim.geometry import Vector3
from aeros.sim.robot.kinematics import forward_kinematics
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel

CARRIAGE_EDGES: Final = (0.5, 0.45, 0.28)
"""Length, width and height of the carriage, m: its top is as high as the arm's base, and its wheels 20 mm."""

BASE_ACCELERATION_MAX: Final = 1.0
"""Greatest acceleration of the carriage, m/s²: the arm neither slips nor tips a real base of this mass."""

_STOP_SHARE: Final = 0.9
"""Share of the acceleration limits a protective stop uses."""

_MAX_JOINT_LAG: Final = 0.006
_MAX_RATE_LAG: Final = 0.05
"""Tracking errors above which a joint is hindered, rad and rad/s (seen at most: 0.005, 0.02), or m and
m/s."""

_BASE_LAG: Final = 0.005
_BASE_RATE_LAG: Final = 0.02
"""Tracking errors above which the carriage is hindered, m and m/s (seen at most: 0.0018 and 0.0021)."""

_RETRACE_ACCELERATION: Final = 1.0
"""Acceleration of backing off, rad/s² or m/s²."""

SETTLE_TICKS: Final = 60
"""Longest wait for the arm to come to rest after a profile, ticks (0.25 s)."""

_REST_SPEED: Final = 0.01
"""Joint speed below which the arm rests, rad/s or m/s."""

_STANDING_SPEED: Final = 0.005
"""Speed of a carriage that counts as standing, m/s: it rests within a tick or two."""

BRAKED_PARTS: Final = frozenset(("arm", "base"))
"""Parts that a stop brings to rest; the fingers keep their grip."""

HOLDING_FORCE: Final = 2.0
"""Force of both finger motors above which something is held, N: to start and stop a finger takes 1.6 N."""


@dataclass(frozen=True, slots=True)
class RobotOptions:
    """Options to build a robot with.

    Attributes:
        model: the robot.
        carriage: True if it stands on a carriage that drives along x and y of W, else it is fixed.
        base: position of the arm's base frame B in W at the start, m; z never changes.
        posture: joint positions at the start, rad; the robot's ready posture if empty.
        finger_friction: Coulomb coefficient of the finger pads.
    """

    model: RobotModel
    carriage: bool = False
    base: Vector3 = (0.0, 0.0, 0.0)
    posture: tuple[float, ...] = ()
    finger_friction: float = 1.0


class RobotState(NamedTuple):
    """Readings of the robot's own sensors after a tick, SI, positions in W.

    Attributes:
        q: joint positions, rad; of prismatic joints m, as all that follows.
        qd: joint speeds, rad/s.
        torque: joint torques, N·m; of prismatic joints forces, N.
        tool_position: of the tool centre point, m.
        tool_speed: of the tool centre point, m/s.
        finger_gap: distance between the finger pads, m.
        finger_speed: of the faster finger, m/s.
        base_position: of the arm's base, m.
        base_velocity: of the arm's base, m/s.
    """

    q: tuple[float, ...]
    qd: tuple[float, ...]
    torque: tuple[float, ...]
    tool_position: Vector3
    tool_speed: float
    finger_gap: float
    finger_speed: float
    base_position: Vector3
    base_velocity: Vector3


class RobotSensors(ABC):
    """Sensors of the robot, without noise and latency: `aeros.sim.sensors` adds these."""

    @abstractmethod
    def read_sensors(self) -> RobotState:
        """Read joint encoders and torques, and the tool's pose and speed, after the last tick.

        Returns:
            The readings, without noise.
        """

    @abstractmethod
    def finger_forces(self) -> tuple[float, float]:
        """Read the force with which each finger closes on something, as motor currents show it.

        Returns:
            Left and right force, N; 0 of a finger that opens.
        """

    @abstractmethod
    def contact_force(self) -> float:
        """Estimate the net force that everything in contact exerts on the robot, from its motors.

        A gripped object counts only by its weight.

        Returns:
            The magnitude, N.
        """

    @abstractmethod
    def wrist_vertical_force(self) -> float:
        """Read the vertical force in W that the hand and what it touches exert on the wrist.

        It may include the weight of hand and load: compare with a reading from before contact.

        Returns:
            The force, N, up positive.
        """


class Robot(RobotSensors):
    """An arm with a hand, on a carriage or fixed.

    Attributes:
        model: the robot as data.
        has_carriage: True if it can drive.
        q_command: set points that the arm motors follow now, rad.
        qd_command: their speeds, rad/s.
        base_command: set points of the carriage (2,), relative to its start, m.
        base_speed_command: their speeds (2,), m/s.
    """

    def __init__(self, options: RobotOptions) -> None:
        self.model = options.model
        self.has_carriage = options.carriage
        self._base_start = np.array(options.base)
        self.q_command: Vector = np.array(options.posture or self.model.postures.ready, dtype=np.float64)
        self.qd_command: Vector = np.zeros(self.model.joint_count)
        self.base_command: Vector = np.zeros(2)
        self.base_speed_command: Vector = np.zeros(2)

    # Motors.

    @abstractmethod
    def command(self, q: Vector, qd: Vector) -> None:
        """Set the arm motors' set points for the next tick.

        Args:
            q: joint positions, rad.
            qd: joint speeds, rad/s.
        """

    @abstractmethod
    def command_base(self, xy: Vector, speed: Vector) -> None:
        """Set the carriage's set points for the next tick.

        Args:
            xy: position (2,) relative to its start, along x and y of W, m.
            speed: velocity (2,), m/s.
        """

    @abstractmethod
    def grip(self, width: float, force: float) -> None:
        """Drive the fingers to a gap.

        Args:
            width: distance between the finger pads, m.
            force: greatest force on each finger, N.
        """

    def hold(self) -> None:
        """Hold the commanded positions of arm and carriage, at rest."""
        self.hold_arm()
        self.hold_base()

    def hold_arm(self) -> None:
        """Hold the arm's commanded position, at rest."""
        self.command(self.q_command, np.zeros(self.model.joint_count))

    def hold_base(self) -> None:
        """Hold the carriage's commanded position, at rest."""
        if self.has_carriage:
            self.command_base(self.base_command, np.zeros(2))

    def yield_to_contact(self) -> None:
        """Make the measured positions the set points: stop pushing against an obstacle."""
        state = self.read_sensors()
        self.q_command = np.array(state.q)
        self.base_command = np.array(state.base_position[:2]) - self.base_origin
        self.hold()

    def brake(self, parts: Collection[str] = BRAKED_PARTS) -> Iterator[None]:
        """Bring arm or carriage to rest, all joints together, then hold.

        Braking is even, as hard as keeps every joint inside its limit; see `_braking`. A joint that an
        obstacle keeps from following is braked from its measured position, not pulled back to its set
        point.

        Args:
            parts: of `arm` and `base`, those to brake.

        Yields:
            Once per tick.
        """
        q, qd = self.followed_set_points()
        xy, speed = self.followed_base_set_points()
        if "arm" in parts:
            self.q_command, self.qd_command = q, qd
        arm_time = (
            float((np.abs(qd) / (self.model.limits.acceleration * _STOP_SHARE)).max())
            if "arm" in parts
            else 0.0
        )
        base_time = float(np.linalg.norm(speed)) / BASE_ACCELERATION_MAX if "base" in parts else 0.0
        for arm, base in zip_longest(_braking(arm_time), _braking(base_time)):
            if arm is not None:
                self.command(q + qd * arm[1], qd * arm[0])
            if self.has_carriage and base is not None:
                self.command_base(xy + speed * base[1], speed * base[0])
            yield
        if "arm" in parts:
            self.hold_arm()
        if "base" in parts:
            self.hold_base()

    def retrace(self, way: Iterable[RobotState], speed: float) -> Iterator[None]:
        """Move back along states that the robot has passed, from rest, then hold.

        The set points follow the measured postures of the way, so the links stay where they have been. The
        speed rises evenly to `speed`.

        Args:
            way: states in the order in which to pass them, the latest first.
            speed: of the fastest joint, rad/s, or of the base, m/s, whichever is reached first.

        Yields:
            Once per tick.
        """
        corners = [
            np.array([*state.q, *(np.array(state.base_position[:2]) - self.base_origin)]) for state in way
        ]
        at = np.concatenate([self.q_command, self.base_command])
        pace, joints = 0.0, self.model.joint_count
        for corner in corners:
            while True:
                distance = float(np.abs(corner - at).max())
                faster = min(speed, pace + _RETRACE_ACCELERATION * TICK)
                if distance < faster * TICK:
                    break  # near enough: on to the next
                pace = faster
                rate = (corner - at) * (pace / distance)
                at = at + rate * TICK
                self.command(at[:joints], rate[:joints])
                if self.has_carriage:
                    self.command_base(at[joints:], rate[joints:])
                yield
        self.hold()

    def settle(self) -> Iterator[None]:
        """Wait until the arm rests: all joints below `_REST_SPEED`, or `SETTLE_TICKS` have passed.

        Yields:
            Once per tick.
        """
        for _ in range(SETTLE_TICKS):
            yield
            if max(map(abs, self.read_sensors().qd)) < _REST_SPEED:
                return

    def followed_set_points(self) -> tuple[Vector, Vector]:
        """Return the arm's set points; for joints that do not follow them, those that they would follow.

        A joint that follows is a tick ahead: its motor gets a position and the speed there at once.

        Returns:
            Joint positions, rad, and speeds, rad/s.
        """
        state = self.read_sensors()
        qd = np.array(state.qd)
        q = np.array(state.q) - qd * TICK
        is_off = (np.abs(q - self.q_command) > _MAX_JOINT_LAG) | (
            np.abs(qd - self.qd_command) > _MAX_RATE_LAG
        )
        return np.where(is_off, q, self.q_command), np.where(is_off, qd, self.qd_command)

    def followed_base_set_points(self) -> tuple[Vector, Vector]:
        """Return the carriage's set points; for an axis that does not follow, those that it would follow.

        Returns:
            Position (2,) relative to the carriage's start, m, and velocity (2,), m/s.
        """
        state = self.read_sensors()
        speed = np.array(state.base_velocity[:2])
        xy = np.array(state.base_position[:2]) - self.base_origin - speed * TICK
        is_off = (np.abs(xy - self.base_command) > _BASE_LAG) | (
            np.abs(speed - self.base_speed_command) > _BASE_RATE_LAG
        )
        return np.where(is_off, xy, self.base_command), np.where(is_off, speed, self.base_speed_command)

    # Sensors.

    @property
    def base_origin(self) -> Vector:
        """Position in W that the carriage's set points count from: x and y (2,), m."""
        return self._base_start[:2]

    def tool_command(self) -> tuple[Vector, float]:
        """Compute the tool pose that the arm is commanded to.

        Returns:
            Tool position (3,) in B, m, and yaw, rad in (-π, π].
        """
        p_BT, R_BT, _ = forward_kinematics(self.model, self.q_command[None, :])
        return p_BT[0], float(np.arctan2(R_BT[0, 1, 0], R_BT[0, 0, 0]))

    def tracking_distance(self, state: RobotState) -> float:
        """Compute the greatest distance of any link from where it is commanded, to first order.

        The displacement by small joint errors is that of a motion at these rates for one second.

        Args:
            state: the latest readings.

        Returns:
            The distance, m, of joints and base together.
        """
        errors = tuple(map(sub, self.q_command.tolist(), state.q))
        return max_link_speed(self.model, state.q, errors, self.base_tracking_error(state))

    def base_tracking_error(self, state: RobotState) -> Triple:
        """Compute the way of the carriage to its set point.

        Args:
            state: the latest readings.

        Returns:
            The displacement in W, m; 0 for a robot that is fixed.
        """
        if not self.has_carriage:
            return (0.0, 0.0, 0.0)
        x, y = (self.base_origin + self.base_command).tolist()
        return (x - state.base_position[0], y - state.base_position[1], 0.0)

    def is_holding(self) -> bool:
        """Compare the finger motors' forces with `HOLDING_FORCE`.

        Returns:
            True if both fingers press on something.
        """
        return min(self.finger_forces()) > HOLDING_FORCE


def _braking(time: float) -> Iterator[tuple[float, float]]:
    """Yield, after each tick of braking for `time` s, the share of the speed left and the way over speed, s.

    Brakes come on and off over a tick: motors that must brake at once overshoot by 15 % at first.
    """
    even = int(np.ceil(time / TICK))
    left, way = 1.0, 0.0
    for tick in range(even + 1 if even else 0):
        before, left = left, left - (0.5 if tick in (0, even) else 1.0) / even
        way += (before + left) / 2.0 * TICK
        yield (left if tick < even else 0.0), way


@cache
def _followed_chain(arm: RobotModel) -> tuple[tuple[Mounting, tuple[Triple, ...]], ...]:
    """Return for each joint its `Mounting` and the points that it carries, in its frame, m."""
    followed = (
        (
            *(end for capsule in arm.capsules if capsule.joint == joint for end in (capsule.a, capsule.b)),
            *((arm.body.tool_offset,) if joint == arm.joint_count else ()),
        )
        for joint in range(1, arm.joint_count + 1)
    )
    return tuple(
        (mounting, tuple(dict.fromkeys(points)))
        for mounting, points in zip(arm.mountings, followed, strict=True)
    )


def max_link_speed(arm: RobotModel, q: Sequence[float], rates: Sequence[float], base: Triple) -> float:
    """Compute the speed in W of the fastest link.

    Of each link it follows both ends of its capsule's axis, and of the hand also the tool point. A link is
    rigid, so no point of those axes is faster. Not counted: rotation of a link about its own axis.
    Velocities go up the chain in each link's own frame, where its points stay: v = v₋₁ + ω₋₁ × p, ω = ω₋₁ +
    z·q̇, both rotated; of a prismatic joint v = v₋₁ + ω₋₁ × p + z·q̇ and ω = ω₋₁.

    Args:
        arm: the robot.
        q: joint positions, rad.
        rates: joint speeds, rad/s.
        base: velocity of the arm's base in W, m/s; the base does not rotate.

    Returns:
        The speed, m/s.
    """
    if not any(rates) and not any(base):
        return 0.0
    vx, vy, vz = base
    wx = wy = wz = 0.0
    fastest = vx * vx + vy * vy + vz * vz
    for (mounting, points), position, rate in zip(_followed_chain(arm), q, rates, strict=True):
        x, y, z, ca, sa, zero, slides = mounting
        if slides:
            y, z = y - sa * position, z + ca * position
        vx, vy, vz = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x
        vy, vz = ca * vy + sa * vz, ca * vz - sa * vy
        wy, wz = ca * wy + sa * wz, ca * wz - sa * wy
        turn = zero if slides else position + zero
        c, s = cos(turn), sin(turn)
        vx, vy = c * vx + s * vy, c * vy - s * vx
        wx, wy = c * wx + s * wy, c * wy - s * wx
        if slides:
            vz += rate
        else:
            wz += rate
        for px, py, pz in points:
            ux, uy, uz = vx + wy * pz - wz * py, vy + wz * px - wx * pz, vz + wx * py - wy * px
            square = ux * ux + uy * uy + uz * uz
            if square > fastest:
                fastest = square
    return sqrt(fastest)


def braking_link_speed(arm: RobotModel, q: Sequence[float], rates: Sequence[float], base: Triple) -> float:
    """Bound the speed in W of the fastest link, now and while arm and carriage brake.

    A link moves at v = a + b, of arm and carriage. Both brake evenly, but not equally long, so that v(t) =
    α·a + β·b with α and β between 0 and 1. The norm is convex, so its maximum is at |a + b|, |a| or |b|: the
    arm may have cancelled the carriage's speed, or the other way round. Not counted: that the arm's posture
    changes while it brakes, by 0.01 rad at the speeds that are allowed near people.

    Args:
        arm: the robot.
        q: joint positions, rad.
        rates: joint speeds, rad/s.
        base: velocity of the arm's base in W, m/s.

    Returns:
        The speed, m/s.
    """
    fastest = max_link_speed(arm, q, rates, base)
    if max(map(abs, base)) < _STANDING_SPEED:
        return fastest
    return max(fastest, max_link_speed(arm, q, rates, (0.0, 0.0, 0.0)))
