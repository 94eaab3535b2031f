"""The plant `ros2-control`: decided motions on a robot that a joint trajectory controller moves.

A process of its own (`trajectory_loop`) hands the decided motion over as one goal and reports the joint
states. This module plans, and calls the monitor for each of them. Plant time is the stamp of the newest joint
states that were read here, less the times in which the controller took motions over.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from math import inf
from typing import Any, Final

from aeros.ros2_control.settings import ControlSettings
from aeros.runtime.ports import Vec3
from aeros.sim.robot.model import RobotModel
from aeros.sim.robot.motions import JOINT_ARRIVAL_TOLERANCE
from aeros.wired_arm.arm_client import ArmClient, RobotLostError
from aeros.wired_arm.arm_plant import ArmPlant
from aeros.wired_arm.measurements import Measurements
from aeros.wired_arm.planner import MotionPlanner
from aeros.wired_arm.process import ProcessError

_MODULE: Final = "aeros.ros2_control.process"

_UNMEASURED: Final = frozenset({"contact_force", "estop_pressed"})
"""Variables of other arms that joint states do not tell."""

_OF_EFFORT: Final = frozenset({"joint_torque", "joint_torque_rate"})
"""Variables that are measured only if the joint states have torques."""


_INTERVALS: Final = 20
"""Number of intervals between joint states of which the longest is expected next."""

_LONGEST_PERIOD: Final = 0.05
"""Longest interval that is expected, s: 20 Hz; broadcasters publish at 100 Hz and more."""


class JointTrajectoryPlant(ArmPlant):
    """Implementation of `aeros.runtime.ports.Plant`.

    Args:
        settings: of the robot.
        model: the robot.
        base: position of the arm's base in W, m.
        declared: names of the site's state variables.

    Raises:
        ProcessError: the controller cannot be reached, or is another one than the settings say.
    """

    def __init__(
        self, settings: ControlSettings, model: RobotModel, base: Vec3, declared: Collection[str]
    ) -> None:
        arm = ArmClient(_process_settings(settings, model), _MODULE)
        measured = frozenset(declared) - _UNMEASURED
        if not arm.opened.get("has_effort"):
            measured -= _OF_EFFORT
        self._intervals: deque[float] = deque(maxlen=_INTERVALS)
        self._last_time = -inf
        planner = MotionPlanner(model, base, settings.start_tolerance)
        try:
            super().__init__(arm, planner, Measurements(model, base, measured), measured)
        except RobotLostError as failure:
            arm.close()
            raise ProcessError(str(failure)) from failure

    def _take_state(self) -> None:
        super()._take_state()
        time = self.now()
        if time > self._last_time > -inf:
            self._intervals.append(min(time - self._last_time, _LONGEST_PERIOD))
            self._period = max(self._intervals)
        self._last_time = time


def _process_settings(settings: ControlSettings, model: RobotModel) -> dict[str, Any]:
    """Return what the process needs to know, as JSON values."""
    return {
        "controller": settings.controller,
        "joints": settings.joints,
        "states": settings.states,
        "acceleration": model.limits.acceleration.tolist(),
        "jerk": model.limits.jerk.tolist(),
        "patience": settings.patience,
        "start_tolerance": settings.start_tolerance,
        "path_tolerance": settings.path_tolerance,
        "goal_tolerance": JOINT_ARRIVAL_TOLERANCE,
    }
