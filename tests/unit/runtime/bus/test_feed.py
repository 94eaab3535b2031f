"""The feed: in order, in its own thread; the run neither waits for it nor fails with it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

from aeros.runtime.bus import feed as module
from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.bus.messages import CompressedImage, Event, Message, PointStamped, String
from aeros.runtime.bus.port import M
from aeros.runtime.bus.viewer.foxglove_messages import SceneUpdate
from aeros.runtime.ports import CameraPicture, CameraView, PersonFigure, Reading
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.unit.runtime.one_joint import PLAN, governed

KNOWN = RobotChain()
RECORD = b'{"details":{},"event":"note","sequence":3}\n'


class Odd:
    """Publishes by `publish`, whatever the topic."""

    def __init__(self, publish: Callable[[Message], None]) -> None:
        self._publish = publish

    def publisher(self, topic: str, kind: type[M], *, latched: bool = False) -> Odd:
        return self

    def publish(self, message: Message) -> None:
        self._publish(message)


def test_messages_come_in_order_and_equal_ones_once(site: Site) -> None:
    bus = InProcessBus()
    heard = bus.subscribe("/aeros/state/tool_position", PointStamped)
    with BusFeed(bus, site) as feed:
        feed.on_observed({"tool_position": Reading((1.0, 0.0, 0.0), 0.5)}, KNOWN)
        feed.on_tick(0.5, {"tool_position": (1.0, 0.0, 0.0)}, KNOWN)
        feed.on_tick(0.75, {"tool_position": (1.0, 0.0, 0.0), "holding": True}, KNOWN)
        feed.on_tick(1.0, {"tool_position": Reading((2.0, 0.0, 0.0), 0.875)}, KNOWN)
        feed.on_tick(1.25, {}, KNOWN)
    found = [heard.receive(), heard.receive(), heard.receive(), heard.receive()]
    assert [one and (one.header.stamp.nanosec, one.point.x) for one in found] == [
        (500_000_000, 1.0), (750_000_000, 1.0), (875_000_000, 2.0), None,
    ]  # fmt: skip
    assert (feed.lost, feed.trouble) == (0, None)


def test_people_are_located_in_the_thread_of_the_run_at_each_measurement(site: Site) -> None:
    bus = InProcessBus()
    heard = bus.subscribe("/aeros/people", SceneUpdate)
    located = []

    def locate() -> tuple[PersonFigure, ...]:
        located.append(threading.current_thread())
        return (PersonFigure(float(len(located)), 0.0, 0.0, 1.75, 0.25),)

    with BusFeed(bus, site) as feed:
        feed.locate_people = locate
        feed.on_tick(0.5, {"holding": True}, KNOWN)
        feed.on_observed({"holding": Reading(True, 1.0)}, KNOWN)
    assert located == [threading.current_thread()] * 2
    places = [one.entities[0].cylinders[0].pose.position.x for _ in range(2) if (one := heard.receive())]
    assert places == [1.0, 2.0]


def test_the_robot_is_described_before_its_first_plan(site: Site) -> None:
    bus = InProcessBus()
    heard = bus.subscribe("/robot_description", String)
    whole = governed(site, "move")
    with BusFeed(bus, whole) as feed:
        feed.on_observed({"joint_angle": Reading((0.0,), 1.0)}, KNOWN)
    assert heard.receive() is None
    with BusFeed(bus, whole) as feed:
        feed.body = PLAN.body
        feed.on_observed({"joint_angle": Reading((0.0,), 1.0)}, KNOWN)
    description = heard.receive()
    assert description is not None
    assert "<robot" in description.data


def test_a_record_without_a_time_is_stamped_with_the_newest_of_the_plant(site: Site) -> None:
    bus = InProcessBus()
    heard = bus.subscribe("/aeros/events", Event)
    with BusFeed(bus, site) as feed:
        feed.on_record(RECORD)
        feed.on_tick(4.0, {"holding": True}, KNOWN)
        feed.on_record(RECORD)
    assert [one and one.stamp.sec for one in (heard.receive(), heard.receive())] == [0, 4]


def test_one_bad_value_hides_nothing_else(site: Site) -> None:
    bus = InProcessBus()
    events, places = (
        bus.subscribe("/aeros/events", Event),
        bus.subscribe("/aeros/state/tool_position", PointStamped),
    )
    with BusFeed(bus, site) as feed:
        feed.on_tick(0.5, {"tool_position": ("here", None)}, KNOWN)
        feed.on_record(b"no record")
        feed.on_tick(float("nan"), {"tool_position": (1.0, 0.0, 0.0)}, KNOWN)
        feed.on_tick(0.75, {"tool_position": (1.0, 0.0, 0.0)}, KNOWN)
        feed.on_record(RECORD)
    assert places.receive() is not None
    assert places.receive() is None
    assert events.receive() is not None
    # The bad place, the bad record, and at no time: the time itself and the place.
    assert feed.lost == 4
    assert feed.trouble is not None


def test_a_failing_bus_does_not_fail_the_run(site: Site) -> None:
    def fail(message: Message) -> None:
        raise RuntimeError("the cable is out")

    with BusFeed(Odd(fail), site) as feed:
        feed.on_record(RECORD)
        feed.on_tick(0.0, {"tool_position": (1.0, 0.0, 0.0)}, KNOWN)
    assert (feed.lost, feed.trouble) == (2, "the cable is out")


def test_a_complete_feed_makes_the_run_wait(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MAX_STATES", 2)
    text: list[Message] = []

    def dawdle(message: Message) -> None:
        time.sleep(0.002)
        text.append(message)

    with BusFeed(Odd(dawdle), site, is_whole=True) as feed:
        for number in range(50):
            feed.on_tick(float(number), {"tool_position": (1.0, 0.0, 0.0)}, KNOWN)
    assert (len(text), feed.lost) == (50, 0)


def test_a_hanging_bus_delays_nobody_and_states_are_dropped_before_records(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_MAX_STATES", 5)
    monkeypatch.setattr(module, "_MAX_RECORDS", 8)
    monkeypatch.setattr(module, "_CLOSE_TIMEOUT_S", 0.05)
    text: list[Message] = []
    busy, go_on = threading.Event(), threading.Event()

    def hang(message: Message) -> None:
        busy.set()
        go_on.wait()
        text.append(message)

    feed = BusFeed(Odd(hang), site)
    feed.on_record(RECORD)
    assert busy.wait(5.0)
    for number in range(20):
        feed.on_tick(float(number), {"tool_position": (1.0, 0.0, 0.0)}, KNOWN)
    assert (feed.lost, feed.trouble) == (15, "the bus is slower than the run")
    for _ in range(4):
        feed.on_record(RECORD)
    assert feed.lost == 16
    began = time.monotonic()
    feed.close()
    assert time.monotonic() - began < 2.0
    assert feed.lost == 17
    go_on.set()
    feed.close()
    assert [type(one) for one in text] == [Event] + [PointStamped] * 5 + [Event] * 3


def test_few_pictures_wait_for_a_hanging_bus() -> None:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    view = CameraView((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 60.0)
    picture = CameraPicture(next(iter(site.cameras)), 1.0, 1, 1, bytes(3), None, view)
    text: list[Message] = []
    busy, go_on = threading.Event(), threading.Event()

    def hang(message: Message) -> None:
        busy.set()
        go_on.wait()
        text.append(message)

    with BusFeed(Odd(hang), site) as feed:
        feed.on_record(RECORD)
        assert busy.wait(5.0)
        for _ in range(20):
            feed.on_picture(picture)
        assert (feed.lost, feed.trouble) == (12, "the bus is slower than the run")
        go_on.set()
    assert [type(one) for one in text] == [Event] + [CompressedImage] * 8
