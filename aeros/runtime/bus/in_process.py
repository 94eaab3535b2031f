"""The bus within one process: queues under one lock, and no thread of its own."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final, Generic, TypeVar

import msgspec

from aeros.runtime.bus.messages import Message
from aeros.runtime.bus.names import check_ros_name
from aeros.runtime.bus.port import BusError, F, G, GoalStatus, M, NoServerError, Q, R

_T = TypeVar("_T")
_LEAST: Final = 1


class InProcessBus:
    """Implements `port.Bus`; safe to use from several threads.

    A message is checked when it is given, every field of it: nobody reads one that ROS 2 could not carry.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._kinds: dict[str, tuple[type[Message], ...]] = {}
        self._listening: dict[str, list[_Subscription[Any]]] = {}
        self._latched: dict[str, Message] = {}
        self._services: dict[str, Callable[[Any], Any]] = {}
        self._actions: dict[str, _ActionServer[Any, Any, Any]] = {}

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> _Publisher[M]:
        """See `Bus`."""
        self._register_name(topic, (kind,))
        return _Publisher(self, topic, kind, latched)

    def subscribe(self, topic: str, kind: type[M], *, depth: int = 10) -> _Subscription[M]:
        """See `Bus`."""
        self._register_name(topic, (kind,))
        made: _Subscription[Any] = _Subscription(self, topic, max(depth, _LEAST))
        with self._changed:
            self._listening.setdefault(topic, []).append(made)
            last = self._latched.get(topic)
            if last is not None:
                made.enqueue(last)
        return made

    def serve(
        self, service: str, kinds: tuple[type[Q], type[R]], answer: Callable[[Q], R]
    ) -> Callable[[], None]:
        """See `Bus`."""
        self._register_name(service, kinds)
        with self._changed:
            if service in self._services:
                raise BusError(f"`{service}` is served already")
            self._services[service] = answer
        return lambda: self._remove(self._services, service, answer)

    def call(self, service: str, kinds: tuple[type[Q], type[R]], request: Q) -> R:
        """See `Bus`."""
        self._register_name(service, kinds)
        asked, answered = kinds
        with self._changed:
            answer = self._services.get(service)
        if answer is None:
            raise NoServerError(f"nobody serves `{service}`")
        given: R = answer(check_message(request, asked))
        return check_message(given, answered)

    def serve_action(
        self, action: str, kinds: tuple[type[G], type[F], type[R]], *, waiting: int = 10
    ) -> _ActionServer[G, F, R]:
        """See `Bus`."""
        self._register_name(action, kinds)
        made = _ActionServer(self, action, kinds, waiting)
        with self._changed:
            if action in self._actions:
                raise BusError(f"`{action}` is pursued already")
            self._actions[action] = made
        return made

    def send_goal(self, action: str, kinds: tuple[type[G], type[F], type[R]], goal: G) -> _Goal[G, F, R]:
        """See `Bus`."""
        self._register_name(action, kinds)
        wanted = _Goal(self, kinds, check_message(goal, kinds[0]))
        with self._changed:
            server = self._actions.get(action)
            if server is None:
                raise NoServerError(f"nobody pursues `{action}`")
            server.accept(wanted)
            self._changed.notify_all()
        return wanted

    def names(self) -> Mapping[str, str]:
        """See `Bus`."""
        with self._changed:
            return {name: kinds[0].ros for name, kinds in sorted(self._kinds.items())}

    # What the parts of a bus share.

    def deliver(self, topic: str, message: Message, *, latched: bool) -> None:
        """Put `message` into the queue of everybody who listens."""
        with self._changed:
            if latched:
                self._latched[topic] = message
            for one in self._listening.get(topic, ()):
                one.enqueue(message)
            self._changed.notify_all()

    def wait_until(self, condition: Callable[[], _T | None], timeout: float) -> _T | None:
        """What `condition` finds, looked for under the lock whenever something changes, for `timeout` seconds."""
        latest = time.monotonic() + timeout
        with self._changed:
            while (found := condition()) is None:
                left = latest - time.monotonic()
                if left <= 0 or not self._changed.wait(left):
                    return condition()
            return found

    def update(self, make: Callable[[], None]) -> None:
        """Make a change under the lock, and let those who wait look."""
        with self._changed:
            make()
            self._changed.notify_all()

    def unsubscribe(self, listener: _Subscription[Any]) -> None:
        """It listens no more."""
        with self._changed:
            listening = self._listening.get(listener.topic, [])
            self._listening[listener.topic] = [one for one in listening if one is not listener]

    def stop_server(self, server: _ActionServer[Any, Any, Any]) -> None:
        """It pursues no more."""
        self._remove(self._actions, server.action, server)

    def _remove(self, offered: dict[str, _T], name: str, participant: _T) -> None:
        with self._changed:
            if offered.get(name) is participant:
                del offered[name]

    def _register_name(self, name: str, kinds: tuple[type[Message], ...]) -> None:
        """The name is one, and of these types."""
        try:
            check_ros_name(name)
        except ValueError as wrong:
            raise BusError(str(wrong)) from wrong
        with self._changed:
            other = self._kinds.setdefault(name, kinds)
        if other != kinds:
            raise BusError(f"`{name}` is of type {other[0].ros}, and not {kinds[0].ros}")


