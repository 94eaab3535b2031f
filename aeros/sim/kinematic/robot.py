"""An arm whose joints are exactly at their set points."""

from __future__ import annotations

from math import hypot
from typing import Final

import numpy as np

from aeros.sim.clock import TICK
from aeros.sim.geometry import Pose, Vector3, add, yaw_orientation
from aeros.sim.kinematic.objects import ObjectSet
from aeros.sim.kinematic.tool_kinematics import tool_kinematics
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.robot import Robot, RobotOptions, RobotState

BLOCKING_FORCE: Final = 100.0
"""Force on what is under hand or load above which the arm no longer follows its set points, N."""


class KinematicRobot(Robot):
    """Robot that reaches its set points in the next tick; its fingers stop at an object between them.

    Joint torques (N·m) are Jᵀ·f, with the Jacobian J (m) and the force f (N) of the load at the tool. The
    robot's own weight and inertia are not modelled.

    Args:
        options: carriage, base position, initial posture and friction.
        objects: the objects that it can grip.
    """

    def __init__(self, options: RobotOptions, objects: ObjectSet) -> None:
        super().__init__(options)
        self._things = objects
        self._gap = self._width = self.model.hand.widest_gap
        # Greatest change of the gap between the fingers per tick, m.
        self._gap_step = 2.0 * self.model.hand.finger_speed * TICK
        self._force = 0.0
        self._finger_speed = 0.0
        self._posture = tool_kinematics(self.model, self.q_command.tolist())
        self._state = self._sense()

    def command(self, q: Vector, qd: Vector) -> None:
        """Implement `Robot.command`."""
        self.q_command, self.qd_command = q, qd

    def command_base(self, xy: Vector, speed: Vector) -> None:
        """Implement `Robot.command_base`."""
        self.base_command, self.base_speed_command = xy, speed

    def grip(self, width: float, force: float) -> None:
        """Implement `Robot.grip`: the fingers stop at what is between them."""
        self._width, self._force = width, force

    def followed_set_points(self) -> tuple[Vector, Vector]:
        """Implement `Robot.followed_set_points`: at rest where the hand is blocked.

        What the hand presses on does not yield.
        """
        rest = np.zeros(self.model.joint_count)
        return self.q_command, rest if self._things.load > BLOCKING_FORCE else self.qd_command

    def followed_base_set_points(self) -> tuple[Vector, Vector]:
        """Implement `Robot.followed_base_set_points`: nothing hinders the carriage."""
        return self.base_command, self.base_speed_command

    def tick(self) -> None:
        """Move arm and base to their set points, the fingers by one tick, and held objects along."""
        self._posture = tool_kinematics(self.model, self.q_command.tolist())
        tool = self._tool_pose()
        self._move_fingers(tool)
        self._things.tick(tool, self._gap)
        self._state = self._sense()

    def read_sensors(self) -> RobotState:
        """Implement `Robot.read_sensors`."""
        return self._state

    def finger_forces(self) -> tuple[float, float]:
        """Implement `Robot.finger_forces`: the commanded force if something is held, else 0."""
        force = self._force if self._things.is_holding else 0.0
        return force, force

    def contact_force(self) -> float:
        """Implement `Robot.contact_force`: of hand and load on what is under them, without weight."""
        return abs(self._things.load)

    def wrist_vertical_force(self) -> float:
        """Implement `Robot.wrist_vertical_force`: the force of hand and load, without weight."""
        return self._things.load

    def _move_fingers(self, tool: Pose) -> None:
        before = self._gap
        if self._width > self._gap:
            self._things.release()
            self._gap = min(self._width, self._gap + self._gap_step)
        elif not self._things.is_holding:
            self._gap = max(self._width, self._gap - self._gap_step)
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
