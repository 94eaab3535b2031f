"""Bus within one process: queues under one lock, with no thread of its own."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final, Generic, TypeVar

import msgspec

from aeros.runtime.bus.messages import Message
from aeros.runtime.bus.names import check_ros_name
from aeros.runtime.bus.port import BusError, F, G, GoalStatus, M, NoServerError, Q, R, Requester

_T = TypeVar("_T")
_MIN_DEPTH: Final = 1


class InProcessBus:
    """Bus within one process; implements `port.Bus`. Thread-safe.

    Every field of a message is checked when it is published, so nobody receives one that ROS 2 could not
    carry.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._kinds: dict[str, tuple[type[Message], ...]] = {}
        self._listening: dict[str, list[_Subscription[Any]]] = {}
        self._latched: dict[str, Message] = {}
        self._services: dict[str, Callable[[Any], Any]] = {}
        self._actions: dict[str, _ActionServer[Any, Any, Any]] = {}

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> _Publisher[M]:
        """Implement `Bus.publisher`."""
        self._register_name(topic, (kind,))
        return _Publisher(self, topic, kind, latched)

    def subscribe(self, topic: str, kind: type[M], *, depth: int = 10) -> _Subscription[M]:
        """Implement `Bus.subscribe`."""
        self._register_name(topic, (kind,))
        subscription: _Subscription[Any] = _Subscription(self, topic, max(depth, _MIN_DEPTH))
        with self._changed:
            self._listening.setdefault(topic, []).append(subscription)
            last = self._latched.get(topic)
            if last is not None:
                subscription.enqueue(last)
        return subscription

    def serve(
        self, service: str, kinds: tuple[type[Q], type[R]], answer: Callable[[Q], R]
    ) -> Callable[[], None]:
        """Implement `Bus.serve`.

        Raises:
            BusError: the service has a server already.
        """
        self._register_name(service, kinds)
        with self._changed:
            if service in self._services:
                raise BusError(f"`{service}` has a server already")
            self._services[service] = answer
        return lambda: self._remove(self._services, service, answer)

    def call(self, service: str, kinds: tuple[type[Q], type[R]], request: Q) -> R:
        """Implement `Bus.call`.

        Raises:
            NoServerError: no server offers the service.
        """
        self._register_name(service, kinds)
        request_type, response_type = kinds
        with self._changed:
            answer = self._services.get(service)
        if answer is None:
            raise NoServerError(f"no server offers the service `{service}`")
        response: R = answer(check_message(request, request_type))
        return check_message(response, response_type)

    def serve_action(
        self, action: str, kinds: tuple[type[G], type[F], type[R]], *, waiting: int = 10
    ) -> _ActionServer[G, F, R]:
        """Implement `Bus.serve_action`.

        Raises:
            BusError: the action has a server already.
        """
        self._register_name(action, kinds)
        server = _ActionServer(self, action, kinds, waiting)
        with self._changed:
            if action in self._actions:
                raise BusError(f"`{action}` has a server already")
            self._actions[action] = server
        return server

    def send_goal(self, action: str, kinds: tuple[type[G], type[F], type[R]], goal: G) -> _Goal[G, F, R]:
        """Implement `Bus.send_goal`.

        Raises:
            NoServerError: no server offers the action.
        """
        self._register_name(action, kinds)
        new_goal = _Goal(self, kinds, check_message(goal, kinds[0]))
        with self._changed:
            server = self._actions.get(action)
            if server is None:
                raise NoServerError(f"no server offers the action `{action}`")
            server.accept(new_goal)
            self._changed.notify_all()
        return new_goal

    def requesters(self, service: str) -> tuple[Requester, ...]:
        """Implement `ServingBus.requesters`: every caller is in this process."""
        return ()

    def names(self) -> Mapping[str, str]:
        """Implement `Bus.names`."""
        with self._changed:
            return {name: kinds[0].ros for name, kinds in sorted(self._kinds.items())}

    # Called by publishers, subscriptions, goals and servers of this bus.

    def deliver(self, topic: str, message: Message, *, latched: bool) -> None:
        """Put a message into the queue of every subscription of a topic.

        Args:
            topic: name of the topic.
            message: checked message.
            latched: keep it for later subscriptions too.
        """
        with self._changed:
            if latched:
                self._latched[topic] = message
            for subscription in self._listening.get(topic, ()):
                subscription.enqueue(message)
            self._changed.notify_all()

    def wait_until(self, condition: Callable[[], _T | None], timeout: float) -> _T | None:
        """Evaluate a condition under the lock after every change until it gives a result.

        Args:
            condition: returns a result, or None to wait for the next change.
            timeout: s of real time.

        Returns:
            The first result; None after the timeout.
        """
        latest = time.monotonic() + timeout
        with self._changed:
            while (result := condition()) is None:
                left = latest - time.monotonic()
                if left <= 0 or not self._changed.wait(left):
                    return condition()
            return result

    def update(self, make: Callable[[], None]) -> None:
        """Make a change under the lock and wake the waiting threads.

        Args:
            make: makes the change.
        """
        with self._changed:
            make()
            self._changed.notify_all()

    def unsubscribe(self, listener: _Subscription[Any]) -> None:
        """Remove a subscription.

        Args:
            listener: the subscription; may be removed already.
        """
        with self._changed:
            listening = self._listening.get(listener.topic, [])
            self._listening[listener.topic] = [one for one in listening if one is not listener]

    def stop_server(self, server: _ActionServer[Any, Any, Any]) -> None:
        """Remove an action server.

        Args:
            server: the action server; may be removed already.
        """
        self._remove(self._actions, server.action, server)

    def _remove(self, offered: dict[str, _T], name: str, participant: _T) -> None:
        with self._changed:
            if offered.get(name) is participant:
                del offered[name]

    def _register_name(self, name: str, kinds: tuple[type[Message], ...]) -> None:
        """Register a name with its message types.

        Raises:
            BusError: the name is invalid, or has other types.
        """
        try:
            check_ros_name(name)
        except ValueError as wrong:
            raise BusError(str(wrong)) from wrong
        with self._changed:
            other = self._kinds.setdefault(name, kinds)
        if other != kinds:
            raise BusError(f"`{name}` is of type {other[0].ros}, and not {kinds[0].ros}")