def check_message(message: M, kind: type[M]) -> M:
    """`message`, if it is of that very type and each of its fields of its own; else raises `BusError`."""
    if type(message) is not kind:
        raise BusError(f"a {kind.ros} is asked for, and this is a {type(message).__name__}")
    try:
        return msgspec.convert(msgspec.to_builtins(message), kind)
    except (msgspec.ValidationError, TypeError, OverflowError, ValueError) as wrong:
        raise BusError(f"this is no {kind.ros}: {wrong}") from wrong


class _Publisher(Generic[M]):
    def __init__(self, bus: InProcessBus, topic: str, kind: type[M], latched: bool) -> None:
        self._bus, self._topic, self._kind, self._latched = bus, topic, kind, latched

    def publish(self, message: M) -> None:
        """See `port.Publisher`."""
        self._bus.deliver(self._topic, check_message(message, self._kind), latched=self._latched)


class _Subscription(Generic[M]):
    def __init__(self, bus: InProcessBus, topic: str, depth: int) -> None:
        self.topic = topic
        self.dropped_count = 0
        self._bus = bus
        self._queue: deque[M] = deque(maxlen=depth)

    def enqueue(self, message: M) -> None:
        """Queue it; under the lock of the bus."""
        self.dropped_count += len(self._queue) == self._queue.maxlen
        self._queue.append(message)

    def receive(self, timeout: float = 0.0) -> M | None:
        """See `port.Subscription`."""
        return self._bus.wait_until(lambda: self._queue.popleft() if self._queue else None, timeout)

    def close(self) -> None:
        """See `port.Subscription`."""
        self._bus.unsubscribe(self)


class _Goal(Generic[G, F, R]):
    """Both ends of a goal: `port.ServerGoal` and `port.ClientGoal`."""

    def __init__(self, bus: InProcessBus, kinds: tuple[type[G], type[F], type[R]], goal: G) -> None:
        self.goal = goal
        self.status = GoalStatus.ACCEPTED
        self._bus = bus
        self._kinds = kinds
        self._told: F | None = None
        self._result: R | None = None

    def send_feedback(self, feedback: F) -> None:
        """See `port.ServerGoal`."""
        told = check_message(feedback, self._kinds[1])

        def change() -> None:
            self._told = told

        self._bus.update(change)

    def set_result(self, status: GoalStatus, result: R) -> None:
        """See `port.ServerGoal`."""
        given = check_message(result, self._kinds[2])
        if not status.is_over:
            raise BusError(f"{status.name} is no end")

        def change() -> None:
            if self.status.is_over:
                raise BusError(f"it is {self.status.name} already")
            self.status, self._result = status, given

        self._bus.update(change)

    def cancel(self) -> None:
        """See `port.ClientGoal`."""

        def change() -> None:
            if not self.status.is_over:
                self.status = GoalStatus.CANCELING

        self._bus.update(change)

    def feedback(self, timeout: float = 0.0) -> F | None:
        """See `port.ClientGoal`."""

        def heard() -> F | None:
            told, self._told = self._told, None
            return told

        return self._bus.wait_until(heard, timeout)

    def result(self, timeout: float) -> R:
        """See `port.ClientGoal`."""
        found = self._bus.wait_until(lambda: self._result, timeout)
        if found is None:
            raise NoServerError(f"there is no result after {timeout:g} s; it is {self.status.name}")
        return found

    def mark_executing(self) -> None:
        """It has been taken; under the lock of the bus."""
        if self.status is GoalStatus.ACCEPTED:
            self.status = GoalStatus.EXECUTING

    def abort(self) -> None:
        """Nobody pursues it any more; under the lock of the bus."""
        if not self.status.is_over:
            self.status, self._result = GoalStatus.ABORTED, self._kinds[2]()


class _ActionServer(Generic[G, F, R]):
    def __init__(
        self, bus: InProcessBus, action: str, kinds: tuple[type[G], type[F], type[R]], waiting: int
    ) -> None:
        self.action = action
        self._bus = bus
        self._kinds = kinds
        self._most = waiting
        self._waiting: deque[_Goal[G, F, R]] = deque()
        self._taken: list[_Goal[G, F, R]] = []

    def accept(self, goal: _Goal[G, F, R]) -> None:
        """Queue it; under the lock of the bus."""
        if len(self._waiting) >= self._most:
            raise BusError(f"`{self.action}` has {self._most} goals waiting already")
        self._waiting.append(goal)

    def next_goal(self, timeout: float = 0.0) -> _Goal[G, F, R] | None:
        """See `port.ActionServer`."""

        def next_one() -> _Goal[G, F, R] | None:
            if not self._waiting:
                return None
            goal = self._waiting.popleft()
            goal.mark_executing()
            self._taken = [one for one in self._taken if not one.status.is_over] + [goal]
            return goal

        return self._bus.wait_until(next_one, timeout)

    def close(self) -> None:
        """See `port.ActionServer`."""
        self._bus.stop_server(self)

        def abort() -> None:
            for goal in (*self._waiting, *self._taken):
                goal.abort()
            self._waiting.clear()

        self._bus.update(abort)
