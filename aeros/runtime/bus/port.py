"""The bus as whoever uses it sees it, so that something else than this process can carry it: DDS, say.

Topics carry messages from many to many, and nobody waits for anybody.  A service is asked and answers.
An action has a goal, tells how it goes, can be cancelled, and ends in a result.

The bus is how others hear of a run and ask for something.  It is no way to a motor: whatever is asked for
on it comes to the executor as a request, and every action of it is decided by the gate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from typing import Protocol, TypeVar

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
    """What was asked of the bus cannot be; the message says why."""


class NoServerError(BusError):
    """No service or action of that name is offered, or none answered in time."""


class GoalStatus(Enum):
    """How a goal stands, by the numbers of `action_msgs/msg/GoalStatus`."""

    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_over(self) -> bool:
        """Whether there is a result."""
        return self.value >= GoalStatus.SUCCEEDED.value


class Publisher(Protocol[M_contra]):
    """One who publishes on a topic."""

    def publish(self, message: M_contra) -> None:
        """Give `message` to everybody who listens now; never waits.  Raises `BusError` for another type."""


class Subscription(Protocol[M_co]):
    """One who listens on a topic, with a queue of his own."""

    dropped_count: int  # the oldest messages that gave way to newer ones

    def receive(self, timeout: float = 0.0) -> M_co | None:
        """The oldest message that was not taken; None where there is none within `timeout` seconds."""

    def close(self) -> None:
        """Listen no more; safe to call twice."""


class ServerGoal(Protocol[G_co, F_contra, R_contra]):
    """A goal as whoever pursues it sees it."""

    @property
    def goal(self) -> G_co:
        """What is wanted."""

    @property
    def status(self) -> GoalStatus:
        """How it stands; CANCELING once somebody has asked for that."""

    def send_feedback(self, feedback: F_contra) -> None:
        """Tell how it goes; of what is told and not yet heard, the newest stays."""

    def set_result(self, status: GoalStatus, result: R_contra) -> None:
        """Give the result; raises `BusError` where there is one already."""


class ClientGoal(Protocol[F_co, R_co]):
    """A goal as whoever wants it sees it."""

    @property
    def status(self) -> GoalStatus:
        """How it stands."""

    def feedback(self, timeout: float = 0.0) -> F_co | None:
        """How it goes, if that is newer than what was heard before."""

    def cancel(self) -> None:
        """Ask that it be given up; the result says whether it was."""

    def result(self, timeout: float) -> R_co:
        """The result; raises `NoServerError` where there is none within `timeout` seconds."""


class ActionServer(Protocol[G_co, F_contra, R_contra]):
    """One who pursues the goals of an action, one call after the other, in his own thread."""

    def next_goal(self, timeout: float = 0.0) -> ServerGoal[G_co, F_contra, R_contra] | None:
        """The next goal; None where there is none within `timeout` seconds."""

    def close(self) -> None:
        """Take no more goals, and abort those that are not over; safe to call twice."""


class PublisherFactory(Protocol):
    """Where messages can be published: a bus, or what keeps them."""

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> Publisher[M]:
        """A publisher on `topic`; latched: who comes later still gets the last message."""


class Bus(PublisherFactory, Protocol):
    """Where topics, services and actions meet by name; a name has one type."""

    def subscribe(self, topic: str, kind: type[M], *, depth: int = 10) -> Subscription[M]:
        """Listen on `topic`; of what is not taken the newest `depth` are kept."""

    def serve(
        self, service: str, kinds: tuple[type[Q], type[R]], answer: Callable[[Q], R]
    ) -> Callable[[], None]:
        """Answer `service`, in the thread of whoever asks, until what is returned is called."""

    def call(self, service: str, kinds: tuple[type[Q], type[R]], request: Q) -> R:
        """Ask `service`; raises `NoServerError` where nobody serves it."""

    def serve_action(
        self, action: str, kinds: tuple[type[G], type[F], type[R]], *, waiting: int = 10
    ) -> ActionServer[G, F, R]:
        """Pursue the goals of `action`; beyond `waiting` that were not taken, goals are refused."""

    def send_goal(self, action: str, kinds: tuple[type[G], type[F], type[R]], goal: G) -> ClientGoal[F, R]:
        """Want something of `action`; raises `NoServerError` where nobody pursues it."""

    def names(self) -> Mapping[str, str]:
        """Every name in use, with its type in ROS 2."""
