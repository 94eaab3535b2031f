"""Writers of ROS 2 bags and single MCAP files: publishers that store messages in ROS 2's own encoding.

The only importer of `rosbags`, which the extra `ros` provides.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final, Generic, Self, get_type_hints

import numpy as np
from msgspec.structs import replace
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from aeros.runtime.bus.messages import Message, Time
from aeros.runtime.bus.port import M

_AEROS_MESSAGES: Final = Path(__file__).parent / "aeros_msgs" / "msg"
_VERSION: Final = 9  # version of a bag's metadata: that of ROS 2 Jazzy


class BagError(Exception):
    """The bag cannot be written; the message says why."""


class Bag:
    """ROS 2 bag in a new folder; implements `port.PublisherFactory`.

    Each message is stored under its own time stamp, on the plant's clock. Not thread-safe.

    Args:
        folder: must not exist yet.

    Raises:
        BagError: the folder cannot be created.
    """

    def __init__(self, folder: Path) -> None:
        self._store = get_typestore(Stores.ROS2_HUMBLE)
        for path in sorted(_AEROS_MESSAGES.glob("*.msg")):
            text = path.read_text(encoding="utf-8")
            self._store.register(get_types_from_msg(text, f"aeros_msgs/msg/{path.stem}"))
        self._topics: dict[str, Connection] = {}
        try:
            self._writer = Writer(folder, version=_VERSION, storage_plugin=StoragePlugin.MCAP)
            self._writer.open()
        except (OSError, WriterError) as failure:
            raise BagError(f"a bag cannot be created in `{folder}`: {failure}") from failure

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> _Recorder[M]:
        """Implement `PublisherFactory.publisher`; ignores `latched`."""
        if topic not in self._topics:
            self._topics[topic] = self._writer.add_connection(topic, kind.ros, typestore=self._store)
        return _Recorder(self, topic)

    def write_message(self, topic: str, message: Message) -> None:
        """Store a message.

        Args:
            topic: one for which `publisher` was called.
            message: of the topic's type.
        """
        data = self._store.serialize_cdr(_to_numpy_fields(message), message.ros)
        self._writer.write(self._topics[topic], _nanoseconds(message), data)

    def close(self) -> None:
        """Finish the bag.

        Raises:
            BagError: it cannot be finished.
        """
        try:
            self._writer.close()
        except OSError as failure:
            raise BagError(f"the bag `{self._writer.path}` cannot be finished: {failure}") from failure

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class McapFile(Bag):
    """Bag in a single MCAP file that contains the definition of every message type.

    Until it is closed, messages are in the folder `FILE.part` next to it. So the file is either complete or
    missing; after a killed run the folder holds all but the newest messages.

    Args:
        path: the file; must not exist yet.

    Raises:
        BagError: the file exists, or the folder cannot be created.
    """

    def __init__(self, path: Path) -> None:
        if path.exists():
            raise BagError(f"`{path}` exists already")
        self._path = path
        self._parts = path.with_name(f"{path.name}.part")
        super().__init__(self._parts)

    def close(self) -> None:
        """Finish the file.

        Raises:
            BagError: it cannot be finished.
        """
        super().close()
        try:
            (self._parts / f"{self._parts.name}.mcap").replace(self._path)
            shutil.rmtree(self._parts)
        except OSError as failure:
            raise BagError(f"`{self._path}` cannot be finished: {failure}") from failure


class _Recorder(Generic[M]):
    def __init__(self, bag: Bag, topic: str) -> None:
        self._bag, self._topic = bag, topic

    def publish(self, message: M) -> None:
        """Implement `port.Publisher.publish`."""
        self._bag.write_message(self._topic, message)


def _to_numpy_fields(message: Message) -> Message:
    """Return `message` for `rosbags`, which reads fields of any object: number sequences as NumPy arrays."""
    numbers = {
        name: np.array(getattr(message, name), np.float64) for name in _number_sequence_fields(type(message))
    }
    return replace(message, **numbers) if numbers else message


@cache
def _number_sequence_fields(kind: type[Message]) -> frozenset[str]:
    """Return the names of fields that are sequences of numbers."""
    hints = get_type_hints(kind)
    return frozenset(name for name in kind.__struct_fields__ if hints[name] == tuple[float, ...])


def _nanoseconds(message: Message) -> int:
    """Return the first time stamp in the message, ns on the plant's clock; 0 if it has none.

    A late sensor's first value is older than the clock, and no file has negative times.
    """
    when = next(_stamps(message), Time())
    return max(0, when.sec * 10**9 + when.nanosec)


def _stamps(value: Any) -> Iterator[Time]:
    if isinstance(value, Time):
        yield value
    elif isinstance(value, Message):
        for name in value.__struct_fields__:
            yield from _stamps(getattr(value, name))
    elif isinstance(value, tuple):
        for part in value:
            yield from _stamps(part)
