"""A live view is read by an independent client, which finds what a recording has; it takes no requests."""

from __future__ import annotations

import json
import socket
import struct
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import msgspec
import pytest

from aeros.cli.main import main
from aeros.exit_codes import Exit
from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.bus.messages import Event, Message, String, Time
from aeros.runtime.ports import Reading
from tests.repo.tree import ROOT
from tests.unit.runtime.bench import configuration
from tests.unit.runtime.bus.recording.test_bag import PUBLISHED
from tests.unit.runtime.bus.test_messages import STORE, plain

foxglove = pytest.importorskip("foxglove", reason="the extra `live` is not installed")
websockets = pytest.importorskip("websockets", reason="another client of live views")


DESCRIBED = "/robot_description"


class Viewer:
    """A client that knows the protocol alone: it subscribes to all topics and keeps what it gets."""

    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self.server: dict[str, Any] = {}
        self.channels: dict[int, dict[str, Any]] = {}
        self.received: list[tuple[str, int, bytes]] = []
        self.is_subscribed = threading.Event()
        self.count = threading.Condition()
        self.thread = threading.Thread(target=self._read)
        self.thread.start()

    def _read(self) -> None:
        with suppress(websockets.ConnectionClosed):
            self._read_all()

    def _read_all(self) -> None:
        for message in self.connection:
            if isinstance(message, bytes):
                kind, subscription, when = struct.unpack_from("<BIQ", message)
                if kind == 1:
                    with self.count:
                        topic = self.channels[subscription]["topic"]
                        self.received.append((topic, when, message[13:]))
                        self.count.notify_all()
                continue
            text = json.loads(message)
            if text["op"] == "serverInfo":
                self.server = text
            elif text["op"] == "advertise":
                self._subscribe(text["channels"])

    def _subscribe(self, channels: list[dict[str, Any]]) -> None:
        self.channels |= {one["id"]: one for one in channels}
        wanted = [{"id": one["id"], "channelId": one["id"]} for one in channels]
        self.connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        self.is_subscribed.set()

    def wait_for(self, number: int) -> None:
        with self.count:
            assert self.count.wait_for(lambda: len(self.received) >= number, 20), self.received

    def messages(self) -> list[tuple[str, Message]]:
        """The messages in CDR, decoded as their channels say."""
        kinds = {message.ros: type(message) for _, message in [*PUBLISHED, ("", String())]}
        schemas = {one["topic"]: one["schemaName"] for one in self.channels.values()}
        encodings = {one["topic"]: one["encoding"] for one in self.channels.values()}
        found = []
        for topic, _, data in self.received:
            if encodings[topic] == "cdr":
                there: Any = STORE.deserialize_cdr(data, schemas[topic])
                found.append((topic, msgspec.convert(plain(there), kinds[schemas[topic]])))
        return found

    def decoded(self) -> list[tuple[str, Any]]:
        """All messages, decoded by the definitions that the server sent and by nothing else."""
        from mcap.records import Schema
        from mcap_ros2.decoder import DecoderFactory

        factory = DecoderFactory()
        decoders: dict[str, Any] = {}
        for number, one in self.channels.items():
            schema = Schema(number, one["schema"].encode(), one["schemaEncoding"], one["schemaName"])
            decoders[one["topic"]] = factory.decoder_for(one["encoding"], schema)
        return [(topic, decoders[topic](data)) for topic, _, data in self.received]

    def close(self) -> None:
        self.connection.close()
        self.thread.join(20)


@contextmanager
def viewing(url: str) -> Iterator[Viewer]:
    from websockets.sync.client import connect
    from websockets.typing import Subprotocol

    with connect(url, subprotocols=[Subprotocol("foxglove.sdk.v1")], max_size=None) as connection:
        viewer = Viewer(connection)
        try:
            assert viewer.is_subscribed.wait(20)
            yield viewer
        finally:
            viewer.close()


@contextmanager
def live_view() -> Iterator[tuple[Any, str]]:
    from aeros.runtime.bus.live_view import LiveView

    with LiveView("bench") as view:
        yield view, view.serve(0)


def test_a_published_message_is_received_with_its_definition_and_time() -> None:
    with live_view() as (view, url):
        view.publisher(DESCRIBED, String, latched=True).publish(String("<robot/>"))
        publishers = [view.publisher(topic, type(message)) for topic, message in PUBLISHED]
        with viewing(url) as viewer:
            viewer.wait_for(1)  # the latched text: the subscription is in effect
            for publisher, (_, message) in zip(publishers, PUBLISHED, strict=True):
                publisher.publish(message)
            viewer.wait_for(1 + len(PUBLISHED))
        expected = [*PUBLISHED, (DESCRIBED, String("<robot/>"))]
        assert sorted(viewer.messages(), key=lambda one: one[0]) == sorted(expected, key=lambda one: one[0])
        assert {when for topic, when, _ in viewer.received if topic != DESCRIBED} == {3_250_000_000}
        (decision,) = [one for one in viewer.channels.values() if one["topic"] == "/aeros/decisions"]
        assert (decision["schemaEncoding"], decision["encoding"]) == ("ros2msg", "cdr")
        assert "string verdict" in decision["schema"]


