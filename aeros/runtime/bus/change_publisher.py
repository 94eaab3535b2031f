"""Publisher that drops a message equal to the previous one, time stamp included."""

from __future__ import annotations

from typing import Generic

from aeros.runtime.bus.port import M, Publisher


class ChangePublisher(Generic[M]):
    """Publisher of changes.

    Args:
        publisher: publishes the messages that differ from the ones before them.
    """

    def __init__(self, publisher: Publisher[M]) -> None:
        self._publisher = publisher
        self._last: M | None = None

    def publish(self, message: M) -> None:
        """Publish a message unless it equals the previous one.

        Args:
            message: of the topic's type.
        """
        if message != self._last:
            self._last = message
            self._publisher.publish(message)
