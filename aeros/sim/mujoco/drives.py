"""Motors of arm, carriage and fingers in a `MujocoWorld`, and what they show of forces from outside.

Of arm and carriage each motor gives a modelled effort, M(q)·q̈ + c(q, q̇) + friction, of the measured posture
and the commanded acceleration, and a servo corrects it within bounds: joints that an obstacle holds back are
not pushed on by the model. External torques are found as on PyBullet, r ← r + α·(τ_ext − r), τ_ext =
M(q)·q̈ + c(q, q̇) − τ, α = 1 − exp(−K·T); τ is the torque on the link's side of a joint, where
torque sensors measure it: its motor's without friction. Source: S. Haddadin, A. De Luca, A. Albu-Schäffer,
Robot Collisions, IEEE Transactions on Robotics 33 (2017), section IV.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp
from typing import Final

import numpy as np

from aeros.sim.clock import TICK
from aeros.sim.engine.robot import CARRIAGE_CORRECTION, CARRIAGE_FORCE
from aeros.sim.mujoco.client import mujoco
from aeros.sim.mujoco.model import SUBSTEPS
from aeros.sim.mujoco.world import MujocoWorld
from aeros.sim.pictures.solids import Array
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel

_BASE_STIFFNESS: Final = 40000.0
_BASE_DAMPING: Final = 4000.0
"""Gains of the carriage's servos, N/m and N·s/m: critical for 100 kg; chosen."""

_FINGER_STIFFNESS: Final = 5000.0
_FINGER_DAMPING: Final = 50.0
"""Gains of the fingers' servos, N/m and N·s/m; chosen: 10 N are reached 2 mm behind the set point."""

_OBSERVER_SHARE: Final = 1.0 - exp(-300.0 * TICK)
"""α for K = 300 1/s, as on PyBullet."""


