"""Checks of the clock, the readings and the monitor."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import dist, isfinite
from typing import Any, Final

from aeros.runtime.ports import Plant
from aeros.sim.conformance.plant_under_test import (
    MOTION_TIMEOUT_S,
    PlantUnderTest,
    RecordingMonitor,
    begin_motion,
    require,
    wait_for_end,
)

_IDLE_S: Final = 1.0  # s


def the_clock_never_goes_back(subject: PlantUnderTest) -> None:
    """Check that neither `now` nor the times that the monitor sees ever decrease, for any sequence of calls.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        times = [plant.now()]

        def note(_: object) -> None:
            times.append(plant.now())

        note(plant.observe())
        note(plant.plan(subject.motion_action))
        moving, watch = begin_motion(plant, subject.motion_action), RecordingMonitor()
        note(moving)
        for _ in range(3):
            note(plant.advance(watch, plant.now() + 0.1))
        plant.halt(moving)
        note(wait_for_end(plant, moving, watch))
        plant.stop()
        note(None)
    for sequence in (times, [time for time, _ in watch.seen]):
        pairs = pairwise(sequence)
        require(all(a <= b for a, b in pairs), f"the clock goes back: {sequence}")
    require(all(map(isfinite, times)), "the clock does not show a number of seconds")
    require(times[-1] > times[0], "the clock stands still while something moves")


def readings_are_fresh_and_never_in_the_future(subject: PlantUnderTest) -> None:
    """Check that each reading has its own time, at most `now`.

    Readings are taken again while something moves and while nothing moves.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        before = _require_timely(plant)
        wait_for_end(plant, begin_motion(plant, subject.motion_action), RecordingMonitor())
        after = _require_timely(plant)
        plant.advance(RecordingMonitor(), plant.now() + _IDLE_S)
        rested = _require_timely(plant)
    name = subject.joint_variable
    require(name in before and name in after and name in rested, f"`{name}` is not measured")
    require(after[name] > before[name], f"`{name}` was moved, but its reading is still of {before[name]} s")
    require(
        rested[name] > after[name],
        f"`{name}` is still of {after[name]} s although nothing moved for {_IDLE_S:g} s since",
    )


def _require_timely(plant: Plant) -> dict[str, float]:
    times = {name: reading.time for name, reading in plant.observe().items()}
    now = plant.now()
    for name, time in times.items():
        require(
            isinstance(time, float) and isfinite(time),
            f"`{name}` was measured at {time!r}, which is not a time",
        )
        require(time <= now, f"`{name}` was measured at {time} s, which is in the future: it is {now} s")
    return times


def readings_are_of_the_types_that_the_port_has(subject: PlantUnderTest) -> None:
    """Check that readings are bool, finite float, str, or tuples of floats or bools.

    Types are exact, as the gate compares types exactly.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        readings = [plant.observe()]
        wait_for_end(plant, begin_motion(plant, subject.motion_action), RecordingMonitor())
        readings.append(plant.observe())
    for reading in readings:
        for name, measured in reading.items():
            parts = measured.value if type(measured.value) is tuple else (measured.value,)
            require(all(map(_is_scalar, parts)), f"`{name}` is {measured.value!r}, which every gate refuses")


def _is_scalar(value: Any) -> bool:
    return type(value) in (bool, str) or (type(value) is float and isfinite(value))


def the_monitor_runs_before_the_first_tick_and_after_each(subject: PlantUnderTest) -> None:
    """Check that the monitor runs once before the first tick and once after each.

    Its times are one period apart, from the beginning to the end. It sees the joints, and at the end those
    that are then measured.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        motion, watch = begin_motion(plant, subject.motion_action), RecordingMonitor()
        start = plant.now()
        over = plant.advance(watch, start + MOTION_TIMEOUT_S)
        end, measured = plant.now(), plant.observe()
    require(motion in over, "nothing else was under way, but `advance` returned without it")
    require(len(watch.seen) >= 2, f"the monitor looked {len(watch.seen)} times")
    times = [time for time, _ in watch.seen]
    rounding = 1e-9 * max(1.0, abs(end))
    require(abs(times[0] - start) <= rounding, f"the monitor first looked at {times[0]} s, not at {start} s")
    if subject.period is not None:
        for (before, was), (after, now) in pairwise(watch.seen):
            gap, name = after - before, subject.joint_variable
            stands = name in was and name in now and dist(was[name], now[name]) <= subject.noise
            longest = subject.handover if stands and subject.handover else subject.period
            require(gap <= longest + rounding, f"the monitor did not look for {gap} s")
        require(abs(end - times[-1]) <= rounding, f"the monitor last looked at {times[-1]} s of {end} s")
    require(
        len(watch.history(subject.joint_variable)) == len(watch.seen),
        f"the monitor does not see `{subject.joint_variable}`",
    )
    last = watch.history(subject.joint_variable)[-1]
    require(
        last == measured[subject.joint_variable].value,
        "the monitor's last observation differs from the measurement at that time",
    )


def the_monitor_may_observe_and_changes_nothing_by_it(subject: PlantUnderTest) -> None:
    """Check that the monitor may call `observe`.

    The readings are those of its tick, and the motion ends as it does unobserved.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    ends = []
    for observes in (False, True):
        with subject.plant() as plant:
            monitor = _ObservingMonitor(plant) if observes else RecordingMonitor()
            wait_for_end(plant, begin_motion(plant, subject.motion_action), monitor)
            ends.append((plant.now(), plant.observe()[subject.joint_variable].value))
    if subject.repeats:
        require(ends[0] == ends[1], "a motion ends differently if the monitor observes it")
        return
    away = dist(ends[0][1], ends[1][1])
    require(
        away <= 2.0 * subject.tracking_tolerance,
        f"a motion that the monitor observes ends {away:.4f} rad or m from where it ends unobserved",
    )


class _ObservingMonitor(RecordingMonitor):
    """A monitor that calls `observe` at every tick."""

    def __init__(self, plant: Plant) -> None:
        super().__init__()
        self._plant = plant

    def __call__(self, now: float, values: Mapping[str, Any]) -> str | None:
        """Compare the readings with the values that the monitor is given."""
        readings = self._plant.observe()
        late = [name for name, reading in readings.items() if reading.time > now]
        require(not late, f"`{late[:1]}` is observed at {now} s, but has a later time")
        for name in values.keys() & readings.keys():
            given, seen = values[name], readings[name]
            time = getattr(given, "time", now)
            require(time == seen.time, f"`{name}` is of {time} s for the monitor, of {seen.time} s to others")
        return super().__call__(now, values)