def check_message(message: M, kind: type[M]) -> M:
    """Check the type of a message and of each of its fields.

    Args:
        message: the message.
        kind: required type, exactly.

    Returns:
        A checked copy.

    Raises:
        BusError: the type of the message or of a field differs.
    """
    if type(message) is not kind:
        raise BusError(f"expected a {kind.ros}, got a {type(message).__name__}")
    try:
        return msgspec.convert(msgspec.to_builtins(message), kind)
    except (msgspec.ValidationError, TypeError, OverflowError, ValueError) as wrong:
        raise BusError(f"not a valid {kind.ros}: {wrong}") from wrong


class _Publisher(Generic[M]):
    def __init__(self, bus: InProcessBus, topic: str, kind: type[M], latched: bool) -> None:
        self._bus, self._topic, self._kind, self._latched = bus, topic, kind, latched

    def publish(self, message: M) -> None:
        """Implement `port.Publisher.publish`."""
        self._bus.deliver(self._topic, check_message(message, self._kind), latched=self._latched)


class _Subscription(Generic[M]):
    def __init__(self, bus: InProcessBus, topic: str, depth: int) -> None:
        self.topic = topic
        self.dropped_count = 0
        self._bus = bus
        self._queue: deque[M] = deque(maxlen=depth)

    def enqueue(self, message: M) -> None:
        """Queue a message; the caller holds the lock of the bus."""
        self.dropped_count += len(self._queue) == self._queue.maxlen
        self._queue.append(message)

    def receive(self, timeout: float = 0.0) -> M | None:
        """Implement `port.Subscription.receive`."""
        return self._bus.wait_until(lambda: self._queue.popleft() if self._queue else None, timeout)

    def close(self) -> None:
        """Implement `port.Subscription.close`."""
        self._bus.unsubscribe(self)


