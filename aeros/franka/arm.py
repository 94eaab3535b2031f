"""The arm and the hand as the processes that drive them see these; `libfranka` implements them.

Units are SI, angles rad, and there is one number for each of the seven joints, from the base outwards.
"""

from __future__ import annotations

from typing import Final, NamedTuple, Protocol

JOINTS: Final = 7
"""Number of the arm's joints."""

CYCLE: Final = 0.001
"""Time between two states of the robot, and so between two commands to it, s."""

Joints = tuple[float, ...]

MODES: Final = ("other", "idle", "move", "guiding", "reflex", "user-stopped", "error-recovery")
"""Names of `franka::RobotMode`, in the order of its values."""

USER_STOPPED: Final = MODES.index("user-stopped")
REFLEX: Final = MODES.index("reflex")


class ArmState(NamedTuple):
    """State that the robot reports each millisecond.

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


class ControlledArm(Protocol):
    """The arm while positions are commanded: one `read`, one `write` in each of the robot's cycles."""

    def read(self) -> ArmState:
        """Wait for the state of the next cycle.

        Returns:
            The state.

        Raises:
            ArmError: the robot has stopped by itself, or it is gone.
        """

    def write(self, q: Joints, *, is_last: bool) -> None:
        """Command positions for this cycle.

        Args:
            q: positions, rad.
            is_last: True to end the motion; the robot then stands at `q`.

        Raises:
            ArmError: the robot has stopped by itself, or it is gone.
        """


class Arm(Protocol):
    """The arm while nothing is commanded."""

    def read(self) -> ArmState:
        """Wait for the next state.

        Returns:
            The state.

        Raises:
            ArmError: the robot is gone.
        """

    def start(self) -> ControlledArm:
        """Begin to command joint positions.

        Returns:
            The arm under control.

        Raises:
            ArmError: the robot refuses it, for example after a reflex.
        """

    def stop(self) -> None:
        """Call `Robot.stop`: the robot ends whatever motion it still has.

        Raises:
            ArmError: the robot refuses it, or it is gone.
        """

    def recover(self) -> None:
        """Clear a reflex, after a person has looked; the robot does not move.

        Raises:
            ArmError: the robot refuses it, or it is gone.
        """


class HandState(NamedTuple):
    """State of the hand.

    Attributes:
        gap: distance between the finger pads, m.
        is_grasped: True if the hand reports that it grasps something.
    """

    gap: float
    is_grasped: bool


class Hand(Protocol):
    """The hand; each command returns when the fingers rest."""

    def read(self) -> HandState:
        """Read its state.

        Returns:
            The state.

        Raises:
            ArmError: the hand is gone.
        """

    def open(self, gap: float, speed: float) -> None:
        """Move the fingers apart.

        Args:
            gap: distance between the finger pads at the end, m.
            speed: m/s.

        Raises:
            ArmError: the hand refuses it, or it is gone.
        """

    def close(self, gap: float, speed: float, force: float) -> None:
        """Move the fingers together until they touch something or are `gap` apart.

        Args:
            gap: least distance between the finger pads, m.
            speed: m/s.
            force: with which they press on what they touch, N.

        Raises:
            ArmError: the hand refuses it, or it is gone.
        """