class MujocoDrives:
    """The motors of a robot, whose joints are the first ones of its world.

    Args:
        world: the world.
        body: number of the robot.
        model: the robot as data.
        joints: numbers of the joints of carriage and arm, in the order of the model.
        fingers: numbers of the joints of the fingers, which come next.
        limits: greatest torque of each motor of the arm, N·m; read at each tick.

    Attributes:
        efforts: mean efforts of the motors of all joints in the last tick, N·m or N.
        external: external torques of all joints, N·m, or forces, N.
        positions: of all joints after the last tick, rad or m.
        rates: of all joints after the last tick, rad/s or m/s.
    """

    def __init__(
        self,
        world: MujocoWorld,
        body: int,
        model: RobotModel,
        joints: Sequence[int],
        fingers: Sequence[int],
        limits: Sequence[float],
    ) -> None:
        self._world = world
        self._limits = limits
        drives = len(joints) - model.joint_count
        self._arm = slice(drives, len(joints))
        self._base = slice(0, drives)
        self._moved = slice(0, len(joints))
        self._count = len(joints) + len(fingers)
        count = self._count
        servos = model.servos
        self._finger_step = model.hand.finger_speed * TICK
        self._stiffness = np.array(
            [_BASE_STIFFNESS] * drives + list(servos.stiffness) + [_FINGER_STIFFNESS] * 2
        )
        self._damping = np.array([_BASE_DAMPING] * drives + list(servos.damping) + [_FINGER_DAMPING] * 2)
        for joint, stiffness, damping in zip(
            (*joints, *fingers), self._stiffness.tolist(), self._damping.tolist(), strict=True
        ):
            world.bodies.add_servo(body, joint, stiffness, damping)
        self._most = np.array([CARRIAGE_FORCE] * drives + list(limits))
        self._correction = np.array([CARRIAGE_CORRECTION] * drives + list(servos.correction))
        self._strength = 1.0
        # Set points at the end of the tick, and speeds at its beginning.
        self._points, self._speeds, self._accelerations = np.zeros(count), np.zeros(count), np.zeros(count)
        self._modelled = np.zeros(len(joints))
        self._given, self._friction = np.zeros(count), np.zeros(count)
        self._bias, self._before, self._step_start = np.zeros(count), np.zeros(count), np.zeros(count)
        self._gap, self._gap_goal, self._force = 0.0, 0.0, 0.0
        self._external = np.zeros(count)
        self.efforts: tuple[float, ...] = (0.0,) * count
        self.external: tuple[float, ...] = (0.0,) * count
        self.positions: tuple[float, ...] = (0.0,) * count
        self.rates: tuple[float, ...] = (0.0,) * count
        world.before_step.append(self._set_motors)
        world.before_substep.append(self._lead)
        world.after_substep.append(self._record)
        world.after_step.append(self._observe)

    def note_positions(self) -> None:
        """Read the positions and speeds of all joints."""
        data = self._world.bodies.built().data
        self.positions = tuple(data.qpos[: self._count].tolist())
        self.rates = tuple(data.qvel[: self._count].tolist())

    def set_arm(self, q: Vector, qd: Vector, acceleration: Vector, strength: float) -> None:
        """Take set points of the arm for the next tick.

        Args:
            q: joint positions, rad.
            qd: joint speeds, rad/s.
            acceleration: joint accelerations, rad/s²; for the next tick alone.
            strength: share of the motors' torque limits, in [0, 1].
        """
        self._points[self._arm], self._speeds[self._arm] = q, qd
        self._accelerations[self._arm] = acceleration
        self._strength = strength

    def set_base(self, xy: Vector, speed: Vector, acceleration: Vector) -> None:
        """Take set points of the carriage for the next tick.

        Args:
            xy: position (2,) relative to its start, m.
            speed: velocity (2,), m/s.
            acceleration: (2,), m/s²; for the next tick alone.
        """
        self._points[self._base], self._speeds[self._base] = xy, speed
        self._accelerations[self._base] = acceleration

    def set_fingers(self, width: float, force: float) -> None:
        """Take the goal of the fingers; they begin where they are.

        Args:
            width: distance between the finger pads, m.
            force: greatest force on each finger, N.
        """
        if width != self._gap_goal:
            self._gap = (self.positions[-2] + self.positions[-1]) / 2.0
        self._gap_goal, self._force = width, force

    def _set_motors(self) -> None:
        """Set modelled efforts and bounds of the servos for one tick."""
        model, data, *_ = self._world.bodies.built()
        count, moved = self._count, self._moved
        mujoco.mj_makeM(model, data)
        mujoco.mj_comVel(model, data)
        bias = np.zeros(model.nv)
        mujoco.mj_rne(model, data, 0, bias)
        self._bias, self._before = bias[:count].copy(), data.qvel[:count].copy()
        wanted = np.zeros(model.nv)
        wanted[:count] = self._accelerations
        needed = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, needed, wanted)
        speeds = self._speeds[moved]
        friction = model.dof_damping[moved] * speeds
        limits = self._most.copy()
        limits[self._arm] = np.array(self._limits) * self._strength
        self._modelled = np.maximum(-limits, np.minimum(limits, needed[moved] + bias[moved] + friction))
        greatest = np.minimum(self._correction, limits - np.abs(self._modelled))
        data.qfrc_applied[moved] = self._modelled
        model.actuator_forcerange[moved, 0], model.actuator_forcerange[moved, 1] = -greatest, greatest
        model.actuator_forcerange[count - 2 : count] = (-self._force, self._force)
        goal, step = self._gap_goal / 2.0, self._finger_step
        before, self._gap = self._gap, min(self._gap + step, max(self._gap - step, goal))
        self._points[-2:], self._speeds[-2:] = self._gap, (self._gap - before) / TICK
        self._given[:], self._friction[:] = 0.0, 0.0

    def _lead(self, share: float) -> None:
        """Set the servos' set points at the end of a step, on the way to those at the end of the tick."""
        left = (1.0 - share) * TICK
        speeds = self._speeds - self._accelerations * left
        points = self._points - (self._speeds + speeds) / 2.0 * left
        data = self._world.bodies.built().data
        data.ctrl[: self._count] = points + self._damping / self._stiffness * speeds
        self._step_start = data.qvel[: self._count].copy()

    def _record(self) -> None:
        """Add up what motors gave and friction took in a step."""
        model, data, *_ = self._world.bodies.built()
        count = self._count
        # Implicit integration takes forces at the speed at the end of a step, except of clamped servos.
        faster = data.qvel[:count] - self._step_start
        given = data.actuator_force[:count]
        is_free = np.abs(given) < model.actuator_forcerange[:count, 1]
        self._given += given - np.where(is_free, self._damping, 0.0) * faster
        self._friction += data.qfrc_damper[:count] - model.dof_damping[:count] * faster
        rows = slice(data.ne, data.ne + data.nf)
        joints = data.efc_id[rows]
        own = joints < count
        self._friction[joints[own]] += data.efc_force[rows][own]

    def _observe(self) -> None:
        """Update efforts and external torques after a tick."""
        model, data, *_ = self._world.bodies.built()
        count = self._count
        given, friction = self._given / SUBSTEPS, self._friction / SUBSTEPS
        given[self._moved] += self._modelled
        changes, needed = np.zeros(model.nv), np.zeros(model.nv)
        changes[:count] = (data.qvel[:count] - self._before) / TICK
        mujoco.mj_mulM(model, data, needed, changes)
        outside: Array = needed[:count] + self._bias - given - friction
        self._external += _OBSERVER_SHARE * (outside - self._external)
        self.efforts, self.external = tuple(given.tolist()), tuple(self._external.tolist())
        self.note_positions()
        self._accelerations[:] = 0.0