class _Goal(Generic[G, F, R]):
    """Both ends of a goal: implements `port.ServerGoal` and `port.ClientGoal`."""

    def __init__(self, bus: InProcessBus, kinds: tuple[type[G], type[F], type[R]], goal: G) -> None:
        self.goal = goal
        self.status = GoalStatus.ACCEPTED
        self.requesters: tuple[Requester, ...] = ()
        self._bus = bus
        self._kinds = kinds
        self._feedback: F | None = None
        self._result: R | None = None

    def send_feedback(self, feedback: F) -> None:
        """Implement `port.ServerGoal.send_feedback`."""
        checked = check_message(feedback, self._kinds[1])

        def change() -> None:
            self._feedback = checked

        self._bus.update(change)

    def set_result(self, status: GoalStatus, result: R) -> None:
        """Implement `port.ServerGoal.set_result`.

        Raises:
            BusError: the status does not end a goal, or the goal has ended.
        """
        checked = check_message(result, self._kinds[2])
        if not status.is_over:
            raise BusError(f"{status.name} does not end a goal")

        def change() -> None:
            if self.status.is_over:
                raise BusError(f"it is {self.status.name} already")
            self.status, self._result = status, checked

        self._bus.update(change)

    def cancel(self) -> None:
        """Implement `port.ClientGoal.cancel`."""

        def change() -> None:
            if not self.status.is_over:
                self.status = GoalStatus.CANCELING

        self._bus.update(change)

    def feedback(self, timeout: float = 0.0) -> F | None:
        """Implement `port.ClientGoal.feedback`."""

        def take_feedback() -> F | None:
            latest, self._feedback = self._feedback, None
            return latest

        return self._bus.wait_until(take_feedback, timeout)

    def result(self, timeout: float) -> R:
        """Implement `port.ClientGoal.result`.

        Raises:
            NoServerError: there was no result in time.
        """
        received = self._bus.wait_until(lambda: self._result, timeout)
        if received is None:
            raise NoServerError(f"there is no result after {timeout:g} s; it is {self.status.name}")
        return received

    def mark_executing(self) -> None:
        """Mark the goal as executing; the caller holds the lock of the bus."""
        if self.status is GoalStatus.ACCEPTED:
            self.status = GoalStatus.EXECUTING

    def abort(self) -> None:
        """Abort the goal unless it is over; the caller holds the lock of the bus."""
        if not self.status.is_over:
            self.status, self._result = GoalStatus.ABORTED, self._kinds[2]()


class _ActionServer(Generic[G, F, R]):
    def __init__(
        self, bus: InProcessBus, action: str, kinds: tuple[type[G], type[F], type[R]], waiting: int
    ) -> None:
        self.action = action
        self._bus = bus
        self._kinds = kinds
        self._max_waiting = waiting
        self._waiting: deque[_Goal[G, F, R]] = deque()
        self._accepted: list[_Goal[G, F, R]] = []

    def accept(self, goal: _Goal[G, F, R]) -> None:
        """Queue a goal; the caller holds the lock of the bus.

        Raises:
            BusError: too many goals wait already.
        """
        if len(self._waiting) >= self._max_waiting:
            raise BusError(f"`{self.action}` has {self._max_waiting} goals waiting already")
        self._waiting.append(goal)

    def next_goal(self, timeout: float = 0.0) -> _Goal[G, F, R] | None:
        """Implement `port.ActionServer.next_goal`."""

        def next_one() -> _Goal[G, F, R] | None:
            if not self._waiting:
                return None
            goal = self._waiting.popleft()
            goal.mark_executing()
            self._accepted = [one for one in self._accepted if not one.status.is_over] + [goal]
            return goal

        return self._bus.wait_until(next_one, timeout)

    def close(self) -> None:
        """Implement `port.ActionServer.close`."""
        self._bus.stop_server(self)

        def abort() -> None:
            for goal in (*self._waiting, *self._accepted):
                goal.abort()
            self._waiting.clear()

        self._bus.update(abort)
