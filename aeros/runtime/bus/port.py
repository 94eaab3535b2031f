"""Port to a bus, so that something outside this process, such as DDS, can carry the messages.

Topics carry messages from many to many, and nobody waits. A service is called and answers. An action has a
goal, gives feedback, can be cancelled, and ends with a result.

Through the bus others follow a run and make requests. It gives no access to motors: every request goes to the
executor, and the gate decides each of its actions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from typing import NamedTuple, Protocol, TypeVar

from aeros.runtime.bus.messages import Message

M = TypeVar("M", bound=Message)
Q = TypeVar("Q", bound=Message)
R = TypeVar("R", bound=Message)
G = TypeVar("G", bound=Message)
F = TypeVar("F", bound=Message)
M_co = TypeVar("M_co", bound=Message, covariant=True)
M_contra = TypeVar("M_contra", bound=Message, contravariant=True)
F_co = TypeVar("F_co", bound=Message, covariant=True)
R_co = TypeVar("R_co", bound=Message, covariant=True)
F_contra = TypeVar("F_contra", bound=Message, contravariant=True)
R_contra = TypeVar("R_contra", bound=Message, contravariant=True)
G_co = TypeVar("G_co", bound=Message, covariant=True)


class BusError(Exception):
    """The bus refuses a request; the message says why."""


class NoServerError(BusError):
    """There is no service or action of that name, or none answered in time."""


class GoalStatus(Enum):
    """Status of a goal, with the numbers of `action_msgs/msg/GoalStatus`."""

    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_over(self) -> bool:
        """True if there is a result."""
        return self.value >= GoalStatus.SUCCEEDED.value


class Requester(NamedTuple):
    """Another process's node that may have sent a request.

    Attributes:
        node: full name of the node.
        guid: identifier of its client in the middleware, in hexadecimal digits.
    """

    node: str
    guid: str


class Publisher(Protocol[M_contra]):
    """Publisher on one topic."""

    def publish(self, message: M_contra) -> None:
        """Send a message to all present subscriptions; never waits.

        Args:
            message: of the topic's type.

        Raises:
            BusError: it has another type.
        """


class Subscription(Protocol[M_co]):
    """Subscription to one topic, with a queue of its own.

    Attributes:
        dropped_count: number of messages that newer ones pushed out of the queue.
    """

    dropped_count: int  # the oldest messages that gave way to newer ones

    def receive(self, timeout: float = 0.0) -> M_co | None:
        """Remove and return the oldest message in the queue.

        Args:
            timeout: s of real time to wait for one.

        Returns:
            The message; None if there is none in time.
        """

    def close(self) -> None:
        """Unsubscribe; safe to call twice."""


class ServerGoal(Protocol[G_co, F_contra, R_contra]):
    """Goal of an action, at the server's end."""

    @property
    def goal(self) -> G_co:
        """Goal message of the client."""

    @property
    def status(self) -> GoalStatus:
        """Status; CANCELING once a client has asked for that."""

    @property
    def requesters(self) -> tuple[Requester, ...]:
        """Nodes that may have sent the goal; empty if it came from this process."""

    def send_feedback(self, feedback: F_contra) -> None:
        """Send feedback; it replaces feedback that the client has not read.

        Args:
            feedback: of the action's type.
        """

    def set_result(self, status: GoalStatus, result: R_contra) -> None:
        """Set the result and end the goal.

        Args:
            status: SUCCEEDED, CANCELED or ABORTED.
            result: of the action's type.

        Raises:
            BusError: there is a result already, or `status` is not an end.
        """


