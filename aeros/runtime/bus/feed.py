"""Feed of a run to the bus: publishes its records and measurements from a thread of its own.

The run only puts items into a queue; the feed's thread makes messages of them and publishes them. So neither
a slow subscriber nor a broken bus delays or fails a run. When the queue is full, items are dropped and
counted: states first, records much later. Only a feed to a file that must be complete makes the run wait.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from queue import SimpleQueue
from types import MappingProxyType
from typing import Any, Final, NamedTuple, Self

from aeros.runtime.bus.message_publisher import MessagePublisher, RobotChain
from aeros.runtime.bus.port import PublisherFactory
from aeros.runtime.bus.robot_description import LinkVisual, without_meshes
from aeros.runtime.bus.viewer.view_publisher import ViewPublisher
from aeros.runtime.ports import CameraPicture, Hull, LinkModel, PersonFigure, Reading, Readings, RobotBody
from aeros.spec.model.site import Site

_MAX_STATES: Final = 1_000
"""Limit on the queue for states, about 4 s of control ticks."""

_MAX_RECORDS: Final = 10_000
"""Limit on the queue for records."""

_MAX_PICTURES: Final = 8
"""Limit on pictures that wait to be published: one of 640 × 480 pixels with depths takes about 1 MB."""

_POLL_INTERVAL_S: Final = 0.001  # s, while waiting for room

_CLOSE_TIMEOUT_S: Final = 5.0  # s, to publish what is in the queue
_CLOSE_TIMEOUT_TOTAL_S: Final = 60.0  # s, if the feed must be complete: for busy machines


class _State(NamedTuple):
    """Measurements to publish: `values` at time `now`; if `now` is None, readings with their own times."""

    now: float | None
    values: Mapping[str, Any]
    chain: RobotChain
    people: tuple[PersonFigure, ...]

    def readings(self) -> Readings:
        """Return each value with its time."""
        if self.now is None:
            return self.values
        return {
            name: value if type(value) is Reading else Reading(value, self.now)
            for name, value in self.values.items()
        }


class BusFeed:
    """Thread that publishes a run's records and measurements in order until it is closed.

    Attributes:
        lost: number of items dropped because the queue was full, and of messages that could not be made or
            published.
        trouble: the first reason for a loss; None if nothing was lost.
        locate_people: returns where the simulated people are; called with each measurement.
        body: the robot's body until a plan states it; None if it is unknown.

    Args:
        bus: bus to publish on.
        site: declares the state variables.
        is_whole: make the run wait for room in the queue, so that nothing is dropped.
        is_live: True for a bus with listeners that come and go; see `MessagePublisher`.
        cameras: names of cameras by perceiver; see `cameras_of_perceivers`.
        models: how viewers draw the robot's links, by hull.
        visuals: returns the meshes of a link for the robot's description, by its hull.
    """

    def __init__(
        self,
        bus: PublisherFactory,
        site: Site,
        *,
        is_whole: bool = False,
        is_live: bool = False,
        cameras: Mapping[str, Iterable[str]] = MappingProxyType({}),
        models: Mapping[Hull, LinkModel] = MappingProxyType({}),
        visuals: Callable[[Hull], Sequence[LinkVisual]] = without_meshes,
    ) -> None:
        self.locate_people: Callable[[], tuple[PersonFigure, ...]] = tuple
        self.body: RobotBody | None = None
        self._is_whole = is_whole
        self.lost = 0
        self.trouble: str | None = None
        self._publishers = (
            MessagePublisher(bus, site, self._count_dropped, is_live=is_live, visuals=visuals),
            ViewPublisher(bus, site, self._count_dropped, cameras, models),
        )
        self._queue: SimpleQueue[bytes | _State | CameraPicture | None] = SimpleQueue()
        self._picture_room = threading.Semaphore(_MAX_PICTURES)
        self._thread = threading.Thread(target=self._publish_loop, name="aeros-feed", daemon=True)
        self._thread.start()

    # Called by the run; these wait only if the feed must be complete.

    def on_record(self, line: bytes) -> None:
        """Publish a record; pass this method to `AuditLog` as its listener.

        Args:
            line: line of the audit log.
        """
        self._enqueue(line, _MAX_RECORDS)

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """Implement `MeasurementListener.on_tick`."""
        self._enqueue(self._state(now, values, chain), _MAX_STATES)

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """Implement `MeasurementListener.on_observed`."""
        self._enqueue(self._state(None, readings, chain), _MAX_STATES)

    def on_picture(self, picture: CameraPicture) -> None:
        """Implement `PictureListener.on_picture`."""
        if self._has_room(lambda: self._picture_room.acquire(blocking=False)):
            self._queue.put(picture)

    def close(self) -> None:
        """Publish what is still in the queue, for some seconds at most, and stop; safe to call twice."""
        self._queue.put(None)
        patience = _CLOSE_TIMEOUT_TOTAL_S if self._is_whole else _CLOSE_TIMEOUT_S
        self._thread.join(patience)
        if self._thread.is_alive():
            self._count_dropped(f"not everything was published within {patience:g} s")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _state(self, now: float | None, values: Mapping[str, Any], chain: RobotChain) -> _State:
        known = chain if chain.body is not None else chain._replace(body=self.body)
        return _State(now, dict(values), known, self.locate_people())

    def _enqueue(self, item: bytes | _State, max_count: int) -> None:
        if self._has_room(lambda: self._queue.qsize() < max_count):
            self._queue.put(item)

    def _has_room(self, is_free: Callable[[], bool]) -> bool:
        """Tell if there is room for an item; wait for it if the feed must be complete, else count a loss."""
        while not (has_room := is_free()) and self._is_whole and self._thread.is_alive():
            time.sleep(_POLL_INTERVAL_S)
        if not has_room:
            self._count_dropped("the bus is slower than the run")
        return has_room

    def _count_dropped(self, reason: str) -> None:
        self.lost += 1
        self.trouble = self.trouble or reason

    # Runs in the feed's own thread.

    def _publish_loop(self) -> None:
        while (item := self._queue.get()) is not None:
            if isinstance(item, CameraPicture):
                self._picture_room.release()
                for publisher in self._publishers:
                    publisher.publish_picture(item)
            elif isinstance(item, bytes):
                for publisher in self._publishers:
                    publisher.publish_record(item)
            else:
                readings = item.readings()
                for publisher in self._publishers:
                    publisher.publish_state(readings, item.chain)
                self._publishers[1].publish_people(readings, item.people)
