"""A Panda that is exactly where its set points say, on the chain of its Denavit–Hartenberg parameters."""

from __future__ import annotations

from math import hypot
from typing import Final

import numpy as np

from aeros.sim.clock import TICK
from aeros.sim.geometry import Pose, Vector3, add, yaw_orientation
from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.robot.limits import FINGER_GAP_MAX, FINGER_SPEED, Vector
from aeros.sim.robot.robot import Robot, RobotOptions, RobotState

BLOCKING_FORCE: Final = 100.0
"""Force on what is under hand or load beyond which an arm no longer follows its set points, N."""

_MAX_GAP_STEP: Final = 2.0 * FINGER_SPEED * TICK
"""How far the gap between the fingers changes in a tick at most, m."""


class KinematicRobot(Robot):
    """Set points are reached in the tick after they are set; fingers stop at what is between them.

    Torques are those that hold the load at the tool, Jᵀ·f; weight and inertia are not modelled.
    """

    def __init__(self, options: RobotOptions, objects: ObjectSet) -> None:
        super().__init__(options)
        self._things = objects
        self._gap = self._width = FINGER_GAP_MAX
        self._force = 0.0
        self._finger_speed = 0.0
        self._posture = tool_kinematics(self.q_command.tolist())
        self._state = self._sense()

    def command(self, q: Vector, qd: Vector) -> None:
        """Set the arm's set points, rad and rad/s, for the next tick."""
        self.q_command, self.qd_command = q, qd

    def command_base(self, xy: Vector, speed: Vector) -> None:
        """Set the carriage's set points relative to its start, m and m/s, for the next tick."""
        self.base_command, self.base_speed_command = xy, speed

    def grip(self, width: float, force: float) -> None:
        """Move the fingers to a gap of `width` (m), or until something is between them."""
        self._width, self._force = width, force

    def followed_set_points(self) -> tuple[Vector, Vector]:
        """The set points, but at rest where the hand is blocked: what it presses on does not give way."""
        return self.q_command, np.zeros(7) if self._things.load > BLOCKING_FORCE else self.qd_command

    def followed_base_set_points(self) -> tuple[Vector, Vector]:
        """The set points: nothing hinders the carriage."""
        return self.base_command, self.base_speed_command

    def tick(self) -> None:
        """Be where the set points are, fingers one tick nearer to their width, and what is held with them."""
        self._posture = tool_kinematics(self.q_command.tolist())
        tool = self._tool_pose()
        self._move_fingers(tool)
        self._things.tick(tool, self._gap)
        self._state = self._sense()

    def read_sensors(self) -> RobotState:
        """Where the robot is, and how fast it moves."""
        return self._state

    def finger_forces(self) -> tuple[float, float]:
        """The force asked for, on both fingers, where something is between them, N."""
        force = self._force if self._things.is_holding else 0.0
        return force, force

    def contact_force(self) -> float:
        """The force with which hand and load press on what is under them, N; no weight."""
        return abs(self._things.load)

    def wrist_vertical_force(self) -> float:
        """The force with which hand and load press on what is under them, N; no weight."""
        return self._things.load

    def _move_fingers(self, tool: Pose) -> None:
        before = self._gap
        if self._width > self._gap:
            self._things.release()
            self._gap = min(self._width, self._gap + _MAX_GAP_STEP)
        elif not self._things.is_holding:
            self._gap = max(self._width, self._gap - _MAX_GAP_STEP)
            width = self._things.width_between(tool)
            if width is not None and self._gap <= width <= before:
                self._gap = width
                self._things.grip(tool)
        self._finger_speed = abs(self._gap - before) / 2.0 / TICK

    def _tool_pose(self) -> Pose:
        return Pose(self._in_world(self._posture.position), yaw_orientation(self._posture.yaw))

    def _in_world(self, place: Vector3) -> Vector3:
        x, y, z = self._base_start.tolist()
        dx, dy = self.base_command.tolist()
        return add(place, (x + dx, y + dy, z))

    def _sense(self) -> RobotState:
        rates, motion, load = self.qd_command.tolist(), self._posture.jacobian, self._things.load
        along, across = self.base_speed_command.tolist()
        drive = (along, across, 0.0)
        speed = (
            base + sum(rate * way[axis] for rate, way in zip(rates, motion, strict=True))
            for axis, base in enumerate(drive)
        )
        return RobotState(
            q=tuple(self.q_command.tolist()),
            qd=tuple(rates),
            torque=tuple(load * way[2] for way in motion),
            tool_position=self._in_world(self._posture.position),
            tool_speed=hypot(*speed),
            finger_gap=self._gap,
            finger_speed=self._finger_speed,
            base_position=self._in_world((0.0, 0.0, 0.0)),
            base_velocity=drive,
        )
