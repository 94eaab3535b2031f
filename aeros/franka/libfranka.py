"""The maker's library `pylibfranka`, which only the processes that drive the robot import."""

from __future__ import annotations

from types import ModuleType
from typing import Any, Final

from aeros.distribution import install_command
from aeros.franka.arm import HandState
from aeros.franka.error_words import explain_errors
from aeros.wired_arm.arm import ArmError, ArmState, Joints

_ANY_WIDTH: Final = 0.08
"""Tolerance of a grasp, m: as wide as the hand, so that it grasps whatever is there."""

_NO_WIDTH: Final = 0.0005
"""Tolerance of a grasp that closes on nothing, m."""


def load_library() -> ModuleType:
    """Import the library.

    Returns:
        The module `pylibfranka`.

    Raises:
        ArmError: it is not installed.
    """
    try:
        import pylibfranka
    except ImportError as failure:
        raise ArmError(
            f"the plant `franka` needs {install_command('franka')} ({failure}); the maker has "
            "wheels for Python 3.11 and 3.12 on x86-64 Linux alone",
            is_connected=False,
        ) from failure
    module: ModuleType = pylibfranka
    return module


class LibfrankaArm:
    """Implementation of `arm.Arm`.

    Args:
        address: the robot's address in the network.
        real_time: True to require a real-time kernel.

    Raises:
        ArmError: the library is missing, or the robot cannot be reached.
    """

    def __init__(self, address: str, *, real_time: bool) -> None:
        self._library = load_library()
        config = self._library.RealtimeConfig
        try:
            self._robot = self._library.Robot(address, config.kEnforce if real_time else config.kIgnore)
        except Exception as failure:
            raise _explained(self._library, failure, f"the robot at `{address}`") from failure

    def set_thresholds(self, torques: Joints, forces: Joints) -> None:
        """Set the robot's own collision detection; half of each threshold is a contact.

        Args:
            torques: external torques of the joints (7,) at which the robot stops by itself, N·m.
            forces: forces, N, and moments, N·m, at the hand (6,), likewise.

        Raises:
            ArmError: the robot refuses it, or it is gone.
        """
        try:
            self._robot.set_collision_behavior(
                [value / 2.0 for value in torques], [*torques], [value / 2.0 for value in forces], [*forces]
            )
        except Exception as failure:
            raise _explained(self._library, failure, "the robot") from failure

    def read(self) -> ArmState:
        """Implement `Arm.read`."""
        try:
            return _state_of(self._robot.read_once())
        except Exception as failure:
            raise _explained(self._library, failure, "the robot") from failure

    def start(self) -> LibfrankaControl:
        """Implement `Arm.start`."""
        try:
            control = self._robot.start_joint_position_control(self._library.ControllerMode.JointImpedance)
        except Exception as failure:
            raise _explained(self._library, failure, "the robot") from failure
        return LibfrankaControl(self._library, control)

    def stop(self) -> None:
        """Implement `Arm.stop`."""
        try:
            self._robot.stop()
        except Exception as failure:
            raise _explained(self._library, failure, "the robot") from failure

    def recover(self) -> None:
        """Implement `Arm.recover`."""
        try:
            self._robot.automatic_error_recovery()
        except Exception as failure:
            raise _explained(self._library, failure, "the robot") from failure


class LibfrankaControl:
    """Implementation of `arm.ControlledArm`.

    Args:
        library: the module `pylibfranka`.
        control: its active control.
    """

    def __init__(self, library: ModuleType, control: Any) -> None:
        self._library, self._control = library, control

    def read(self) -> ArmState:
        """Implement `ControlledArm.read`."""
        try:
            state, _ = self._control.readOnce()
        except Exception as failure:
            raise _explained(self._library, failure, "the robot") from failure
        return _state_of(state)

    def write(self, q: Joints, *, is_last: bool) -> None:
        """Implement `ControlledArm.write`."""
        command = self._library.JointPositions(q)
        command.motion_finished = is_last
        try:
            self._control.writeOnce(command)
        except Exception as failure:
            raise _explained(self._library, failure, "the robot") from failure


class LibfrankaHand:
    """Implementation of `arm.Hand`.

    Args:
        address: the robot's address in the network.

    Raises:
        ArmError: the library is missing, or the hand cannot be reached.
    """

    def __init__(self, address: str) -> None:
        self._library = load_library()
        try:
            self._gripper = self._library.Gripper(address)
        except Exception as failure:
            raise _explained(self._library, failure, f"the hand at `{address}`") from failure

    def read(self) -> HandState:
        """Implement `Hand.read`."""
        try:
            state = self._gripper.read_once()
        except Exception as failure:
            raise _explained(self._library, failure, "the hand") from failure
        return HandState(float(state.width), bool(state.is_grasped))

    def open(self, gap: float, speed: float) -> None:
        """Implement `Hand.open`."""
        try:
            self._gripper.move(gap, speed)
        except Exception as failure:
            raise _explained(self._library, failure, "the hand") from failure

    def close(self, gap: float, speed: float, force: float) -> None:
        """Implement `Hand.close`."""
        try:
            self._gripper.grasp(gap, speed, force, _NO_WIDTH, _ANY_WIDTH)
        except Exception as failure:
            raise _explained(self._library, failure, "the hand") from failure


def _state_of(state: Any) -> ArmState:
    return ArmState(
        state.time.to_sec(),
        tuple(state.q),
        tuple(state.dq),
        tuple(state.q_d),
        tuple(state.tau_J),
        tuple(state.tau_ext_hat_filtered),
        state.robot_mode.value,
        state.control_command_success_rate,
    )


def _explained(library: ModuleType, failure: Exception, who: str) -> ArmError:
    """Say in words what an exception of the library means."""
    text = explain_errors(str(failure) or type(failure).__name__)
    if isinstance(failure, library.NetworkException):
        return ArmError(f"{who} cannot be reached: {text}", is_connected=False)
    if isinstance(failure, library.ControlException):
        return ArmError(f"{who} stopped by itself: {text}")
    if isinstance(failure, library.CommandException):
        return ArmError(f"{who} refused a command: {text}")
    return ArmError(f"{who} cannot be driven: {text}", is_connected=False)
