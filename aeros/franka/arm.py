"""The arm and the hand as the processes that drive them see these; `libfranka` implements them.

Units are SI, angles rad, and there is one number for each of the seven joints, from the base outwards.
"""

from __future__ import annotations

from typing import Final, NamedTuple, Protocol

from aeros.wired_arm.arm import ArmState, Joints

JOINTS: Final = 7
"""Number of the arm's joints."""


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