class ClientGoal(Protocol[F_co, R_co]):
    """Goal of an action, at the client's end."""

    @property
    def status(self) -> GoalStatus:
        """Status of the goal."""

    def feedback(self, timeout: float = 0.0) -> F_co | None:
        """Return the newest feedback that was not returned before.

        Args:
            timeout: s of real time to wait for it.

        Returns:
            The feedback; None if there is none in time.
        """

    def cancel(self) -> None:
        """Ask the server to cancel the goal; the result says if it did."""

    def result(self, timeout: float) -> R_co:
        """Wait for the result.

        Args:
            timeout: s of real time.

        Returns:
            The result.

        Raises:
            NoServerError: there is none in time.
        """


class ActionServer(Protocol[G_co, F_contra, R_contra]):
    """Server of one action; call it from one thread."""

    def next_goal(self, timeout: float = 0.0) -> ServerGoal[G_co, F_contra, R_contra] | None:
        """Accept the next goal.

        Args:
            timeout: s of real time to wait for one.

        Returns:
            The goal; None if there is none in time.
        """

    def close(self) -> None:
        """Accept no more goals and abort those that are not over; safe to call twice."""


class PublisherFactory(Protocol):
    """Destination of messages: a bus or a recorder."""

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> Publisher[M]:
        """Make a publisher.

        Args:
            topic: absolute ROS 2 name.
            kind: type of its messages.
            latched: keep the last message for later subscriptions.

        Returns:
            The publisher.

        Raises:
            BusError: the name is invalid, or has another type.
        """


class ServingBus(PublisherFactory, Protocol):
    """Bus that offers topics, services and actions by name; each name has one type."""

    def serve(
        self, service: str, kinds: tuple[type[Q], type[R]], answer: Callable[[Q], R]
    ) -> Callable[[], None]:
        """Offer a service.

        Args:
            service: absolute ROS 2 name.
            kinds: types of request and response.
            answer: called with each request, in the thread of the caller.

        Returns:
            Function that withdraws the service.

        Raises:
            BusError: the name is invalid, has another type or is served already.
        """

    def serve_action(
        self, action: str, kinds: tuple[type[G], type[F], type[R]], *, waiting: int = 10
    ) -> ActionServer[G, F, R]:
        """Offer an action.

        Args:
            action: absolute ROS 2 name.
            kinds: types of goal, feedback and result.
            waiting: limit on goals that wait to be accepted; more are refused.

        Returns:
            The server, to accept goals from.

        Raises:
            BusError: the name is invalid, has another type or is served already.
        """

    def requesters(self, service: str) -> tuple[Requester, ...]:
        """Find the nodes of other processes that can call a service.

        Args:
            service: absolute ROS 2 name.

        Returns:
            Nodes with a client of it; empty on a bus within one process.
        """

    def names(self) -> Mapping[str, str]:
        """List the names in use.

        Returns:
            ROS 2 type by name.
        """


class Bus(ServingBus, Protocol):
    """Bus that listens, calls and sends goals, too."""

    def subscribe(self, topic: str, kind: type[M], *, depth: int = 10) -> Subscription[M]:
        """Subscribe to a topic.

        Args:
            topic: absolute ROS 2 name.
            kind: type of its messages.
            depth: length of the queue; when it is full, the oldest message is dropped.

        Returns:
            The subscription.

        Raises:
            BusError: the name is invalid, or has another type.
        """

    def call(self, service: str, kinds: tuple[type[Q], type[R]], request: Q) -> R:
        """Call a service and wait for its response.

        Args:
            service: absolute ROS 2 name.
            kinds: types of request and response.
            request: the request.

        Returns:
            The response.

        Raises:
            NoServerError: nobody serves it.
            BusError: the name is invalid, or a type differs.
        """

    def send_goal(self, action: str, kinds: tuple[type[G], type[F], type[R]], goal: G) -> ClientGoal[F, R]:
        """Send a goal to an action.

        Args:
            action: absolute ROS 2 name.
            kinds: types of goal, feedback and result.
            goal: the goal.

        Returns:
            The client's end of the goal.

        Raises:
            NoServerError: nobody serves the action.
            BusError: the name is invalid, a type differs, or too many goals wait.
        """
