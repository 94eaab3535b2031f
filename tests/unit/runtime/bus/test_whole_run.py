"""A run that is published on the bus is the same run, and is published completely."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

import pytest

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.messages import (
    BoolStamped,
    DecisionMessage,
    Event,
    Float64Stamped,
    JointState,
    Message,
    PointStamped,
    TFMessage,
)
from aeros.runtime.bus.port import Bus, Subscription
from tests.unit.runtime.running_bus import wipe_the_table

_M = TypeVar("_M", bound=Message)
_ALL = 100_000


def every(heard: Subscription[_M]) -> Iterator[_M]:
    assert heard.dropped_count == 0
    while (message := heard.receive()) is not None:
        yield message


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Bus, dict[str, list[Message]], Path]:
    folder = tmp_path_factory.mktemp("run") / "published"
    bus = InProcessBus()
    kinds: dict[str, type[Message]] = {
        "/aeros/events": Event,
        "/aeros/decisions": DecisionMessage,
        "/joint_states": JointState,
        "/aeros/state/tool_position": PointStamped,
        "/tf": TFMessage,
    }
    listening = {topic: bus.subscribe(topic, kind, depth=_ALL) for topic, kind in kinds.items()}
    wipe_the_table(folder, bus)
    return bus, {topic: list(every(one)) for topic, one in listening.items()}, folder / "audit.jsonl"


def test_the_bus_changes_no_digest_of_the_run(tmp_path: Path) -> None:
    published = wipe_the_table(tmp_path / "published", InProcessBus())
    assert published == wipe_the_table(tmp_path / "unpublished", None)


def test_every_record_is_an_event_and_every_decision_one_too(
    run: tuple[Bus, dict[str, list[Message]], Path],
) -> None:
    _, heard, log = run
    records = [json.loads(line) for line in log.read_bytes().splitlines()]
    events = [one for one in heard["/aeros/events"] if isinstance(one, Event)]
    assert [(one.record, one.event, json.loads(one.details)) for one in events] == [
        (record["sequence"], record["event"], record["details"]) for record in records
    ]
    decided = [record for record in records if record["event"] == "decision"]
    decisions = [one for one in heard["/aeros/decisions"] if isinstance(one, DecisionMessage)]
    assert len(decisions) > 10
    for one, record in zip(decisions, decided, strict=True):
        details = record["details"]
        assert one.record == record["sequence"]
        assert (one.module, one.skill) == (details["module"], details["skill"])
        assert one.verdict == details["verdict"]
        assert json.loads(one.action) == details["decided"]
        assert json.loads(one.reasons) == details["reasons"]
        assert one.stamp.sec + one.stamp.nanosec / 1e9 == pytest.approx(details["time"], abs=1e-9)


def test_joints_and_positions_are_published_and_no_unknown_chain(
    run: tuple[Bus, dict[str, list[Message]], Path],
) -> None:
    bus, heard, _ = run
    assert heard["/tf"] == []  # the symbolic plant has no body
    assert len(heard["/joint_states"]) > 10
    for one in heard["/joint_states"]:
        assert isinstance(one, JointState)
        assert one.name == ("j1", "j2", "j3", "j4", "j5", "j6", "j7")
        assert [len(part) for part in (one.position, one.velocity, one.effort)] == [7, 7, 7]
    places = [one for one in heard["/aeros/state/tool_position"] if isinstance(one, PointStamped)]
    assert len({one.point for one in places}) > 3
    assert {one.header.frame_id for one in places} == {"world"}
    assert bus.names()["/aeros/state/base_position"] == PointStamped.ros
    assert bus.names()["/aeros/state/holding"] == BoolStamped.ros
    assert bus.names()["/aeros/state/tool_speed"] == Float64Stamped.ros


def test_a_listener_is_called_once_the_record_is_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    seen: list[tuple[bytes, bytes]] = []
    with AuditLog(path, listener=lambda line: seen.append((line, path.read_bytes()))) as audit:
        audit.append("note", {"a": 1})
        audit.append("note", {"a": 2})
    assert [line for line, _ in seen] == path.read_bytes().splitlines(keepends=True)
    assert all(file.endswith(line) for line, file in seen)
