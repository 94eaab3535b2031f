"""Helpers of the checks, on a plant with scripted answers."""

from __future__ import annotations

from typing import Any

import pytest

from aeros.runtime.ports import MotionCompletion, MotionHandle, Reading
from aeros.sim.conformance.plant_under_test import (
    ConformanceError,
    PlantUnderTest,
    RecordingMonitor,
    begin_motion,
    require,
    require_unchanged,
    values_of,
    wait_for_end,
)
from aeros.sim.fake import FakePlant
from aeros.skill import act

MOVE = act("move")


def subject(**more: Any) -> PlantUnderTest:
    return PlantUnderTest(make_plant=FakePlant, motion_action=MOVE, parallel_action=act("wait"), **more)


def test_each_plant_is_closed_also_after_an_error() -> None:
    with subject().plant() as first:
        assert isinstance(first, FakePlant)
        assert first.calls == []
    assert first.calls == [("close",)]

    def fail() -> None:
        with subject().plant() as second:
            made.append(second)
            raise KeyError

    made: list[Any] = []
    with pytest.raises(KeyError):
        fail()
    assert made[0] is not first
    assert made[0].calls == [("close",)]


def test_a_plant_without_ticks_has_ticks_of_no_length() -> None:
    assert subject(period=0.25).tick == 0.25
    assert subject(period=None).tick == 0.0


def test_a_monitor_records_copies_of_what_it_saw() -> None:
    watch, values = RecordingMonitor(), {"a": 1.0}
    assert watch(0.5, values) is None
    values["a"] = 2.0
    assert watch(0.75, {"b": 3.0}) is None
    assert watch(1.0, values) is None
    assert watch.seen == [(0.5, {"a": 1.0}), (0.75, {"b": 3.0}), (1.0, {"a": 2.0})]
    assert watch.history("a") == [1.0, 2.0]
    assert watch.history("c") == []


def test_a_monitor_names_its_rule_from_a_time_on_and_not_in_the_first_calls() -> None:
    watch = RecordingMonitor(rule_time=2.0, ignored_calls=2)
    assert [watch(time, {}) for time in (3.0, 1.0, 1.5, 2.0, 2.5)] == [
        None,
        None,
        None,
        "conformance",
        "conformance",
    ]
    assert RecordingMonitor(rule_time=2.0)(2.0, {}) == "conformance"


def test_a_promise_that_is_not_kept_raises() -> None:
    require(True, "it is kept")
    with pytest.raises(ConformanceError, match="the clock goes back"):
        require(False, "the clock goes back")


def test_values_are_readings_without_times() -> None:
    assert values_of({"a": Reading(1.0, 9.0), "b": Reading(True, 8.0)}) == {"a": 1.0, "b": True}
    assert values_of({}) == {}


def test_a_motion_starts_with_its_plan() -> None:
    plant = FakePlant()
    assert begin_motion(plant, MOVE) == MotionHandle(1)
    assert plant.decided == [plant.planned]
    plant.planned = MotionCompletion(False, "unreachable")
    with pytest.raises(ConformanceError, match="it cannot plan `move`, which its subject declares"):
        begin_motion(plant, MOVE)


class Refusing(FakePlant):
    """A plant that plans and then refuses."""

    def begin(self, action: Any, decided: Any = None) -> Any:
        return MotionCompletion(False, "not today")


def test_a_motion_that_is_planned_has_to_begin() -> None:
    with pytest.raises(
        ConformanceError, match=r"cannot begin the motion that it has just planned: .*not today"
    ):
        begin_motion(Refusing(), MOVE)


def test_the_end_of_one_motion_is_waited_for_beyond_others() -> None:
    plant = FakePlant()
    plant.durations = [3.0, 1.0, 2.0]
    plant.completions = [MotionCompletion(True), MotionCompletion(True), MotionCompletion(False, "slipped")]
    first, *_ = (begin_motion(plant, MOVE) for _ in range(3))
    begin_motion(plant, MOVE)
    begin_motion(plant, MOVE)
    watch = RecordingMonitor()
    ended = wait_for_end(plant, first, watch)
    assert (plant.now(), len(watch.seen)) == (3.0, 5)
    assert ended == MotionCompletion(True)


def test_a_motion_that_never_ends_is_given_up_after_two_minutes() -> None:
    plant = FakePlant()
    plant.time, plant.duration = 5.0, 1e9
    motion = begin_motion(plant, MOVE)
    with pytest.raises(ConformanceError, match="has not ended after 120 s"):
        wait_for_end(plant, motion, RecordingMonitor())
    assert plant.now() == 125.0


BEFORE = {"joint_position": (0.0, 1.0), "hand": (0.0, 0.0, 3.0), "open": True, "held": "cup", "load": 1.0}


@pytest.mark.parametrize(
    ("changed", "is_same"),
    [
        ({}, True),
        # The noise is 0.5: of joints and positions it is the distance, and other numbers are free.
        ({"joint_position": (0.3, 1.4)}, True),
        ({"joint_position": (0.3, 1.5)}, False),
        ({"hand": (0.0, 0.0, 3.5)}, True),
        ({"hand": (0.0, 0.4, 3.4)}, False),
        ({"load": 99.0}, True),
        ({"open": False}, False),
        ({"held": "plate"}, False),
        ({"more": 1.0}, False),
    ],
)
def test_nothing_has_moved_within_the_noise(changed: dict[str, Any], is_same: bool) -> None:
    stands = subject(noise=0.5)
    if is_same:
        require_unchanged(stands, BEFORE, {**BEFORE, **changed}, "meanwhile")
        return
    with pytest.raises(ConformanceError, match=r"^meanwhile: "):
        require_unchanged(stands, BEFORE, {**BEFORE, **changed}, "meanwhile")


def test_a_triple_of_truths_is_no_position() -> None:
    stands = subject(noise=0.0)
    require_unchanged(stands, {"a": (True, 1.0, 2.0)}, {"a": (True, 1.0, 3.0)}, "meanwhile")
    require_unchanged(stands, {"a": (1.0, 2.0)}, {"a": (1.0, 3.0)}, "meanwhile")
