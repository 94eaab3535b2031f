"""Names of all topics that a recording can have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from aeros.runtime.bus.message_publisher import MessagePublisher
from aeros.runtime.bus.messages import Message
from aeros.runtime.bus.port import M
from aeros.runtime.bus.viewer.view_publisher import ViewPublisher
from aeros.spec.model.site import Site


class _TopicNames:
    """Bus that publishes nothing and knows the names of its topics."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> _TopicNames:
        """Implement `PublisherFactory.publisher`."""
        self.names.append(topic)
        return self

    def publish(self, message: Message) -> None:
        """Implement `Publisher.publish`."""


def topics_of(site: Site, cameras: Mapping[str, Iterable[str]]) -> tuple[str, ...]:
    """List the topics of a recording.

    Args:
        site: declares the state variables.
        cameras: names of cameras by perceiver; see `cameras_of_perceivers`.

    Returns:
        Their names, sorted.
    """
    bus = _TopicNames()
    MessagePublisher(bus, site, lambda _: None)
    ViewPublisher(bus, site, lambda _: None, cameras)
    return tuple(sorted(set(bus.names)))
