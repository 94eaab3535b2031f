"""A robot in a physics engine, as far as it is the same on each: commands, odometry and wearing parts."""

from __future__ import annotations

from abc import abstractmethod
from typing import Final

import numpy as np

from aeros.sim.clock import TICK
from aeros.sim.geometry import Vector3
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.odometry import WheelOdometry
from aeros.sim.robot.robot import Robot, RobotOptions

CARRIAGE_FORCE: Final = 600.0
"""Greatest drive force of the carriage, N: a 60 kg base at 3 m/s² plus the arm's reaction."""

CARRIAGE_CORRECTION: Final = 60.0
"""Greatest force by which the carriage's position controller corrects the modelled force, N, on each axis.
It bounds the push on an obstacle, below `collision_force` and every quasi-static limit."""


class PhysicalRobot(Robot):
    """A robot whose motors move it by forces.

    Its own sensors, and so its set points, count from where wheel odometry takes the base to be.

    Args:
        options: carriage, base position, initial posture and friction.
        odometry: of the carriage; without drift if None.

    Attributes:
        body: its number in the world.
        odometry: of the carriage.
        fingers: numbers of the finger links.
        grip_command: commanded gap, m, and force on each finger, N.
        finger_friction: Coulomb coefficient of undegraded finger pads.
        torque_limits: greatest torque of each arm motor, N·m; a fault may lower it.
    """

    body: int
    fingers: tuple[int, int]

    def __init__(self, options: RobotOptions, odometry: WheelOdometry | None = None) -> None:
        super().__init__(options)
        self.odometry = odometry or WheelOdometry(RandomSource(0))
        self.torque_limits: list[float] = self.model.limits.torque.tolist()
        x, y, z = self._base_start.tolist()
        self._stand: Vector3 = (x, y, z)
        self._driven: tuple[float, float] = (0.0, 0.0)
        self.grip_command = (self.model.hand.widest_gap, 10.0)
        self.finger_friction = options.finger_friction

    # Motors.

    @abstractmethod
    def _set_arm_points(self, q: Vector, qd: Vector, acceleration: Vector, strength: float) -> None:
        """Set the arm motors for the next tick."""

    @abstractmethod
    def _set_base_points(self, xy: Vector, speed: Vector, acceleration: Vector) -> None:
        """Set the carriage's motors for the next tick; `xy` is where it truly is to be."""

    @abstractmethod
    def set_finger_motors(self, width: float, force: float) -> None:
        """Set the finger motors without changing the commanded grip.

        Args:
            width: distance between the finger pads, m.
            force: greatest force on each finger, N.
        """

    @abstractmethod
    def set_finger_friction(self, friction: float) -> None:
        """Set the Coulomb coefficient of both finger pads.

        Args:
            friction: dimensionless.
        """

    def command(self, q: Vector, qd: Vector) -> None:
        """Implement `Robot.command`."""
        acceleration = (qd - self.qd_command) / TICK
        self.q_command, self.qd_command = q, qd
        self._set_arm_points(q, qd, acceleration, 1.0)

    def set_arm_motors(self, q: Vector, qd: Vector, strength: float = 1.0) -> None:
        """Set the arm motors for the next tick without changing the commanded set points.

        Args:
            q: joint positions, rad.
            qd: joint speeds, rad/s.
            strength: share of the motors' torque limits, in [0, 1].
        """
        self._set_arm_points(q, qd, np.zeros(self.model.joint_count), strength)

    def command_base(self, xy: Vector, speed: Vector) -> None:
        """Implement `Robot.command_base`."""
        acceleration = (speed - self.base_speed_command) / TICK
        self.base_command, self.base_speed_command = xy, speed
        self._set_base_points(xy - np.array(self.odometry.drift), speed, acceleration)

    def grip(self, width: float, force: float) -> None:
        """Implement `Robot.grip`."""
        self.grip_command = (width, force)
        self.set_finger_motors(width, force)

    # Sensors.

    def _odometry_position(self, drive: tuple[float, ...]) -> Vector3:
        """Return the position of the arm's base that odometry shows, from the way that the carriage drove."""
        if not drive:
            return self._stand
        x, y, z = self._stand
        off_x, off_y = self.odometry.drift
        return (x + drive[0] + off_x, y + drive[1] + off_y, z)

    def _count_wheels(self, x: float, y: float) -> None:
        """Let odometry count the way that the carriage drove since the last tick."""
        before, self._driven = self._driven, (x, y)
        self.odometry.drive(x - before[0], y - before[1])

    def true_points(self) -> tuple[Vector3, Vector3]:
        """Locate the robot, for scene and referee; no sensor of it measures this.

        Returns:
            Positions of the arm's base and of the tool point in W, m.
        """
        state = self.read_sensors()
        (bx, by, bz), (tx, ty, tz) = state.base_position, state.tool_position
        off_x, off_y = self.odometry.drift
        return (bx - off_x, by - off_y, bz), (tx - off_x, ty - off_y, tz)

    @abstractmethod
    def net_contact_force(self) -> float:
        """Sum the forces of all contacts with the robot, for a referee; no sensor of it measures this.

        Returns:
            The magnitude, N.
        """
