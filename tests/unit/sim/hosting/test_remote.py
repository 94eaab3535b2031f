"""A remote plant forwards every call, and returns what the host's plant answers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.ports import (
    CameraPicture,
    CameraView,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    Plant,
    Reading,
    RobotBody,
    Trajectory,
    known_action_kinds,
    plan_sequence,
)
from aeros.sim.fake import FakePlant
from aeros.sim.hosting.remote import RemotePlant
from aeros.sim.hosting.wire import ConnectionLostError
from aeros.sim.kinematic.plant import make_plant
from aeros.skill import Action, act
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.hosting.hosted import Hosting

REACH = act("move_tool", target=(0.5, -0.35, 0.25), yaw=0.5, speed=0.5)


def kinematic() -> Plant:
    return make_plant(shipped_scene("bare"), 0)


def test_a_monitor_that_fails_has_stopped_the_plant_first() -> None:
    hosting = Hosting(kinematic())
    plant = hosting.join()
    plant.begin(REACH, plant.plan(REACH))

    def monitor(now: float, measured: Mapping[str, Any]) -> None:
        if now > 0.2:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        plant.advance(monitor, 100.0)
    assert max(map(abs, plant.observe()["joint_velocity"].value)) == 0.0
    plant.shut_down_host()


def test_a_plan_arrives_as_it_was_stated() -> None:
    hosting, beside = Hosting(kinematic()), kinematic()
    plant = hosting.join()
    stated, received = beside.plan(REACH), plant.plan(REACH)
    assert isinstance(received, Trajectory)
    assert received == stated
    assert plant.plan(REACH) == stated
    plant.shut_down_host()


def test_plans_of_a_sequence_arrive_as_they_were_stated() -> None:
    hosting, beside = Hosting(kinematic()), kinematic()
    plant = hosting.join()
    low = Action(REACH.kind, {**REACH.parameters, "target": (0.45, 0.1, 0.3)})
    assert plant.plan_sequence([REACH, low]) == plan_sequence(beside, [REACH, low])
    assert plant.plan_sequence([act("wait", duration=1.0)]) is None
    assert plant.plan_sequence([act("wait", duration=None)]) is None
    assert plant.plan(REACH) == beside.plan(REACH), "the body is known"
    plant.shut_down_host()


# On a plant with scripted answers.


@pytest.fixture
def hosted() -> Iterator[tuple[RemotePlant, FakePlant]]:
    plant = FakePlant({"near": 1.5, "hand": (0.0, 0.5, 1.0), "open": True})
    hosting = Hosting(plant)
    remote = hosting.join()
    yield remote, plant
    with suppress(ConnectionLostError):
        remote.shut_down_host()
    remote.close()
    hosting.thread.join(20.0)


Ends = tuple[RemotePlant, FakePlant]


def test_every_call_is_forwarded(hosted: Ends) -> None:
    remote, plant = hosted
    plant.time, plant.reading_age = 7.0, 0.5
    assert remote.now() == 7.0
    assert remote.observe() == {
        "near": Reading(1.5, 6.5),
        "hand": Reading((0.0, 0.5, 1.0), 6.5),
        "open": Reading(True, 6.5),
    }
    remote.skill_began("m.s")
    remote.skill_ended("m.s", finished=True)
    assert remote.begin(REACH) == 1
    remote.halt(MotionHandle(1))
    remote.stop()
    assert plant.calls == [
        ("skill_began", "m.s"),
        ("skill_ended", "m.s", True),
        ("begin", REACH),
        ("halt", 1),
        ("stop",),
    ]


def test_only_the_latest_plan_can_be_started(hosted: Ends) -> None:
    remote, plant = hosted
    first = remote.plan(REACH)
    assert first == plant.planned
    plant.planned = NoMotion("another")
    second = remote.plan(REACH)
    stale = MotionCompletion(False, "stale: the decided plan is not the latest one")
    assert remote.begin(REACH, first) == stale
    assert remote.begin(REACH, NoMotion("another")) == stale
    assert plant.executed == []
    assert remote.begin(REACH, second) == 1
    assert plant.decided == [plant.planned]
    assert remote.begin(REACH) == 2
    assert plant.decided[1] is None


def test_a_body_is_sent_once_and_kept(hosted: Ends) -> None:
    remote, plant = hosted
    body = RobotBody(((0.0, 0.0, 0.0),), (0.5, 0.0, 0.0), ())
    plan = Trajectory(body, ((((0.0,),) * 4,),), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)
    plant.planned = plan
    assert remote.plan(REACH) == plan
    assert remote.plan(REACH) == plan
    other = replace(plan, body=replace(body, tool_offset=(0.25, 0.0, 0.0)))
    plant.planned = other
    assert remote.plan(REACH) == other
    plant.planned = MotionCompletion(False, "unreachable")
    assert remote.plan(REACH) == plant.planned


@pytest.mark.parametrize("value", [None, [1.0], {"a": 1}, object(), (1.0, None), ([],)])
def test_parameters_that_no_message_holds_are_refused_here(value: Any, hosted: Ends) -> None:
    remote, plant = hosted
    refused = MotionCompletion(False, "bad parameter: `odd` has an unsupported type")
    assert remote.plan(act("move", odd=value)) == refused
    assert remote.begin(act("move", odd=value)) == refused
    assert plant.calls == []


def test_parameters_arrive_unchanged(hosted: Ends) -> None:
    remote, plant = hosted
    action = act("move", at=(0.1, (2, 3.0)), deep=True, count=7, word="x")
    remote.begin(action)
    assert plant.executed == [action]
    assert repr(plant.executed[0].parameters["at"]) == "(0.1, (2, 3.0))"


def test_the_monitor_judges_every_tick_here(hosted: Ends) -> None:
    remote, plant = hosted
    plant.completions = [MotionCompletion(False, "slipped")]
    plant.during = [{"near": 1.0}, {"near": Reading(0.5, 2.0)}]
    motion = remote.begin(REACH)
    assert isinstance(motion, int)
    seen: list[Any] = []

    def monitor(now: float, values: Mapping[str, Any]) -> None:
        seen.append((now, values["near"], values["hand"]))

    assert remote.advance(monitor, 9.0) == {motion: MotionCompletion(False, "slipped")}
    hand = (0.0, 0.5, 1.0)
    assert seen == [(0.0, 1.0, hand), (0.0, Reading(0.5, 2.0), hand)]
    assert type(seen[1][1]) is Reading
    assert remote.advance(monitor, 9.0) == {}
    assert remote.now() == 9.0


def test_without_an_end_the_time_is_infinite(hosted: Ends) -> None:
    remote, plant = hosted
    remote.begin(REACH)
    remote.advance(lambda now, values: None, inf)
    assert plant.calls[-1] == ("advance", inf)


def test_a_rule_ends_everything(hosted: Ends) -> None:
    remote, _ = hosted
    motion = remote.begin(REACH)
    assert isinstance(motion, int)
    ended = remote.advance(lambda now, values: "too-near", 9.0)
    assert ended == {motion: MotionCompletion(False, "monitor:too-near")}


def test_the_monitor_may_call_the_plant(hosted: Ends) -> None:
    remote, plant = hosted
    motion = remote.begin(REACH)
    assert isinstance(motion, int)

    def monitor(now: float, values: Mapping[str, Any]) -> None:
        assert remote.observe()["open"].value is True
        remote.halt(motion)

    assert remote.advance(monitor, 9.0) == {motion: MotionCompletion(False, "halted")}
    assert plant.call_count("halt") == 1


def test_a_host_that_is_gone_is_a_connection_error(hosted: Ends) -> None:
    remote, _ = hosted
    remote.shut_down_host()
    with pytest.raises(ConnectionError):
        remote.now()
    remote.close()


def test_where_nothing_listens_there_is_no_plant(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        RemotePlant(tmp_path / "absent.sock")


class Looking(FakePlant):
    """A plant with two cameras, one of which takes a new picture each second."""

    def pictures(self) -> Mapping[str, CameraPicture]:
        view = CameraView((0.1, 0.2, 0.3), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 45.0)
        return {
            name: CameraPicture(name, time, 2, 1, bytes(range(6)), depth, view)
            for name, time, depth in (("mast", 0.0, None), ("hand", self.now(), bytes(range(8))))
        }


def test_pictures_arrive_as_they_were_taken_and_old_ones_are_not_sent_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    hosting = Hosting(Looking())
    plant = hosting.join()
    sent: list[int] = []
    call = RemotePlant._call

    def count(self: RemotePlant, what: str, **about: Any) -> Any:
        reply = call(self, what, **about)
        sent.append(len(reply) if what == "pictures" else 0)
        return reply

    monkeypatch.setattr(RemotePlant, "_call", count)
    assert plant.pictures() == hosting.plant.pictures()  # type: ignore[attr-defined]
    assert list(plant.pictures()) == ["mast", "hand"]
    assert sent == [2, 0]
    plant.advance(lambda now, values: None, plant.now() + 1.0)
    assert plant.pictures() == hosting.plant.pictures()  # type: ignore[attr-defined]
    assert sent[-1] == 1
    plant.shut_down_host()


def test_a_hosted_plant_without_cameras_has_no_pictures() -> None:
    plant = Hosting(FakePlant()).join()
    assert plant.pictures() == {}
    plant.shut_down_host()


def test_the_action_kinds_of_the_hosted_plant_are_known() -> None:
    for inner in (kinematic(), FakePlant()):
        plant = Hosting(inner).join()
        assert known_action_kinds(plant) == known_action_kinds(inner)
        plant.shut_down_host()
