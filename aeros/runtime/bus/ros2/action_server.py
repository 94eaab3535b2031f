"""Action server over rclpy; goals wait in a queue until the owner of the robot takes them."""

from __future__ import annotations

import threading
from queue import Empty, SimpleQueue
from typing import Any, Generic

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.task import Future

from aeros.runtime.bus.port import BusError, F, G, GoalStatus, R, Requester
from aeros.runtime.bus.ros2.node import RobotNode
from aeros.runtime.bus.ros2.ros_types import RosConverter, import_interface, interface_of
from aeros.runtime.bus.ros2.topic_profiles import name_in_namespace


class RosServerGoal(Generic[G, F, R]):
    """Goal at the server's end: implements `port.ServerGoal`.

    Args:
        handle: Goal handle of rclpy.
        kinds: Types of goal, feedback and result.
        converter: Converts messages.
        requesters: Nodes that may have sent the goal.
    """

    def __init__(
        self,
        handle: Any,
        kinds: tuple[type[G], type[F], type[R]],
        converter: RosConverter,
        requesters: tuple[Requester, ...],
    ) -> None:
        self.goal: G = converter.from_ros(handle.request, kinds[0])
        self.requesters = requesters
        self.done = Future()
        self._handle = handle
        self._converter = converter
        self._end: GoalStatus | None = None
        self._lock = threading.Lock()

    @property
    def status(self) -> GoalStatus:
        """Implement `ServerGoal.status`."""
        if self._end is not None:
            return self._end
        return GoalStatus.CANCELING if self._handle.is_cancel_requested else GoalStatus.EXECUTING

    def send_feedback(self, feedback: F) -> None:
        """Implement `ServerGoal.send_feedback`."""
        if self._end is None:
            self._handle.publish_feedback(self._converter.to_ros(feedback))

    def set_result(self, status: GoalStatus, result: R) -> None:
        """Implement `ServerGoal.set_result`.

        Raises:
            BusError: There is a result already, or `status` is not an end.
        """
        if not status.is_over:
            raise BusError(f"{status.name} is not an end")
        with self._lock:
            if self._end is not None:
                raise BusError(f"it is {self._end.name} already")
            self._end = status
        # A goal may only end as canceled while it is canceling; anything else than that is an abort.
        if status is GoalStatus.SUCCEEDED:
            self._handle.succeed()
        elif status is GoalStatus.CANCELED:
            self._handle.canceled()
        else:
            self._handle.abort()
        self.done.set_result(self._converter.to_ros(result))

    def execute(self) -> None:
        """Mark the goal as executing."""
        self._handle.execute()


class RosActionServer(Generic[G, F, R]):
    """Action server: implements `port.ActionServer`.

    Args:
        node: The node that offers it.
        action: Absolute name.
        kinds: Types of goal, feedback and result.
        converter: Converts messages.
        waiting: Limit on goals that wait; more are refused.
    """

    def __init__(
        self,
        node: RobotNode,
        action: str,
        kinds: tuple[type[G], type[F], type[R]],
        converter: RosConverter,
        waiting: int,
    ) -> None:
        self._node = node
        self._action = name_in_namespace(action)
        self._kinds = kinds
        self._converter = converter
        self._max_waiting = waiting
        self._waiting: SimpleQueue[RosServerGoal[G, F, R]] = SimpleQueue()
        self._active: dict[bytes, RosServerGoal[G, F, R]] = {}
        self._is_closed = False
        self._lock = threading.Lock()
        self._server = ActionServer(
            node,
            import_interface(interface_of(kinds)),
            self._action,
            execute_callback=self._execute,
            goal_callback=self._judge,
            handle_accepted_callback=self._accept,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def next_goal(self, timeout: float = 0.0) -> RosServerGoal[G, F, R] | None:
        """Implement `ActionServer.next_goal`."""
        try:
            goal = self._waiting.get(timeout=timeout) if timeout > 0.0 else self._waiting.get_nowait()
        except Empty:
            return None
        goal.execute()
        return goal

    def close(self) -> None:
        """Implement `ActionServer.close`."""
        with self._lock:
            self._is_closed = True
            left = list(self._active.values())
        for goal in left:
            if not goal.status.is_over:
                goal.execute()
                goal.set_result(GoalStatus.ABORTED, self._kinds[2]())

    def _judge(self, _request: Any) -> GoalResponse:
        is_full = self._is_closed or self._waiting.qsize() >= self._max_waiting
        return GoalResponse.ACCEPT if self._node.is_accepting and not is_full else GoalResponse.REJECT

    def _accept(self, handle: Any) -> None:
        requesters = self._node.clients_of(f"{self._action}/_action/send_goal")
        goal = RosServerGoal(handle, self._kinds, self._converter, requesters)
        with self._lock:
            self._active[bytes(handle.goal_id.uuid)] = goal
        self._waiting.put(goal)

    async def _execute(self, handle: Any) -> Any:
        key = bytes(handle.goal_id.uuid)
        result = await self._active[key].done
        with self._lock:
            del self._active[key]
        return result
