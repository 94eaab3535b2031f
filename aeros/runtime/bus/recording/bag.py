"""Writers of ROS 2 bags and single MCAP files: publishers that store messages in ROS 2's own encoding.

With `cdr.py` the only importer of `rosbags`, which the extra `ros` provides.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final, Generic, Self

from rosbags.interfaces import Connection
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer, WriterError

from aeros.runtime.bus.cdr import CdrEncoder, plant_nanoseconds
from aeros.runtime.bus.messages import Message
from aeros.runtime.bus.port import M
from aeros.runtime.bus.recording.topic_choice import TopicChoice

_VERSION: Final = 9  # version of a bag's metadata: that of ROS 2 Jazzy

_ROUNDING_NS: Final = 1_000
"""Time by which a message may come early, ns: periods such as 1/240 s are no whole nanoseconds."""


class BagError(Exception):
    """The bag cannot be written; the message says why."""


class Bag:
    """ROS 2 bag in a new folder; implements `port.PublisherFactory`.

    Each message is stored under its own time stamp, on the plant's clock; one without a stamp under that of
    the message before it. Not thread-safe.

    A topic is in the bag from its first message on, so no topic is empty. Chunks are compressed with zstd.

    Args:
        folder: must not exist yet.
        choice: topics to keep; None to keep all.

    Raises:
        BagError: the folder cannot be created.
    """

    def __init__(self, folder: Path, choice: TopicChoice | None = None) -> None:
        self._encoder = CdrEncoder()
        self._choice = TopicChoice() if choice is None else choice
        self._topics: dict[str, Connection] = {}
        self._kept: dict[str, int] = {}
        """Time of the last message of each topic that has a greatest rate, ns."""
        self._latest = 0
        try:
            self._writer = Writer(folder, version=_VERSION, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except (OSError, WriterError) as failure:
            raise BagError(f"a bag cannot be created in `{folder}`: {failure}") from failure

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> _Recorder[M]:
        """Implement `PublisherFactory.publisher`; ignores `latched`."""
        return _Recorder(self, topic)

    def write_message(self, topic: str, message: Message) -> None:
        """Store a message, unless the choice of topics leaves it out.

        Args:
            topic: absolute ROS 2 name.
            message: of the topic's type.
        """
        when = plant_nanoseconds(message) or self._latest
        self._latest = max(self._latest, when)
        interval = self._choice.interval(topic)
        if interval is None:
            return
        if interval > 0.0:
            last = self._kept.get(topic)
            if last is not None and when < last + interval * 1e9 - _ROUNDING_NS:
                return
            self._kept[topic] = when
        if topic not in self._topics:
            self._topics[topic] = self._writer.add_connection(
                topic, message.ros, typestore=self._encoder.store
            )
        self._writer.write(self._topics[topic], when, self._encoder.encode(message))

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
        choice: topics to keep; None to keep all.

    Raises:
        BagError: the file exists, or the folder cannot be created.
    """

    def __init__(self, path: Path, choice: TopicChoice | None = None) -> None:
        if path.exists():
            raise BagError(f"`{path}` exists already")
        self._path = path
        self._parts = path.with_name(f"{path.name}.part")
        super().__init__(self._parts, choice)

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
