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

from aeros.runtime.bus.message_publisher import Chain, Telling
from aeros.runtime.bus.port import Publishing
from aeros.runtime.ports import Reading, Readings
from aeros.spec.model.model import Site

_MOST_STATES: Final = 1_000
"""States in the queue, about 4 s of control ticks, beyond which no further one is taken."""

_MOST_RECORDS: Final = 10_000
"""Items in the queue beyond which no further record is taken."""

_PAUSE: Final = 0.001  # s, until room is looked for again

_PATIENCE: Final = 5.0  # s, for what is still in the queue at the end
_PATIENCE_WHOLE: Final = 60.0  # s, where it is to be whole: on a busy machine too


class _State(NamedTuple):
    """`values` measured at `now`; where that is None, readings with their own times."""

    now: float | None
    values: Mapping[str, Any]
    chain: Chain


class Feed:
    """Publishes what it is given, in order, until it is closed.

    site: whose vocabulary is spoken.
    is_whole: whether whoever runs waits for room in the queue, so that nothing is lost for want of it.
    lost: items that the queue had no room for, and messages that could not be made or published;
        `trouble` is the first reason.
    """

    def __init__(self, bus: Publishing, site: Site, *, is_whole: bool = False) -> None:
        self._is_whole = is_whole
        self.lost = 0
        self.trouble: str | None = None
        self._telling = Telling(bus, site, self._miss)
        self._queue: SimpleQueue[bytes | _State | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._tell, name="aeros-feed", daemon=True)
        self._thread.start()

    # Called by the run, which waits for nothing here unless all of it is to be kept.

    def record(self, line: bytes) -> None:
        """A record of the audit log; to be its listener."""
        self._put(line, _MOST_RECORDS)

    def tick(self, now: float, values: Mapping[str, Any], chain: Chain) -> None:
        """What was measured at `now`, by vocabulary name, SI."""
        self._put(_State(now, dict(values), chain), _MOST_STATES)

    def observed(self, readings: Readings, chain: Chain) -> None:
        """What was measured, each value at its own time."""
        self._put(_State(None, dict(readings), chain), _MOST_STATES)

    def close(self) -> None:
        """Say what is in the queue, for some seconds at most, and nothing more; safe to call twice."""
        self._queue.put(None)
        patience = _PATIENCE_WHOLE if self._is_whole else _PATIENCE
        self._thread.join(patience)
        if self._thread.is_alive():
            self._miss(f"not all was said within {patience:g} s")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _put(self, item: bytes | _State, most: int) -> None:
        while self._is_whole and self._queue.qsize() >= most and self._thread.is_alive():
            time.sleep(_PAUSE)
        if self._queue.qsize() < most:
            self._queue.put(item)
        else:
            self._miss("the bus is slower than the run")

    def _miss(self, why: str) -> None:
        self.lost += 1
        self.trouble = self.trouble or why

    # In the feed's own thread.

    def _tell(self) -> None:
        while (item := self._queue.get()) is not None:
            if isinstance(item, bytes):
                self._telling.record(item)
            elif item.now is None:
                self._telling.state(item.values, item.chain)
            else:
                readings = {
                    name: value if type(value) is Reading else Reading(value, item.now)
                    for name, value in item.values.items()
                }
                self._telling.state(readings, item.chain)
