"""Each of these checks accepts a whole twin of a plant and refuses one that breaks its promise."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, nan
from typing import Any

import pytest

from aeros.runtime.ports import Monitor, MotionCompletion, MotionHandle, Reading, Readings
from aeros.sim.clock import TICK
from aeros.sim.conformance import observation_checks
from aeros.sim.conformance.suite import Check, ConformanceError, PlantUnderTest
from aeros.sim.fake import FakePlant
from aeros.skill import act
from tests.unit.sim.conformance.broken import Twin
from tests.unit.sim.conformance.subjects import REACH
from tests.unit.sim.conformance.twins import accept, broken_twins, refuse, whole_twins


@pytest.mark.parametrize(("check", "twin"), whole_twins(observation_checks))
def test_the_twin_that_is_not_broken_passes(check: Check, twin: type[Twin]) -> None:
    accept(check, twin)


@pytest.mark.parametrize(("check", "twin", "why"), broken_twins(observation_checks))
def test_a_broken_twin_is_refused(check: Check, twin: type[Twin], why: str) -> None:
    refuse(check, twin, why)


# Readings, by hand.


class Timed(FakePlant):
    """A plant whose readings are of scripted times; nothing else is asked of it here."""

    def __init__(self, *times: Any) -> None:
        super().__init__()
        self.time, self._times = 5.0, times

    def observe(self) -> Readings:
        return {f"v{number}": Reading(1.0, time) for number, time in enumerate(self._times)}


@pytest.mark.parametrize(
    ("time", "why"),
    [
        (5.0, None),
        (0.0, None),
        (-1.0, None),
        (5.000001, "`v1` was measured at 5.000001 s, which is in the future: it is 5.0 s"),
        (nan, "`v1` was measured at nan, which is not a time"),
        (-inf, "`v1` was measured at -inf, which is not a time"),
        (5, "`v1` was measured at 5, which is not a time"),
        (None, "`v1` was measured at None, which is not a time"),
    ],
)
def test_a_reading_has_a_time_that_has_come(time: Any, why: str | None) -> None:
    if why is None:
        assert observation_checks._require_timely(Timed(1.0, time)) == {"v0": 1.0, "v1": time}
        return
    with pytest.raises(ConformanceError, match=why):
        observation_checks._require_timely(Timed(1.0, time))


@pytest.mark.parametrize(
    ("value", "is_taken"),
    [
        (True, True),
        (1.5, True),
        ("word", True),
        ((1.0, 2.0, 3.0), True),
        ((True, False), True),
        ((), True),
        (1, False),
        (nan, False),
        (None, False),
        ([1.0], False),
        ((1.0, inf), False),
        (((1.0,),), False),
    ],
)
def test_a_value_is_of_a_type_that_the_gate_takes(value: Any, is_taken: bool) -> None:
    subject = PlantUnderTest(lambda: FakePlant({"seen": value}), act("move"), act("wait"))
    if is_taken:
        observation_checks.readings_are_of_the_types_that_the_port_has(subject)
        return
    with pytest.raises(ConformanceError, match=r"`seen` is .*, which every gate refuses"):
        observation_checks.readings_are_of_the_types_that_the_port_has(subject)


def test_the_monitors_last_look_is_what_is_measured_then() -> None:
    def make() -> FakePlant:
        plant = FakePlant({"joint_position": (0.5,)})
        plant.during = [{}, {"joint_position": last}]
        return plant

    subject = PlantUnderTest(make, act("move"), act("wait"), period=None)
    last = (0.5,)
    observation_checks.the_monitor_runs_before_the_first_tick_and_after_each(subject)
    last = (0.6,)
    with pytest.raises(
        ConformanceError, match="the monitor's last observation differs from the measurement at that time"
    ):
        observation_checks.the_monitor_runs_before_the_first_tick_and_after_each(subject)


class LaterThanItMoves(Twin):
    """Begins to report only after the first ticks of a motion, when the arm hardly moves yet."""

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        calls = 0

        def reporting(now: float, values: Mapping[str, Any]) -> str | None:
            nonlocal calls
            calls += 1
            return None if 2 <= calls <= 4 else monitor(now, values)

        return super().advance(reporting, until)


@pytest.mark.parametrize(
    ("handover", "noise", "is_kept"),
    [(0.0, 1e-3, False), (4 * TICK, 1e-3, True), (3 * TICK, 1e-3, False), (4 * TICK, 0.0, False)],
)
def test_only_a_robot_that_stands_may_be_silent_and_only_as_long_as_its_subject_says(
    handover: float, noise: float, is_kept: bool
) -> None:
    subject = PlantUnderTest(
        LaterThanItMoves, REACH, act("wait", duration=2.5), noise=noise, handover=handover
    )
    check = observation_checks.the_monitor_runs_before_the_first_tick_and_after_each
    if is_kept:
        check(subject)
        return
    with pytest.raises(ConformanceError, match="the monitor did not look for"):
        check(subject)


class ObservedIntoAnotherPlace(Twin):
    """Ends a motion a milliradian farther if it was observed on the way."""

    is_observed = False

    def observe(self) -> Readings:
        self.is_observed = self.is_observed or bool(self._under_way)
        return super().observe()

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        over = super().advance(monitor, until)
        if over and self.is_observed:
            self.creep(1e-3)
        return over


@pytest.mark.parametrize(("tolerance", "is_kept"), [(0.01, True), (0.001, False)])
def test_of_a_plant_that_does_not_repeat_two_runs_end_near_each_other(
    tolerance: float, is_kept: bool
) -> None:
    subject = PlantUnderTest(
        ObservedIntoAnotherPlace,
        REACH,
        act("wait", duration=2.5),
        tracking_tolerance=tolerance,
        repeats=False,
    )
    check = observation_checks.the_monitor_may_observe_and_changes_nothing_by_it
    if is_kept:
        check(subject)
        return
    with pytest.raises(ConformanceError, match="rad or m from where it ends unobserved"):
        check(subject)
