"""State of an arm at the other end of a wire, as the process that drives it reports it.

Units are SI, angles rad, and there is one number for each joint, from the base outwards.
"""

from __future__ import annotations

from typing import Final, NamedTuple

CYCLE: Final = 0.001
"""Time between two states of a robot that streams, and so between two commands to it, s."""

Joints = tuple[float, ...]

MODES: Final = ("other", "idle", "move", "guiding", "reflex", "user-stopped", "error-recovery")
"""Names of the modes of a robot, in the order of the values of `franka::RobotMode`."""

USER_STOPPED: Final = MODES.index("user-stopped")
REFLEX: Final = MODES.index("reflex")


class ArmState(NamedTuple):
    """State that the robot reports.

    Attributes:
        time: on the robot's clock, s; it counts the robot's own cycles.
        q: measured positions, rad.
        dq: measured speeds, rad/s.
        q_d: commanded positions, rad.
        torque: measured torques, N·m.
        external_torque: torques that the robot's model does not explain, filtered by the robot, N·m.
        mode: number of the mode in `MODES`.
        success_rate: share of the last 100 commands that came in time; 0 if the robot is not controlled.
    """

    time: float
    q: Joints
    dq: Joints
    q_d: Joints
    torque: Joints
    external_torque: Joints
    mode: int
    success_rate: float


class ArmError(Exception):
    """The robot refused a command or stopped by itself; the message says why, in words.

    Attributes:
        is_connected: False if the robot can no longer be reached.
    """

    def __init__(self, message: str, *, is_connected: bool = True) -> None:
        super().__init__(message)
        self.is_connected = is_connected
