"""A Panda as motions see it: set points in, measured values out, whatever makes the one the other.

Frames: W the world, B the arm's base, T the tool centre point.
"""

# Frames live in names (p_WT, R_BT, J): house style (b).
# ruff: noqa: N806
from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import zip_longest
from math import hypot
from operator import sub
from typing import Final, NamedTuple

import numpy as np

from aeros.sim.clock import TICK
from aeros.sim.geometry import Vector3
from aeros.sim.robot.kinematics import READY_POSTURE, forward_kinematics
from aeros.sim.robot.limits import QDD_MAX, Vector

BASE_ACCELERATION_MAX: Final = 1.0
"""Greatest acceleration of the carriage, m/s²: the arm neither slips nor tips a real base of this mass."""

_STOP_SHARE: Final = 0.9
"""Share of the acceleration limits a protective stop uses."""

_MAX_JOINT_LAG: Final = 0.006
_MAX_RATE_LAG: Final = 0.05
"""Distance from its set point beyond which a joint is hindered, rad and rad/s (seen at most: 0.005, 0.02)."""

_BASE_LAG: Final = 0.005
_BASE_RATE_LAG: Final = 0.02
"""The same of the carriage, m and m/s (seen at most: 0.0018 and 0.0021)."""

BRAKED_PARTS: Final = frozenset(("arm", "base"))
"""What has to be brought to rest; the fingers keep their grip."""

HOLDING_FORCE: Final = 0.3
"""Force on both fingers above which something is held, N."""


@dataclass(frozen=True, slots=True)
class RobotOptions:
    """How a robot is built.

    carriage: stands on a carriage that drives along x and y of W, else fixed.
    base: where the arm's base frame B starts in W, m; z is its height for good.
    posture: joint positions at the start, rad.
    finger_friction: Coulomb coefficient of the finger pads.
    """

    carriage: bool = False
    base: Vector3 = (0.0, 0.0, 0.0)
    posture: tuple[float, ...] = tuple(float(q) for q in READY_POSTURE)
    finger_friction: float = 1.0


class RobotState(NamedTuple):
    """What the robot's own sensors read after a tick, SI, positions in W."""

    q: tuple[float, ...]
    qd: tuple[float, ...]
    torque: tuple[float, ...]
    tool_position: Vector3
    tool_speed: float
    finger_gap: float
    finger_speed: float
    base_position: Vector3
    base_velocity: Vector3


