"""The scripted plant does what its script says, and remembers what it was asked."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest

from aeros.runtime.ports import MotionCompletion, MotionHandle, NoMotion, Reading
from aeros.sim.fake import FakePlant
from aeros.skill import act
from tests.unit.sim.acting import allow

MOVE, WAIT = act("move"), act("wait")
DONE, SLIPPED = MotionCompletion(True), MotionCompletion(False, "slipped")


def test_values_are_measured_with_the_declared_age() -> None:
    plant = FakePlant({"near": 1.5})
    plant.time, plant.reading_age = 9.0, 0.25
    assert plant.observe() == {"near": Reading(1.5, 8.75)}
    plant.values["near"] = 2.0
    assert plant.observe()["near"].value == 2.0
    assert (FakePlant().observe(), FakePlant().now()) == ({}, 0.0)


def test_calls_are_recorded_in_order_but_for_looking() -> None:
    plant = FakePlant()
    plant.now()
    plant.observe()
    assert plant.plan(MOVE) == NoMotion("this plant has no body")
    motion = plant.begin(MOVE, plant.planned)
    plant.begin(WAIT)
    plant.halt(motion)
    plant.stop()
    plant.skill_began("m.s")
    plant.skill_ended("m.s", finished=False)
    plant.close()
    assert [call[0] for call in plant.calls] == [
        "plan", "begin", "begin", "halt", "stop", "skill_began", "skill_ended", "close",
    ]  # fmt: skip
    assert plant.calls[6] == ("skill_ended", "m.s", False)
    assert plant.executed == [MOVE, WAIT]
    assert plant.decided == [plant.planned, None]
    assert (plant.call_count("begin"), plant.call_count("now")) == (2, 0)


def test_actions_end_in_the_order_of_their_durations_and_as_scripted() -> None:
    plant = FakePlant()
    plant.durations = [3.0, 1.0]
    plant.duration = 2.0
    plant.script([SLIPPED])
    slow, fast, middle = (plant.begin(MOVE) for _ in range(3))
    assert (slow, fast, middle) == (1, 2, 3)
    assert plant.advance(allow, inf) == {fast: SLIPPED}
    assert plant.now() == 1.0
    assert plant.advance(allow, inf) == {middle: DONE}
    assert plant.advance(allow, 3.0) == {slow: DONE}
    assert plant.now() == 3.0


def test_time_goes_on_to_until_where_nothing_ends_before() -> None:
    plant = FakePlant()
    motion = plant.begin(MOVE)
    assert plant.advance(allow, 0.05) == {}
    assert plant.now() == 0.05
    assert plant.advance(allow, 0.02) == {}
    assert plant.now() == 0.05
    assert plant.advance(allow, 0.1) == {motion: DONE}
    assert plant.advance(allow, 7.0) == {}
    assert plant.now() == 7.0


def test_actions_start_when_they_are_asked_to_and_not_before() -> None:
    plant = FakePlant()
    plant.time = 5.0
    motion = plant.begin(MOVE)
    assert plant.advance(allow, inf) == {motion: DONE}
    assert plant.now() == pytest.approx(5.1)


def test_the_monitor_sees_the_scripted_ticks_and_a_rule_ends_everything() -> None:
    plant = FakePlant({"near": 1.5, "open": True})
    plant.during = [{}, {"near": 0.5}, {"near": 0.25}]
    motions = [plant.begin(MOVE), plant.begin(WAIT)]
    seen: list[Any] = []

    def monitor(now: float, values: Any) -> str | None:
        seen.append((now, dict(values)))
        return "too-near" if values["near"] < 1.0 else None

    ended = plant.advance(monitor, inf)
    assert ended == dict.fromkeys(motions, MotionCompletion(False, "monitor:too-near"))
    assert seen == [(0.0, {"near": 1.5, "open": True}), (0.0, {"near": 0.5, "open": True})]
    plant.during = []
    assert plant.advance(allow, 1.0) == {}


def test_a_halted_motion_ends_in_the_next_advance_and_the_others_go_on() -> None:
    plant = FakePlant()
    first, second = plant.begin(MOVE), plant.begin(WAIT)
    plant.halt(first)
    assert plant.advance(allow, inf) == {first: MotionCompletion(False, "halted")}
    assert plant.now() == 0.0
    assert plant.advance(allow, inf) == {second: DONE}


def test_after_a_stop_nothing_is_under_way() -> None:
    plant = FakePlant()
    plant.halt(plant.begin(MOVE))
    plant.stop()
    assert plant.advance(allow, 1.0) == {}


@pytest.mark.parametrize("method", ["now", "observe", "plan", "begin", "advance", "halt", "stop", "close"])
def test_any_call_fails_on_demand(method: str) -> None:
    plant = FakePlant()
    arguments: dict[str, tuple[Any, ...]] = {
        "plan": (MOVE,), "begin": (MOVE,), "advance": (allow, inf), "halt": (MotionHandle(1),),
    }  # fmt: skip
    plant.failing = {method: ConnectionError("gone")}
    with pytest.raises(ConnectionError, match="gone"):
        getattr(plant, method)(*arguments.get(method, ()))
    assert plant.call_count(method) == (method not in ("now", "observe"))
