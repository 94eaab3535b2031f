"""Live view of a run: a WebSocket server on this host that Foxglove and other viewers read.

Topics carry the same CDR as a bag.  The server offers no services, no parameters and no topics for clients to
publish on, so nobody can request anything through it.

The only importer of `foxglove`, which the extra `live` provides.
"""

from __future__ import annotations

import threading
from typing import Final, Generic, Self

import foxglove
from foxglove.websocket import ChannelView, Client, ServerListener, WebSocketServer

from aeros.runtime.bus.cdr import CdrEncoder, plant_nanoseconds
from aeros.runtime.bus.messages import Message
from aeros.runtime.bus.port import M

HOST: Final = "127.0.0.1"

_BACKLOG: Final = 65_536
"""Messages that are kept for a slow client, some 4 s of a run; then the oldest are dropped."""


class LiveViewError(Exception):
    """The server cannot be started; the message says why."""


class LiveView:
    """Server of a live view; implements `port.PublisherFactory`.

    Latched messages, such as the robot's description and the scene, are sent again to each new client.

    Args:
        name: Name of the robot that viewers show.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._server: WebSocketServer | None = None
        self._encoder = CdrEncoder()
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._latched: dict[int, tuple[foxglove.Channel, bytes, int]] = {}
        self._lock = threading.Lock()
        self._latest = 0

    def serve(self, port: int) -> str:
        """Start the server, once all publishers are made: it may refuse a topic that is being made.

        Args:
            port: Port of 127.0.0.1; 0 for any free one.

        Returns:
            Address for viewers.

        Raises:
            LiveViewError: The port is in use.
        """
        try:
            self._server = foxglove.start_server(
                name=f"AEROS: {self._name}",
                host=HOST,
                port=port,
                capabilities=[],
                server_listener=_Subscriptions(self),
                context=self._context,
                message_backlog_size=_BACKLOG,
            )
        except (OSError, RuntimeError) as failure:
            raise LiveViewError(f"cannot serve a live view at {HOST}:{port}: {failure}") from failure
        return f"ws://{HOST}:{self._server.port}"

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> _LivePublisher[M]:
        """Implement `PublisherFactory.publisher`."""
        if topic not in self._channels:
            definition = self._encoder.definition(kind).encode()
            schema = foxglove.Schema(name=kind.ros, encoding="ros2msg", data=definition)
            self._channels[topic] = foxglove.Channel(
                topic, schema=schema, message_encoding="cdr", context=self._context
            )
        return _LivePublisher(self, self._channels[topic], is_latched=latched)

    def send(self, channel: foxglove.Channel, message: Message, *, is_latched: bool) -> None:
        """Send a message to the clients that subscribed.

        Args:
            channel: Channel of its topic.
            message: The message.
            is_latched: True to send it again to later clients.
        """
        data, when = bytes(self._encoder.encode(message)), plant_nanoseconds(message) or self._latest
        self._latest = max(self._latest, when)
        if is_latched:
            with self._lock:
                self._latched[channel.id()] = channel, data, when
        channel.log(data, log_time=when)

    def send_again(self, channel_id: int) -> None:
        """Send the latched message of a channel to a new client.

        Args:
            channel_id: Channel that a client has subscribed to.
        """
        with self._lock:
            kept = self._latched.get(channel_id)
        if kept is not None:
            channel, data, when = kept
            channel.log(data, log_time=when)

    def close(self) -> None:
        """Disconnect all clients; safe to call twice."""
        if self._server is not None:
            self._server.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _LivePublisher(Generic[M]):
    def __init__(self, view: LiveView, channel: foxglove.Channel, *, is_latched: bool) -> None:
        self._view, self._channel, self._is_latched = view, channel, is_latched

    def publish(self, message: M) -> None:
        """Implement `port.Publisher.publish`."""
        self._view.send(self._channel, message, is_latched=self._is_latched)


class _Subscriptions(ServerListener):
    """Listener to new subscriptions; it is called in a thread of the server."""

    def __init__(self, view: LiveView) -> None:
        self._view = view

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Implement `ServerListener.on_subscribe`."""
        self._view.send_again(channel.id)
