"""The plant `franka`: decided motions on a real Franka Research 3.

The arm is driven by a process of its own (`streamer`), the hand by another one (`hand_loop`). The robot
reports a thousand states a second.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Final

from aeros.franka.settings import FrankaSettings
from aeros.runtime.ports import Vec3
from aeros.sim.robot.model import RobotModel
from aeros.wired_arm.arm_client import ArmClient, RobotLostError
from aeros.wired_arm.arm_plant import ArmPlant
from aeros.wired_arm.hand_client import HandClient
from aeros.wired_arm.measurements import Measurements
from aeros.wired_arm.motion_table import MotionTable
from aeros.wired_arm.planner import MotionPlanner, mode_refusal
from aeros.wired_arm.process import ProcessError

PROCESS: Final = "aeros.franka.process"
"""Program of the processes that drive the robot."""


class FrankaPlant(ArmPlant):
    """Implementation of `aeros.runtime.ports.Plant`.

    Args:
        settings: of the robot.
        model: the robot.
        base: position of the arm's base in W, m.
        declared: names of the site's state variables.

    Raises:
        ProcessError: the robot cannot be reached, or it is not ready to move.
    """

    def __init__(
        self, settings: FrankaSettings, model: RobotModel, base: Vec3, declared: Collection[str]
    ) -> None:
        arm = ArmClient(_arm_settings(settings, model), PROCESS)
        planner = MotionPlanner(model, base, settings.start_tolerance)
        try:
            super().__init__(arm, planner, Measurements(model, base, declared), declared)
            self._require_ready()
            if settings.has_hand:
                self._hand = HandClient(settings.address, model.hand.finger_speed, PROCESS)
                self._motions = MotionTable(arm, self._hand)
        except (ProcessError, RobotLostError) as failure:
            arm.close()
            raise ProcessError(str(failure)) from failure

    @property
    def cycle_times(self) -> Mapping[str, float]:
        """Times of the cycles of the last motion: `streamer.CycleTimes.summary`."""
        return self._arm.cycle_times

    def _require_ready(self) -> None:
        """Check that the robot moves in its mode.

        Raises:
            ProcessError: it does not.
        """
        refusal = mode_refusal(self._arm.state.mode)
        if refusal is not None:
            raise ProcessError(refusal)


def _arm_settings(settings: FrankaSettings, model: RobotModel) -> dict[str, Any]:
    """Return what the process of the arm needs to know, as JSON values."""
    return {
        "address": settings.address,
        "real_time": settings.is_real_time,
        "torques": settings.torques,
        "forces": settings.forces,
        "acceleration": model.limits.acceleration.tolist(),
        "jerk": model.limits.jerk.tolist(),
        "patience": settings.patience,
        "start_tolerance": settings.start_tolerance,
    }