class Robot(ABC):
    """The robot.  `q_command` and `qd_command` are the set points its motors follow now."""

    def __init__(self, options: RobotOptions) -> None:
        self.has_carriage = options.carriage
        self._base_start = np.array(options.base)
        self.q_command: Vector = np.array(options.posture, dtype=np.float64)
        self.qd_command: Vector = np.zeros(7)
        self.base_command: Vector = np.zeros(2)
        self.base_speed_command: Vector = np.zeros(2)

    # Motors.

    @abstractmethod
    def command(self, q: Vector, qd: Vector) -> None:
        """Set the arm motors' set points, rad and rad/s, for the next tick."""

    @abstractmethod
    def command_base(self, xy: Vector, speed: Vector) -> None:
        """Set the carriage's set points relative to its start, m and m/s, for the next tick."""

    @abstractmethod
    def grip(self, width: float, force: float) -> None:
        """Drive the fingers to a gap of `width` (m) with at most `force` (N) on each."""

    def hold(self) -> None:
        """Keep the commanded position, at rest."""
        self.hold_arm()
        self.hold_base()

    def hold_arm(self) -> None:
        """Keep the arm's commanded position, at rest."""
        self.command(self.q_command, np.zeros(7))

    def hold_base(self) -> None:
        """Keep the carriage's commanded position, at rest."""
        if self.has_carriage:
            self.command_base(self.base_command, np.zeros(2))

    def yield_to_contact(self) -> None:
        """Take what is measured for set points: stop pushing against what holds arm or carriage."""
        state = self.read_sensors()
        self.q_command = np.array(state.q)
        self.base_command = np.array(state.base_position[:2]) - self.base_origin
        self.hold()

    def brake(self, parts: Collection[str] = BRAKED_PARTS) -> Iterator[None]:
        """Bring those of arm and carriage to rest, all joints together, one tick per item, then hold.

        Braking is even, as hard as keeps every joint inside its limit; see `_braking`.  What does
        not follow, as something is in its way, is braked from where it is, not torn to where it should be.
        """
        q, qd = self.followed_set_points()
        xy, speed = self.followed_base_set_points()
        arm_time = float((np.abs(qd) / (QDD_MAX * _STOP_SHARE)).max()) if "arm" in parts else 0.0
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

    def followed_set_points(self) -> tuple[Vector, Vector]:
        """Set points, but of joints that do not follow them those that they would follow.

        A joint that follows is a tick ahead: its motor is given a position and the speed there at once.
        """
        state = self.read_sensors()
        qd = np.array(state.qd)
        q = np.array(state.q) - qd * TICK
        is_off = (np.abs(q - self.q_command) > _MAX_JOINT_LAG) | (
            np.abs(qd - self.qd_command) > _MAX_RATE_LAG
        )
        return np.where(is_off, q, self.q_command), np.where(is_off, qd, self.qd_command)

    def followed_base_set_points(self) -> tuple[Vector, Vector]:
        """The same of the carriage, along x and y."""
        state = self.read_sensors()
        speed = np.array(state.base_velocity[:2])
        xy = np.array(state.base_position[:2]) - self.base_origin - speed * TICK
        is_off = (np.abs(xy - self.base_command) > _BASE_LAG) | (
            np.abs(speed - self.base_speed_command) > _BASE_RATE_LAG
        )
        return np.where(is_off, xy, self.base_command), np.where(is_off, speed, self.base_speed_command)

    # Sensors.

    @abstractmethod
    def read_sensors(self) -> RobotState:
        """Joint encoders and torques, and the tool's pose and speed, after the last tick."""

    @abstractmethod
    def finger_forces(self) -> tuple[float, float]:
        """Normal contact force on each finger, N: what tactile pads would read."""

    @abstractmethod
    def contact_force(self) -> float:
        """Amount of the force that everything it touches exerts on the robot in all, N.

        As estimated from joint torques: what the fingers grip takes no part in it but by its weight.
        """

    @abstractmethod
    def wrist_vertical_force(self) -> float:
        """Vertical force in W that the hand and what it touches exert on the wrist, N, up positive.

        Compare with a reading taken before contact: it may include the weight of hand and load.
        """

    @property
    def base_origin(self) -> Vector:
        """Where in W the carriage's set points count from: x and y, m."""
        return self._base_start[:2]

    def tool_command(self) -> tuple[Vector, float]:
        """The pose the arm is commanded to: tool position in B, m, and yaw, rad in (-π, π]."""
        p_BT, R_BT, _ = forward_kinematics(self.q_command[None, :])
        return p_BT[0], float(np.arctan2(R_BT[0, 1, 0], R_BT[0, 0, 0]))

    def tracking_error(self, state: RobotState) -> float:
        """Largest distance of a joint from its set point, rad."""
        wanted: list[float] = self.q_command.tolist()
        error: float = max(map(abs, map(sub, wanted, state.q)))
        return error

    def base_tracking_error(self, state: RobotState) -> float:
        """Distance of the carriage from its set point, m."""
        x, y = (self.base_origin + self.base_command).tolist()
        return hypot(state.base_position[0] - x, state.base_position[1] - y)

    def is_holding(self) -> bool:
        """Whether both fingers press on something."""
        return min(self.finger_forces()) > HOLDING_FORCE


def _braking(time: float) -> Iterator[tuple[float, float]]:
    """After each tick of braking for `time` (s): the share of the speed that is left, and the way over it, s.

    Brakes come on and off over a tick: motors that are told to brake at once do so by 15 % more at first.
    """
    even = int(np.ceil(time / TICK))
    left, way = 1.0, 0.0
    for tick in range(even + 1 if even else 0):
        before, left = left, left - (0.5 if tick in (0, even) else 1.0) / even
        way += (before + left) / 2.0 * TICK
        yield (left if tick < even else 0.0), way
