"""A watched plant is the plant that it wraps, and what it measures is published."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from aeros.runtime.bus.feed import BusFeed
from aeros.runtime.bus.in_process import InProcessBus
from aeros.runtime.bus.listened_plant import ListenedPlant
from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.bus.messages import PointStamped, TFMessage
from aeros.runtime.ports import (
    CameraPicture,
    CameraView,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    PlannedMotion,
    Plant,
    RobotBody,
    Trajectory,
    Vec3,
)
from aeros.sim.fake import FakePlant
from aeros.skill import act
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from tests.shipped_scenes import shipped_scene
from tests.unit.runtime.bus.test_transforms import placed_in_first

MOVE = act("move")
BODY = RobotBody(((0.0, 0.0, 0.0),), (0.0, 0.0, 0.0), ())
HERE, THERE = (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)
FOREVER = 1e9


def trajectory(base: Vec3 = HERE, way: Vec3 = (0.0, 0.0, 0.0)) -> Trajectory:
    return Trajectory(BODY, ((((0.0,),) * 4,),), base, way, 1.0)


class Noted(BusFeed):
    """Feed that keeps each call's values, and the state of the chain then."""

    def __init__(self, site: Site) -> None:
        super().__init__(InProcessBus(), site)
        self.ticks: list[tuple[float, dict[str, Any]]] = []
        self.chains: list[RobotChain] = []

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        self.ticks.append((now, dict(values)))
        self.chains.append(chain)

    def on_observed(self, readings: Mapping[str, Any], chain: RobotChain) -> None:
        self.ticks.append((-1.0, dict(readings)))
        self.chains.append(chain)


class Bench:
    def __init__(self, feed: Noted) -> None:
        self.feed = feed
        self.real = FakePlant({"holding": True})
        self.plant: Plant = ListenedPlant(self.real, feed)

    def known(self) -> RobotChain:
        self.plant.observe()
        return self.feed.chains[-1]

    def begin(self, plan: PlannedMotion | None) -> MotionHandle:
        started = self.plant.begin(MOVE, plan)
        assert not isinstance(started, MotionCompletion)
        return started

    def plan(self, plan: PlannedMotion) -> PlannedMotion:
        self.real.planned = plan
        return self.plant.plan(MOVE)


@pytest.fixture
def bench(site: Site) -> Iterator[Bench]:
    with Noted(site) as feed:
        yield Bench(feed)


def test_it_passes_everything_on(bench: Bench) -> None:
    plan = trajectory()
    assert bench.plan(plan) is plan
    motion = bench.begin(plan)
    bench.plant.halt(motion)
    assert bench.plant.advance(lambda now, values: None, 7.0) == {motion: MotionCompletion(False, "halted")}
    bench.plant.skill_began("a.b")
    bench.plant.skill_ended("a.b", finished=True)
    bench.plant.stop()
    bench.plant.close()
    assert bench.real.calls == [
        ("plan", MOVE), ("begin", MOVE), ("halt", motion), ("advance", 7.0), ("skill_began", "a.b"),
        ("skill_ended", "a.b", True), ("stop",), ("close",),
    ]  # fmt: skip
    assert bench.real.decided == [plan]
    bench.real.time = 3.0
    assert bench.plant.now() == 3.0
    assert bench.plant.observe() == bench.real.observe()


def test_the_monitors_answer_holds_and_listeners_get_each_tick(bench: Bench) -> None:
    bench.real.during = [{"load": 1.0}, {"load": 2.0}, {"load": 3.0}]
    motion = bench.begin(None)
    ended = bench.plant.advance(lambda now, values: "rule" if values["load"] > 1.5 else None, FOREVER)
    assert ended == {motion: MotionCompletion(False, "monitor:rule")}
    assert bench.feed.ticks == [
        (0.0, {"holding": True, "load": 1.0}),
        (0.0, {"holding": True, "load": 2.0}),
    ]


def test_the_chain_is_known_after_a_planned_trajectory(bench: Bench) -> None:
    assert bench.known() == RobotChain(None, None)
    bench.plan(NoMotion("it waits"))
    assert bench.known() == RobotChain(None, None)
    bench.plan(trajectory())
    assert bench.known() == RobotChain(BODY, HERE)


def test_where_the_base_is_is_known_until_something_may_move_it(bench: Bench) -> None:
    for stays in (trajectory(), NoMotion("it waits")):
        bench.plan(trajectory())
        bench.begin(stays)
        bench.plant.advance(lambda now, values: None, FOREVER)
        assert bench.known() == RobotChain(BODY, HERE)
    for travels in (trajectory(way=(1.0, 0.0, 0.0)), None):
        bench.plan(trajectory())
        bench.begin(travels)
        assert bench.known() == RobotChain(BODY, None)
        bench.plan(trajectory())  # beside it: it says where the base was just then
        assert bench.known() == RobotChain(BODY, None)
        bench.plant.advance(lambda now, values: None, FOREVER)
        assert bench.known() == RobotChain(BODY, None)
        bench.plan(trajectory(THERE))
        assert bench.known() == RobotChain(BODY, THERE)


def test_after_a_stop_the_next_plan_says_where_the_base_is(bench: Bench) -> None:
    bench.begin(trajectory(way=(1.0, 0.0, 0.0)))
    bench.plant.stop()
    bench.plan(trajectory(THERE))
    assert bench.known() == RobotChain(BODY, THERE)


@pytest.mark.physics
def test_the_transforms_of_a_motion_lead_to_the_tool_that_is_measured() -> None:
    from aeros.sim.physics import make_plant

    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    bus = InProcessBus()
    frames = bus.subscribe("/tf", TFMessage, depth=1000)
    fixed = bus.subscribe("/tf_static", TFMessage)
    places = bus.subscribe("/aeros/state/tool_position", PointStamped, depth=1000)
    plant = make_plant(shipped_scene("bare"), 0)
    with BusFeed(bus, site) as feed:
        watched = ListenedPlant(plant, feed)
        action = act("move_tool", target=(0.5, 0.1, 0.3), yaw=0.5, speed=0.25)
        plan = watched.plan(action)
        assert isinstance(plan, Trajectory)
        watched.begin(action, plan)
        ended = watched.advance(lambda now, values: None, 0.5)
        assert ended == {}
    plant.close()
    assert feed.lost == 0
    count, tool = 0, fixed.receive()
    assert tool is not None
    while (moving := frames.receive()) is not None:
        frame = TFMessage((*moving.transforms, *tool.transforms))
        place = places.receive()
        assert place is not None
        assert place.header.stamp == frame.transforms[0].header.stamp
        p = place.point
        assert placed_in_first(frame, (0.0, 0.0, 0.0)) == pytest.approx((p.x, p.y, p.z), abs=1e-6)
        count += 1
    assert count == 121  # before the first tick, and after each of those in half a second


def test_every_listener_receives_the_same(site: Site) -> None:
    with Noted(site) as one, Noted(site) as other:
        plant = ListenedPlant(FakePlant({"holding": True}), one, other)
        plant.observe()
        plant.advance(lambda now, values: None, 0.01)
    assert one.ticks == other.ticks
    assert len(one.ticks) > 1


def test_pictures_are_those_of_the_plant() -> None:
    class Looking(FakePlant):
        def pictures(self) -> Mapping[str, CameraPicture]:
            view = CameraView((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 45.0)
            return {"mast": CameraPicture("mast", 0.0, 1, 1, bytes(3), None, view)}

    inner = Looking()
    assert ListenedPlant(inner).pictures() == inner.pictures()
    assert ListenedPlant(FakePlant()).pictures() == {}