def test_later_clients_get_latched_messages_and_the_zones() -> None:
    with live_view() as (view, url):
        view.publisher(DESCRIBED, String, latched=True).publish(String("<robot/>"))
        view.publisher("/aeros/events", Event).publish(Event(Time(1), 1, "note", "{}"))
        site = configuration().site
        with BusFeed(view, site) as feed:
            feed.on_observed({"human_distance": Reading(3.0, 1.0)}, RobotChain())
        for _ in range(2):
            with viewing(url) as viewer:
                viewer.wait_for(2)
            (scene,) = [message for topic, message in viewer.decoded() if topic == "/aeros/scene"]
            assert {one.id for one in scene.entities} == set(site.volumes) != set()
            assert DESCRIBED in {topic for topic, _, _ in viewer.received}


def test_nobody_can_request_anything_and_only_this_host_can_connect() -> None:
    with live_view() as (view, url):
        view.publisher(DESCRIBED, String)
        with viewing(url) as viewer:
            check_that_it_is_read_only(viewer, url)


def check_that_it_is_read_only(viewer: Viewer, url: str) -> None:
    assert viewer.server["capabilities"] == []
    host, port = url.removeprefix("ws://").split(":")
    assert host == "127.0.0.1"
    other = socket.socket()
    with other:
        other.settimeout(1)
        address = socket.gethostbyname(socket.gethostname())
        if not address.startswith("127."):
            with pytest.raises(OSError, match=r"refused|timed out"):
                other.connect((address, int(port)))


def test_a_port_in_use_is_named() -> None:
    from aeros.runtime.bus.live_view import LiveView, LiveViewError

    with live_view() as (_, url):
        port = int(url.rpartition(":")[2])
        with pytest.raises(LiveViewError, match=f"cannot serve a live view at 127.0.0.1:{port}"):
            LiveView("bench").serve(port)


@pytest.mark.deep
@pytest.mark.parametrize(
    ("instruction", "plant", "module", "expected"),
    [
        ("make dumplings", "symbolic", "make_dumplings", {"/aeros/scene"}),
        (
            "clean the table",
            "kinematic",
            "clean_table",
            {
                "/aeros/scene",
                "/aeros/robot",
                "/aeros/things",
                "/aeros/camera/table_top/compressed",
                "/aeros/camera/table_top/annotations",
                "/aeros/bounds/measured/tool_speed",
                "/aeros/bounds/requested/move_tool/speed",
            },
        ),
    ],
)
def test_an_independent_client_finds_in_a_whole_run_what_the_recording_has(
    tmp_path: Path, instruction: str, plant: str, module: str, expected: set[str]
) -> None:
    from mcap.reader import make_reader

    state = str(tmp_path / "state")
    run = subprocess.Popen(
        [
            sys.executable, "-m", "aeros.cli.main", "run", instruction, "--plant", plant, "--seed", "7",
            "--ecms", f"ecms/{module}", "--state", state, "--out", str(tmp_path / "out"),
            "--mcap", str(tmp_path / "run.mcap"), "--live", "0",
        ],
        cwd=ROOT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert run.stdout is not None
    url = next(line for line in run.stdout if line.startswith("live")).split()[-1]
    # A pause holds the run, so that the client is there from then on.
    while main(["pause", "--state", state]) != Exit.SUCCESS:
        assert run.poll() is None
    with viewing(url) as viewer:
        viewer.wait_for(1)
        assert main(["resume", "--state", state]) == Exit.SUCCESS
        run.communicate(timeout=200)
    assert run.returncode == Exit.SUCCESS
    with (tmp_path / "run.mcap").open("rb") as file:
        messages = make_reader(file).iter_messages(log_time_order=False)
        recorded = [(channel.topic, message.data) for _, channel, message in messages]
    seen = [(topic, data) for topic, _, data in viewer.received]
    assert Counter(seen) <= Counter(recorded)
    for topic in {topic for topic, _ in recorded}:
        there, live = ([data for name, data in one if name == topic] for one in (recorded, seen))
        # Only what came before the client did is missing, of each topic.
        assert there[len(there) - len(live) :] == live, topic
    decoded = viewer.decoded()
    assert expected <= {topic for topic, _ in decoded}
    decisions = [message for topic, message in decoded if topic == "/aeros/decisions"]
    assert len(decisions) > 20
    check_what_viewers_draw(decoded)


def check_what_viewers_draw(decoded: list[tuple[str, Any]]) -> None:
    for topic, message in decoded:
        if topic == "/aeros/robot":
            assert all(one.models[0].data[:4] == b"glTF" for one in message.entities)
        if topic.endswith("/annotations"):
            assert len(message.circles) == len(message.texts)
    speeds = [message for topic, message in decoded if topic == "/aeros/bounds/measured/tool_speed"]
    assert all(not one.upper_rule or one.value <= one.upper for one in speeds)
