"""The ROS 2 node of a run: a managed node that spins in threads of its own.

Its states are those of the agent: `active` while actions may begin, `inactive` while the operator pauses,
`finalized` after a stop or at the end. A transition that a peer asks for is the operator's command of that
meaning, and returns when it has taken effect.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

from rclpy import Context, init, shutdown
from rclpy.executors import MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.signals import SignalHandlerOptions

from aeros.runtime.bus.port import Requester
from aeros.runtime.bus.ros2.lifecycle_steps import LifecycleStep, next_step
from aeros.runtime.execution.governor import OperatorCommand

_THREADS: Final = 8
"""Each service has its own callback group, so that a stop is answered while a pause waits."""

_CLOSE_TIMEOUT_S: Final = 15.0  # s; a pause or stop in progress answers within 10 s
_SYNC_INTERVAL_S: Final = 0.05  # s between looks at the operator's command


class Operator(NamedTuple):
    """The operator's commands as the node sees them.

    Attributes:
        current: Returns the command in force.
        request: Gives a command on behalf of the clients of a service and waits until it has taken effect;
            returns the reason if it has not, else None.
    """

    current: Callable[[], OperatorCommand]
    request: Callable[[OperatorCommand, str, Callable[[], Sequence[Requester]]], str | None]


class RobotNode(LifecycleNode):
    """Managed node of a robot.

    Args:
        name: Name of the node.
        context: Context of rclpy.
        facts: Read-only parameters.
        operator: The operator's commands.
    """

    def __init__(self, name: str, context: Context, facts: Mapping[str, Any], operator: Operator) -> None:
        self._operator = operator
        self._is_following = False  # a transition that follows the operator's command, and gives none
        super().__init__(name, context=context)
        for key, value in facts.items():
            self.declare_parameter(key, value, _read_only(key))
        # In the group of the lifecycle services: transitions never overlap.
        self.create_timer(_SYNC_INTERVAL_S, self._follow, callback_group=self.default_callback_group)

    def on_configure(self, state: Any) -> TransitionCallbackReturn:
        """Allow what the run itself begins; the robot is proved and opened before the node is configured.

        Args:
            state: State before the transition.

        Returns:
            SUCCESS for the run itself, FAILURE for a peer.
        """
        return self._result(is_allowed=self._is_following)

    def on_cleanup(self, state: Any) -> TransitionCallbackReturn:
        """Refuse: the robot is closed at the end of the run alone.

        Args:
            state: State before the transition.

        Returns:
            FAILURE.
        """
        return self._result(is_allowed=False)

    def on_activate(self, state: Any) -> TransitionCallbackReturn:
        """Resume.

        Args:
            state: State before the transition.

        Returns:
            SUCCESS; FAILURE if that was not possible.
        """
        return self._command(OperatorCommand.RUN)

    def on_deactivate(self, state: Any) -> TransitionCallbackReturn:
        """Pause, and return when nothing moves.

        Args:
            state: State before the transition.

        Returns:
            SUCCESS; FAILURE if something still moves.
        """
        return self._command(OperatorCommand.PAUSE)

    def on_shutdown(self, state: Any) -> TransitionCallbackReturn:
        """Stop, and return when nothing moves.

        Args:
            state: State before the transition.

        Returns:
            SUCCESS; FAILURE if something still moves.
        """
        return self._command(OperatorCommand.STOP)

    @property
    def is_accepting(self) -> bool:
        """True while the operator lets actions begin; an inactive node refuses goals."""
        return self._operator.current() is OperatorCommand.RUN

    def clients_of(self, service: str) -> tuple[Requester, ...]:
        """Find the nodes that have a client of a service: rclpy does not tell which of them asked.

        Args:
            service: Name, relative to the namespace or absolute; of an action, that of its goal service.

        Returns:
            The nodes, in order; empty if the middleware does not show them.
        """
        topic = f"rq{self.resolve_service_name(service)}Request"
        found = self.get_publishers_info_by_topic(topic, no_mangle=True)
        return tuple(
            sorted(
                Requester(f"{one.node_namespace.rstrip('/')}/{one.node_name}", bytes(one.endpoint_gid).hex())
                for one in found
            )
        )

    def _command(self, command: OperatorCommand) -> TransitionCallbackReturn:
        if self._is_following:
            return self._result(is_allowed=True)
        service = f"{self.get_fully_qualified_name()}/change_state"
        failure = self._operator.request(command, service, lambda: self.clients_of(service))
        if failure is not None:
            self.get_logger().error(failure)
        return self._result(is_allowed=failure is None)

    def _result(self, *, is_allowed: bool) -> TransitionCallbackReturn:
        return TransitionCallbackReturn.SUCCESS if is_allowed else TransitionCallbackReturn.FAILURE

    def _follow(self) -> None:
        """Bring the node's state to that of the operator's command, one transition each time."""
        triggers = {
            LifecycleStep.CONFIGURE: self.trigger_configure,
            LifecycleStep.ACTIVATE: self.trigger_activate,
            LifecycleStep.DEACTIVATE: self.trigger_deactivate,
            LifecycleStep.SHUTDOWN: self.trigger_shutdown,
        }
        step = next_step(self._state_machine.current_state[1], self._operator.current())
        if step is None:
            return
        self._is_following = True
        try:
            triggers[step]()
        finally:
            self._is_following = False


def _read_only(name: str) -> Any:
    from rcl_interfaces.msg import ParameterDescriptor

    return ParameterDescriptor(name=name, read_only=True, description="set by AEROS for this run")


@contextmanager
def open_node(
    name: str, ros_arguments: Sequence[str], facts: Mapping[str, Any], operator: Operator
) -> Iterator[RobotNode]:
    """Open the node in a context of its own, and let it spin until the block ends.

    Signals stay with AEROS. Parts are closed in the order that rclpy needs: callbacks, node, context.

    Args:
        name: Name of the node, unless `ros_arguments` change it.
        ros_arguments: Arguments after `--ros-args`: remappings, namespace, parameters.
        facts: Read-only parameters.
        operator: The operator's commands.

    Yields:
        The node.
    """
    context = Context()
    arguments = ["aeros", "--ros-args", *ros_arguments] if ros_arguments else ["aeros"]
    init(args=arguments, context=context, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = RobotNode(name, context, facts, operator)
        executor = MultiThreadedExecutor(num_threads=_THREADS, context=context)
        executor.add_node(node)
        is_closing = threading.Event()

        def spin() -> None:
            try:
                executor.spin()
            except Exception as error:
                node.get_logger().error(f"the node answers no more: {error}")
            # Nobody could stop the robot through a node that is deaf.
            if not is_closing.is_set():
                operator.request(OperatorCommand.STOP, node.get_fully_qualified_name(), tuple)

        thread = threading.Thread(target=spin, name="aeros-ros2")
        thread.start()
        try:
            yield node
        finally:
            is_closing.set()
            executor.shutdown(timeout_sec=_CLOSE_TIMEOUT_S)
            thread.join(_CLOSE_TIMEOUT_S)
            node.destroy_node()
    finally:
        shutdown(context=context)
