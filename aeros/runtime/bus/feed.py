"""What a run says on the bus: its records and what it measures.

Whoever runs only puts into a queue what there is to say, and goes on; a thread of the feed's own makes
messages of it and publishes them.  So neither a slow subscriber nor a broken bus delays or fails a run.
What the queue has no room for is lost, and counted: states first, records much later.  Only what is to be a
whole file of the run is waited for.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping
from queue import SimpleQueue
from typing import Any, Final, NamedTuple, Self

from aeros.runtime.bus.message_publisher import MessagePublisher, RobotChain
from aeros.runtime.bus.port import PublisherFactory
from aeros.runtime.ports import Reading, Readings
from aeros.spec.model.model import Site

_MAX_STATES: Final = 1_000
"""States in the queue, about 4 s of control ticks, beyond which no further one is taken."""

_MAX_RECORDS: Final = 10_000
"""Items in the queue beyond which no further record is taken."""

_POLL_INTERVAL_S: Final = 0.001  # s, until room is looked for again

_CLOSE_TIMEOUT_S: Final = 5.0  # s, for what is still in the queue at the end
_CLOSE_TIMEOUT_TOTAL_S: Final = 60.0  # s, where it is to be whole: on a busy machine too


class _State(NamedTuple):
    """`values` measured at `now`; where that is None, readings with their own times."""

    now: float | None
    values: Mapping[str, Any]
    chain: RobotChain


class BusFeed:
    """Publishes what it is given, in order, until it is closed.

    site: whose vocabulary is spoken.
    is_whole: whether whoever runs waits for room in the queue, so that nothing is lost for want of it.
    lost: items that the queue had no room for, and messages that could not be made or published;
        `trouble` is the first reason.
    """

    def __init__(self, bus: PublisherFactory, site: Site, *, is_whole: bool = False) -> None:
        self._is_whole = is_whole
        self.lost = 0
        self.trouble: str | None = None
        self._telling = MessagePublisher(bus, site, self._count_dropped)
        self._queue: SimpleQueue[bytes | _State | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._publish_loop, name="aeros-feed", daemon=True)
        self._thread.start()

    # Called by the run, which waits for nothing here unless all of it is to be kept.

    def on_record(self, line: bytes) -> None:
        """A record of the audit log; to be its listener."""
        self._enqueue(line, _MAX_RECORDS)

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """What was measured at `now`, by vocabulary name, SI."""
        self._enqueue(_State(now, dict(values), chain), _MAX_STATES)

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """What was measured, each value at its own time."""
        self._enqueue(_State(None, dict(readings), chain), _MAX_STATES)

    def close(self) -> None:
        """Say what is in the queue, for some seconds at most, and nothing more; safe to call twice."""
        self._queue.put(None)
        patience = _CLOSE_TIMEOUT_TOTAL_S if self._is_whole else _CLOSE_TIMEOUT_S
        self._thread.join(patience)
        if self._thread.is_alive():
            self._count_dropped(f"not all was said within {patience:g} s")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _enqueue(self, item: bytes | _State, max_count: int) -> None:
        while self._is_whole and self._queue.qsize() >= max_count and self._thread.is_alive():
            time.sleep(_POLL_INTERVAL_S)
        if self._queue.qsize() < max_count:
            self._queue.put(item)
        else:
            self._count_dropped("the bus is slower than the run")

    def _count_dropped(self, reason: str) -> None:
        self.lost += 1
        self.trouble = self.trouble or reason

    # In the feed's own thread.

    def _publish_loop(self) -> None:
        while (item := self._queue.get()) is not None:
            if isinstance(item, bytes):
                self._telling.publish_record(item)
            elif item.now is None:
                self._telling.publish_state(item.values, item.chain)
            else:
                readings = {
                    name: value if type(value) is Reading else Reading(value, item.now)
                    for name, value in item.values.items()
                }
                self._telling.publish_state(readings, item.chain)
