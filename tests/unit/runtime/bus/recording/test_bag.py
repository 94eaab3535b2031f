"""A bag holds what was published, readable by what reads ROS 2's bags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest
from rosbags.rosbag2 import Reader

from aeros.runtime.bus.messages import (
    BoolStamped,
    DecisionMessage,
    Event,
    Float64Stamped,
    Header,
    JointState,
    Message,
    Point,
    PointStamped,
    StringStamped,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)
from aeros.runtime.bus.recording.bag import Bag, BagError, McapFile
from tests.unit.runtime.bus.test_messages import STORE, plain

WHEN = Time(3, 250_000_000)
PUBLISHED: list[tuple[str, Message]] = [
    ("/joint_states", JointState(Header(WHEN), ("a", "b"), (1.0, 2.0), (), (0.5, -0.5))),
    ("/aeros/state/hand", PointStamped(Header(WHEN, "world"), Point(1.0, 2.0, 3.0))),
    ("/aeros/state/open", BoolStamped(Header(WHEN), True)),
    ("/aeros/state/gap", Float64Stamped(Header(WHEN), 0.25)),
    ("/aeros/state/cell", StringStamped(Header(WHEN), "left")),
    ("/aeros/events", Event(WHEN, 7, "note", '{"a":"ü"}')),
    ("/aeros/decisions", DecisionMessage(WHEN, 8, "m", "s", "DENY", "null", "[]")),
    (
        "/tf",
        TFMessage((TransformStamped(Header(WHEN, "base"), "a_link", Transform(Vector3(1.0, 0.0, 0.0))),)),
    ),
]


@pytest.mark.parametrize(("container", "name"), [(Bag, "bag"), (McapFile, "run.mcap")])
def test_published_messages_are_read_back_unchanged(container: type[Bag], name: str, tmp_path: Path) -> None:
    with container(tmp_path / name) as bag:
        for topic, message in PUBLISHED:
            bag.publisher(topic, type(message)).publish(message)
    found: list[tuple[str, Message]] = []
    kinds = {message.ros: type(message) for _, message in PUBLISHED}
    assert [path.name for path in tmp_path.iterdir()] == [name]
    with Reader(tmp_path / name) as reader:
        for connection, time, data in reader.messages():
            assert time == 3_250_000_000
            there: Any = STORE.deserialize_cdr(data, connection.msgtype)
            found.append((connection.topic, msgspec.convert(plain(there), kinds[connection.msgtype])))
        own = {connection.msgtype: connection.msgdef.data for connection in reader.connections}
    assert sorted(found, key=lambda one: one[0]) == sorted(PUBLISHED, key=lambda one: one[0])
    assert "string verdict" in own["aeros_msgs/msg/Decision"]


def test_several_publish_on_one_topic(tmp_path: Path) -> None:
    with Bag(tmp_path / "bag") as bag:
        for second in (1, 2):
            bag.publisher("/aeros/events", Event).publish(Event(Time(second), second, "note", "{}"))
    with Reader(tmp_path / "bag") as reader:
        assert [(one.topic, one.msgcount) for one in reader.connections] == [("/aeros/events", 2)]
        assert reader.duration == 10**9 + 1


def test_a_message_without_a_time_is_kept_at_the_beginning(tmp_path: Path) -> None:
    with Bag(tmp_path / "bag") as bag:
        bag.publisher("/tf", TFMessage).publish(TFMessage())
    with Reader(tmp_path / "bag") as reader:
        assert [time for _, time, _ in reader.messages()] == [0]


def test_a_folder_that_is_there_is_not_written_to(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r"a bag cannot be created in `.*`: .* exists already"):
        Bag(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_not_there_before_it_is_whole(tmp_path: Path) -> None:
    bag = McapFile(tmp_path / "run.mcap")
    bag.publisher("/tf", TFMessage).publish(TFMessage())
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap.part"]
    bag.close()
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


@pytest.mark.parametrize("there", ["run.mcap", "run.mcap.part"])
def test_an_existing_or_partly_written_file_is_not_overwritten(there: str, tmp_path: Path) -> None:
    (tmp_path / there).mkdir()
    with pytest.raises(BagError, match="exists already"):
        McapFile(tmp_path / "run.mcap")
    assert [path.name for path in tmp_path.iterdir()] == [there]
