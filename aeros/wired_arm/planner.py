"""Plans of motions of the real arm: those of the simulators' planners, from where the arm is commanded.

So a motion of the real arm has the same path and the same timing as that of a simulated one.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import itemgetter
from typing import Final

import numpy as np

from aeros.kinematic_chain import position_unit
from aeros.runtime.ports import MotionCompletion, PlannedMotion, Trajectory, Vec3
from aeros.sim.robot.errors import ActionRejectedError
from aeros.sim.robot.limits import Vector
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.motions import (
    ActionParameters,
    plan_grip,
    plan_move_joints,
    plan_move_tool,
    plan_stop,
    plan_tool_lines,
    plan_wait,
)
from aeros.sim.robot.robot import Robot, RobotOptions, RobotState
from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from aeros.wired_arm.arm import MODES, REFLEX, ArmState

PLANNERS: Final = {
    "stop": plan_stop,
    "wait": plan_wait,
    "move_tool": plan_move_tool,
    "move_joints": plan_move_joints,
    "grip": plan_grip,
}
"""Planners of the actions that the plant can do."""

_READY_MODES: Final = frozenset((MODES.index("idle"), MODES.index("move")))


def mode_refusal(mode: int) -> str | None:
    """Say why a robot does not move in its mode.

    Args:
        mode: number of the mode in `MODES`.

    Returns:
        The reason; None if it moves.
    """
    if mode in _READY_MODES:
        return None
    if mode == REFLEX:
        return (
            "reflex: the robot has stopped by itself and does not move until a person has looked; then "
            "`python -m aeros.franka.recover` clears it"
        )
    return f"not ready: the robot's mode is {MODES[mode] if mode < len(MODES) else mode}"


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
        """Implement `Robot.command`.

        Raises:
            MisuseError: always: there is nothing to move.
        """
        raise MisuseError("a robot for planning has no motors")

    def command_base(self, xy: Vector, speed: Vector) -> None:
        """Implement `Robot.command_base`.

        Raises:
            MisuseError: always: there is nothing to move.
        """
        raise MisuseError("a robot for planning has no motors")

    def grip(self, width: float, force: float) -> None:
        """Implement `Robot.grip`.

        Raises:
            MisuseError: always: there is nothing to move.
        """
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


class MotionPlanner:
    """Planner for one robot.

    Attributes:
        body: the robot's body, as plans state it.

    Args:
        model: the robot.
        base: position of the arm's base in W, m.
        start_tolerance: greatest distance of a motion's start from the commanded joints, rad.
    """

    def __init__(self, model: RobotModel, base: Vec3, start_tolerance: float) -> None:
        self.body = model.body
        self._robot = StandingRobot(model, base)
        self._start_tolerance = start_tolerance

    def stand(self, state: ArmState) -> None:
        """Plan from now on from where the arm is commanded.

        Args:
            state: its newest state, in which it is not controlled.
        """
        self._robot.stand(state)

    def plan(self, action: Action, mode: int, *, has_hand: bool) -> PlannedMotion:
        """Plan an action.

        Args:
            action: the action, parameters in SI.
            mode: number of the robot's mode.
            has_hand: True if the hand is mounted.

        Returns:
            The motion, or the reason why the plant cannot do it.
        """
        refusal = mode_refusal(mode)
        planner = PLANNERS.get(action.kind)
        if refusal is None and planner is None:
            refusal = f"unknown kind: `{action.kind}`"
        elif refusal is None and action.kind == "grip" and not has_hand:
            refusal = "unknown kind: `grip` on an arm without a hand"
        if refusal is not None or planner is None:
            return MotionCompletion(False, refusal)
        try:
            return planner(self._robot, ActionParameters(action.parameters), None).plan
        except ActionRejectedError as rejection:
            return MotionCompletion(False, str(rejection))

    def plan_lines(self, actions: Sequence[Action]) -> Sequence[PlannedMotion]:
        """Plan `move_tool` actions one after the other.

        Args:
            actions: the actions.

        Returns:
            A plan for each, up to the first that cannot be made.
        """
        return plan_tool_lines(self._robot, [ActionParameters(action.parameters) for action in actions])

    def stale_refusal(self, plan: Trajectory) -> str | None:
        """Say why a motion cannot begin where the arm stands now.

        Args:
            plan: the motion.

        Returns:
            The reason; None if it begins there.
        """
        start = plan.joint_paths[0][0][0]
        ways = [abs(a - b) for a, b in zip(self._robot.q_command, start, strict=True)]
        away, row = max(zip(ways, plan.body.dh_rows, strict=True), key=itemgetter(0))
        if away <= self._start_tolerance:
            return None
        return f"stale: the plan starts {away:.4f} {position_unit(row)} from where the arm is commanded"
