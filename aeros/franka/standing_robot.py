"""The robot as the planners of motions see it: a model that stands where the real arm is commanded.

The planners of the simulators plan for it, so a motion of the real arm has the same path and the same timing.
"""

from __future__ import annotations

import numpy as np

from aeros.franka.arm import ArmState
from aeros.runtime.ports import Vec3
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.robot import Robot, RobotOptions, RobotState
from aeros.spec.diagnostics.errors import MisuseError


class StandingRobot(Robot):
    """Robot for planning; it has no motors.

    Args:
        model: the robot.
        base: position of the arm's base in W, m.
    """

    def __init__(self, model: RobotModel, base: Vec3) -> None:
        super().__init__(RobotOptions(model, base=base))
        self._base = base

    def stand(self, state: ArmState) -> None:
        """Stand where the real arm is commanded.

        Args:
            state: its newest state.
        """
        self.q_command = np.array(state.q_d)

    def read_sensors(self) -> RobotState:
        """Implement `Robot.read_sensors` for the commanded position, at rest."""
        still = (0.0,) * self.model.joint_count
        position, _ = self.tool_command()
        x, y, z = (float(a) + b for a, b in zip(position, self._base, strict=True))
        q = tuple(self.q_command.tolist())
        return RobotState(q, still, still, (x, y, z), 0.0, 0.0, 0.0, self._base, (0.0, 0.0, 0.0))

    def command(self, q: Vector, qd: Vector) -> None:
        """Implement `Robot.command`: there is nothing to move."""
        raise MisuseError("a robot for planning has no motors")

    def command_base(self, xy: Vector, speed: Vector) -> None:
        """Implement `Robot.command_base`: there is nothing to move."""
        raise MisuseError("a robot for planning has no motors")

    def grip(self, width: float, force: float) -> None:
        """Implement `Robot.grip`: there is nothing to move."""
        raise MisuseError("a robot for planning has no motors")

    def finger_forces(self) -> tuple[float, float]:
        """Implement `Robot.finger_forces`: the hand measures none."""
        return 0.0, 0.0

    def contact_force(self) -> float:
        """Implement `Robot.contact_force`: nothing touches a robot for planning."""
        return 0.0

    def wrist_vertical_force(self) -> float:
        """Implement `Robot.wrist_vertical_force`: nothing touches a robot for planning."""
        return 0.0
