"""The joint trajectory controller as the loop that drives it sees it; `ros_controller` implements it.

Units are SI, angles rad, and there is one number for each joint, from the base outwards. Times are on the
controller's clock, which stamps the joint states, unless they are called arrivals.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import Final, NamedTuple, Protocol

from aeros.wired_arm.arm import Joints

_SUCCEEDED, _CANCELED = 4, 5
"""Values of `action_msgs/msg/GoalStatus`."""

_INVALID_GOAL: Final = -1
ERROR_CODES: Final[Mapping[int, str]] = MappingProxyType(
    {
        0: "successful",
        _INVALID_GOAL: "invalid goal",
        -2: "invalid joints",
        -3: "old header timestamp",
        -4: "path tolerance violated",
        -5: "goal tolerance violated",
    }
)
"""Error codes of `control_msgs/action/FollowJointTrajectory`."""


class ControllerError(Exception):
    """The controller cannot be reached, or is another one than expected; the message says why."""


class JointSample(NamedTuple):
    """Joint states of one time.

    Attributes:
        stamp: time of the measurement, s.
        arrival: time at which the message came, on this machine's monotonic clock, s.
        q: positions, rad.
        dq: speeds, rad/s.
        effort: torques, N·m; empty if they are not measured.
    """

    stamp: float
    arrival: float
    q: Joints
    dq: Joints
    effort: Joints


class TrajectoryPoint(NamedTuple):
    """Point of a trajectory.

    Attributes:
        time: from the start of the trajectory, s.
        q: positions, rad.
        dq: speeds, rad/s.
        ddq: accelerations, rad/s².
    """

    time: float
    q: Joints
    dq: Joints
    ddq: Joints


class TrajectoryGoal(NamedTuple):
    """Goal of the controller.

    Attributes:
        start: time at which the trajectory starts, s.
        points: in order.
        path_tolerance: greatest error of each joint on the way, rad: beyond it the controller ends the goal.
        goal_tolerance: greatest error of each joint at the end, rad.
        settle_time: longest time after the last point until the joints are there, s.
    """

    start: float
    points: tuple[TrajectoryPoint, ...]
    path_tolerance: Joints
    goal_tolerance: float
    settle_time: float


class GoalState(Enum):
    """State of a goal that an event reports."""

    ACCEPTED = "accepted"
    REJECTED = "rejected"
    SUCCEEDED = "succeeded"
    PREEMPTED = "preempted"
    FAILED = "failed"

    @property
    def is_over(self) -> bool:
        """True if the controller has finished with the goal."""
        return self is not GoalState.ACCEPTED


class GoalEvent(NamedTuple):
    """Event of a goal.

    Attributes:
        number: of the goal, as `send` returned it.
        state: of the goal.
        reason: in words; empty if there is nothing to say.
    """

    number: int
    state: GoalState
    reason: str = ""


def end_of_goal(status: int, code: int, text: str) -> tuple[GoalState, str]:
    """Tell how a goal has ended from what the controller says of it.

    Args:
        status: value of `action_msgs/msg/GoalStatus`.
        code: error code of the result.
        text: its error text.

    Returns:
        The state, and the reason in words.
    """
    words = ERROR_CODES.get(code, f"error {code}")
    reason = f"{words}: {text}" if text else words
    if status == _SUCCEEDED and code == 0:
        return GoalState.SUCCEEDED, ""
    if status == _CANCELED or code == _INVALID_GOAL:
        return GoalState.PREEMPTED, reason
    return GoalState.FAILED, reason


class TrajectoryController(Protocol):
    """A joint trajectory controller, and the joint states of its robot."""

    def next_sample(self, timeout: float) -> JointSample | None:
        """Wait for the next joint states.

        Args:
            timeout: longest time to wait, s.

        Returns:
            The states; None if none came.
        """

    def next_event(self) -> GoalEvent | None:
        """Take the next event of a goal.

        Returns:
            The event; None if there is none.
        """

    def send(self, goal: TrajectoryGoal) -> int:
        """Send a goal, which replaces the goal that the controller has.

        Args:
            goal: the goal.

        Returns:
            Its number.
        """

    def cancel_all(self) -> None:
        """Cancel every goal that the controller has, whoever sent it; the controller then holds."""
