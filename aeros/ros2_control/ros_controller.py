"""Binding to rclpy: the action `follow_joint_trajectory` of a controller, and the topic of joint states."""

from __future__ import annotations

import threading
import time
from math import floor, isfinite
from queue import Empty, SimpleQueue
from typing import Any, Final

from rclpy import Context, init, shutdown
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from aeros.ros2_control.controller import (
    ControllerError,
    GoalEvent,
    GoalState,
    JointSample,
    TrajectoryGoal,
    TrajectoryPoint,
    end_of_goal,
)

_OPEN_TIMEOUT: Final = 10.0
"""Longest time until the controller and the joint states are found, s."""

_STATUS_TIMEOUT: Final = 1.0
"""Longest time for the latched status of the controller's goals, s; it sends none before its first goal."""

_UNDER_WAY: Final = frozenset({1, 2, 3})
"""Values of `action_msgs/msg/GoalStatus`: accepted, executing, cancelling."""


class RosController:
    """Implementation of `TrajectoryController` over rclpy.

    Args:
        name: full name of the controller's node.
        joints: names of the joints, from the base outwards.
        states: topic of the joint states.

    Raises:
        ControllerError: the message types are missing, the controller does not answer, has other joints or
            already executes a goal, or there are no joint states of all joints.
    """

    def __init__(self, name: str, joints: tuple[str, ...], states: str) -> None:
        self._joints = joints
        self._samples: SimpleQueue[JointSample] = SimpleQueue()
        self._events: SimpleQueue[GoalEvent] = SimpleQueue()
        self._count = 0
        try:
            from action_msgs.msg import GoalStatusArray
            from action_msgs.srv import CancelGoal
            from control_msgs.action import FollowJointTrajectory
            from sensor_msgs.msg import JointState
        except ImportError as failure:
            raise ControllerError(
                f"the message package of {failure.name} is missing: source a ROS 2 distribution with "
                "ros2_control, or run `aeros ros2-messages` where ROS 2 comes from PyPI"
            ) from failure
        self._goal_type: Any = FollowJointTrajectory.Goal
        self._cancel_type: Any = CancelGoal.Request
        self._context = Context()
        init(args=["aeros"], context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node("aeros_ros2_control", context=self._context, use_global_arguments=False)
        self._client = ActionClient(self._node, FollowJointTrajectory, f"{name}/follow_joint_trajectory")
        self._cancel = self._node.create_client(
            CancelGoal, f"{name}/follow_joint_trajectory/_action/cancel_goal"
        )
        # Drivers publish as best effort; a reader that asks for no more gets reliable publishers, too.
        quality = QoSProfile(
            history=HistoryPolicy.KEEP_LAST, depth=10, reliability=ReliabilityPolicy.BEST_EFFORT
        )
        self._node.create_subscription(JointState, states, self._hear, quality)
        latched = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=1,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
        )
        self._statuses: tuple[int, ...] = ()
        self._has_statuses = threading.Event()
        status_topic = f"{name}/follow_joint_trajectory/_action/status"
        # It stays: rclpy may be about to take a message of it, in its own thread, when it is destroyed.
        self._node.create_subscription(GoalStatusArray, status_topic, self._hear_statuses, latched)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, name="aeros-ros2-control", daemon=True)
        self._thread.start()
        try:
            self._require_controller(name)
            self._require_no_goal(name)
            self.has_effort = self._require_states(states)
        except ControllerError:
            self.close()
            raise

    def next_sample(self, timeout: float) -> JointSample | None:
        """Implement `TrajectoryController.next_sample`."""
        try:
            return self._samples.get(timeout=timeout)
        except Empty:
            return None

    def next_event(self) -> GoalEvent | None:
        """Implement `TrajectoryController.next_event`."""
        try:
            return self._events.get_nowait()
        except Empty:
            return None

    def send(self, goal: TrajectoryGoal) -> int:
        """Implement `TrajectoryController.send`."""
        self._count += 1
        number = self._count
        asked = self._client.send_goal_async(self._goal_message(goal))
        asked.add_done_callback(lambda future: self._note_answer(number, future))
        return number

    def cancel_all(self) -> None:
        """Implement `TrajectoryController.cancel_all`: a request without a goal's number is for all goals."""
        self._cancel.call_async(self._cancel_type())

    def close(self) -> None:
        """End the node; goals that the controller has stay."""
        self._executor.shutdown(timeout_sec=1.0)
        self._thread.join(1.0)
        self._node.destroy_node()
        shutdown(context=self._context)

    # Callbacks, in the thread of the executor.

    def _hear(self, message: Any) -> None:
        arrival = time.monotonic()
        places = {name: place for place, name in enumerate(message.name)}
        try:
            order = [places[name] for name in self._joints]
            q = tuple([float(message.position[place]) for place in order])
            dq = tuple([float(message.velocity[place]) for place in order])
        except (KeyError, IndexError):
            return  # of other joints, or without speeds
        effort = tuple([float(message.effort[place]) for place in order if place < len(message.effort)])
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        if stamp > 0.0 and all(map(isfinite, (*q, *dq))):
            whole = len(effort) == len(q) and all(map(isfinite, effort))
            self._samples.put(JointSample(stamp, arrival, q, dq, effort if whole else ()))

    def _hear_statuses(self, message: Any) -> None:
        self._statuses = tuple(one.status for one in message.status_list)
        self._has_statuses.set()

    def _note_answer(self, number: int, future: Any) -> None:
        failure = future.exception()
        if failure is not None:
            # Nobody knows if the controller has the goal.
            self._events.put(GoalEvent(number, GoalState.FAILED, f"{type(failure).__name__}: {failure}"))
            return
        handle = future.result()
        if not handle.accepted:
            self._events.put(
                GoalEvent(number, GoalState.REJECTED, "it is not active, or does not take these joints")
            )
            return
        self._events.put(GoalEvent(number, GoalState.ACCEPTED))
        handle.get_result_async().add_done_callback(lambda ended: self._note_end(number, ended))

    def _note_end(self, number: int, future: Any) -> None:
        failure = future.exception()
        if failure is not None:
            self._events.put(GoalEvent(number, GoalState.FAILED, f"{type(failure).__name__}: {failure}"))
            return
        status, result = future.result().status, future.result().result
        self._events.put(GoalEvent(number, *end_of_goal(status, result.error_code, result.error_string)))

    # Messages.

    def _goal_message(self, goal: TrajectoryGoal) -> Any:
        from control_msgs.msg import JointTolerance

        message = self._goal_type()
        trajectory = message.trajectory
        trajectory.header.stamp = _set_time(trajectory.header.stamp, goal.start)
        trajectory.joint_names = list(self._joints)
        trajectory.points = [_point_message(point) for point in goal.points]
        message.path_tolerance = [
            JointTolerance(name=name, position=tolerance)
            for name, tolerance in zip(self._joints, goal.path_tolerance, strict=True)
        ]
        message.goal_tolerance = [
            JointTolerance(name=name, position=goal.goal_tolerance) for name in self._joints
        ]
        message.goal_time_tolerance = _set_time(message.goal_time_tolerance, goal.settle_time)
        return message

    # Opening.

    def _require_controller(self, name: str) -> None:
        """Check that the controller answers and has these joints.

        Raises:
            ControllerError: it does not.
        """
        from rcl_interfaces.srv import GetParameters

        ask = self._node.create_client(GetParameters, f"{name}/get_parameters")
        missing = None
        if not self._client.wait_for_server(timeout_sec=_OPEN_TIMEOUT):
            missing = f"nobody offers the action {name}/follow_joint_trajectory"
        elif not self._cancel.wait_for_service(timeout_sec=_OPEN_TIMEOUT):
            missing = f"nobody cancels goals of {name}/follow_joint_trajectory"
        elif not ask.wait_for_service(timeout_sec=_OPEN_TIMEOUT):
            missing = f"the node {name} does not tell its parameters"
        if missing is not None:
            raise ControllerError(f"{missing}: is the controller loaded, and in the same ROS_DOMAIN_ID?")
        done = threading.Event()
        asked = ask.call_async(GetParameters.Request(names=["joints"]))
        asked.add_done_callback(lambda _: done.set())
        if not done.wait(_OPEN_TIMEOUT) or asked.exception() is not None or not asked.result().values:
            raise ControllerError(f"the node {name} does not tell its parameter `joints`")
        theirs = tuple(asked.result().values[0].string_array_value)
        if set(theirs) != set(self._joints) or len(theirs) != len(self._joints):
            raise ControllerError(
                f"the controller {name} moves the joints {', '.join(theirs) or 'none'}, and not exactly "
                f"{', '.join(self._joints)}"
            )

    def _require_no_goal(self, name: str) -> None:
        """Check that the controller has no goal: nobody else's motion may be under way, nor be replaced.

        Raises:
            ControllerError: it has one.
        """
        self._has_statuses.wait(_STATUS_TIMEOUT)
        if _UNDER_WAY & set(self._statuses):
            raise ControllerError(
                f"the controller {name} executes a goal of another client: wait until it has ended, or "
                "cancel it"
            )

    def _require_states(self, states: str) -> bool:
        """Wait for joint states; return True if they have torques.

        Raises:
            ControllerError: there are none.
        """
        sample = self.next_sample(_OPEN_TIMEOUT)
        if sample is None:
            raise ControllerError(
                f"nothing on {states} has stamp, positions and velocities of {', '.join(self._joints)} in "
                f"{_OPEN_TIMEOUT:g} s: is the joint state broadcaster active?"
            )
        return bool(sample.effort)


def _set_time(message: Any, seconds: float) -> Any:
    message.sec = floor(seconds)
    message.nanosec = min(999_999_999, round(1e9 * (seconds - floor(seconds))))
    return message


def _point_message(point: TrajectoryPoint) -> Any:
    from trajectory_msgs.msg import JointTrajectoryPoint

    made = JointTrajectoryPoint(
        positions=list(point.q), velocities=list(point.dq), accelerations=list(point.ddq)
    )
    _set_time(made.time_from_start, point.time)
    return made
