"""Checks of motions that end early: by a broken rule, by `halt`, by `stop` and by `close`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import dist
from typing import Any

from aeros.runtime.ports import MotionCompletion, MotionHandle, Plant
from aeros.sim.conformance.plant_under_test import (
    MONITOR_RULE,
    MOTION_TIMEOUT_S,
    ConformanceError,
    PlantUnderTest,
    RecordingMonitor,
    begin_motion,
    require,
    require_every_tick,
    require_heeded_at_once,
    require_unchanged,
    values_of,
    wait_for_end,
)

_INTERRUPT_AFTER_S = 0.3
"""Time of the interruption after the beginning of a motion, s: by then it moves."""


def a_rule_broken_at_once_prevents_motion(subject: PlantUnderTest) -> None:
    """Check that a rule broken before the first tick ends all motions, and nothing has moved.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        before = values_of(plant.observe())
        motions = [begin_motion(plant, subject.motion_action), begin_motion(plant, subject.parallel_action)]
        _require_all_ended(
            plant.advance(RecordingMonitor(rule_time=plant.now()), plant.now() + MOTION_TIMEOUT_S), motions
        )
        require_unchanged(
            subject, before, values_of(plant.observe()), "the monitor named a rule before anything moved, and"
        )
        _require_ended_for_good(subject, plant)


def a_broken_rule_stops_everything_within_one_tick(subject: PlantUnderTest) -> None:
    """Check that a rule broken on the way brings everything to rest.

    The monitor is called at every tick until then. The robot comes to rest inside the joints' limits.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    watches = []
    for delay in (0.0, subject.tick):
        with subject.plant() as plant:
            motions = [
                begin_motion(plant, subject.motion_action),
                begin_motion(plant, subject.parallel_action),
            ]
            # Without ticks, time passes only at the end of a motion: the second call comes on the way.
            watch = RecordingMonitor(
                rule_time=plant.now() + (_INTERRUPT_AFTER_S if subject.period else 0.0) + delay,
                ignored_calls=1,
            )
            watches.append(watch)
            over = plant.advance(watch, plant.now() + MOTION_TIMEOUT_S)
            _require_all_ended(over, motions)
            named = [time for time, _ in watch.seen[1:] if time >= watch.rule_time]
            require_every_tick(subject, named, plant.now())
            took = plant.now() - named[0]
            require(took <= subject.max_stop_time + 2 * subject.tick, f"the stop took {took:.3f} s")
            _require_braking_distance(subject, watch, values_of(plant.observe()))
            _require_ended_for_good(subject, plant)
    if subject.period is not None and subject.repeats:
        require_heeded_at_once(*watches)


def a_halted_motion_comes_to_rest_while_others_go_on(subject: PlantUnderTest) -> None:
    """Check that `halt` between calls of `advance` brings one motion to rest and lets the other finish.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """

    def halt(
        plant: Plant, motion: MotionHandle, watch: RecordingMonitor
    ) -> Mapping[MotionHandle, MotionCompletion]:
        require(
            plant.advance(watch, plant.now() + _INTERRUPT_AFTER_S) == {},
            "something ended before it was halted",
        )
        plant.halt(motion)
        return {}

    _check_halt(subject, halt)


def the_monitor_may_halt_a_motion(subject: PlantUnderTest) -> None:
    """Check that the monitor may call `halt` inside `advance`, with the same effect.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """

    def halt(
        plant: Plant, motion: MotionHandle, watch: RecordingMonitor
    ) -> Mapping[MotionHandle, MotionCompletion]:
        halts_at, is_halted = plant.now() + (_INTERRUPT_AFTER_S if subject.period else 0.0), False

        def monitor(now: float, values: Mapping[str, Any]) -> str | None:
            nonlocal is_halted
            if now >= halts_at and not is_halted:
                is_halted = True
                plant.halt(motion)
            return watch(now, values) if now <= halts_at else None

        try:
            return plant.advance(monitor, plant.now() + MOTION_TIMEOUT_S)
        except Exception as error:
            raise ConformanceError(f"it raises {error!r} where the monitor halts a motion") from error

    _check_halt(subject, halt)


def _check_halt(
    subject: PlantUnderTest,
    halt: Callable[[Plant, MotionHandle, RecordingMonitor], Mapping[MotionHandle, MotionCompletion]],
) -> None:
    with subject.plant() as plant:
        halted, other = (
            begin_motion(plant, subject.motion_action),
            begin_motion(plant, subject.parallel_action),
        )
        watch, since = RecordingMonitor(), plant.now()
        over = halt(plant, halted, watch) or plant.advance(RecordingMonitor(), plant.now() + MOTION_TIMEOUT_S)
        require(set(over) == {halted}, f"one motion was halted; {sorted(over)} ended")
        how, took = over[halted], plant.now() - since
        require(not how.completed and bool(how.reason), f"a halted motion ended with {how}")
        require(
            not str(how.reason).startswith("monitor:"),
            f"the halted motion ended as if the monitor had stopped it: {how}",
        )
        require(
            took <= _INTERRUPT_AFTER_S + subject.max_stop_time + 2 * subject.tick,
            f"the stop took {took - _INTERRUPT_AFTER_S:.3f} s",
        )
        _require_braking_distance(subject, watch, values_of(plant.observe()))
        require(
            wait_for_end(plant, other, RecordingMonitor()).completed,
            "the other motion is not completed",
        )


def stop_ends_everything(subject: PlantUnderTest) -> None:
    """Check that after `stop` everything is at rest, no motion ends again, and new motions can begin.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    with subject.plant() as plant:
        motions = [begin_motion(plant, subject.motion_action), begin_motion(plant, subject.parallel_action)]
        watch = RecordingMonitor()
        require(
            plant.advance(watch, plant.now() + _INTERRUPT_AFTER_S) == {}, f"one of {motions} ended too soon"
        )
        since = plant.now()
        plant.stop()
        took = plant.now() - since
        require(took <= subject.max_stop_time + 2 * subject.tick, f"the stop took {took:.3f} s")
        _require_braking_distance(subject, watch, values_of(plant.observe()))
        _require_ended_for_good(subject, plant)


def close_is_idempotent(subject: PlantUnderTest) -> None:
    """Check that `close` may be called twice, and with a motion under way.

    Args:
        subject: the plant under test.

    Raises:
        ConformanceError: the plant breaks this promise.
    """
    plant = subject.make_plant()
    try:
        begin_motion(plant, subject.motion_action)
    finally:
        plant.close()
    try:
        plant.close()
    except Exception as error:
        raise ConformanceError(f"closing it twice makes it raise {error!r}") from error


def _require_all_ended(over: Mapping[MotionHandle, MotionCompletion], motions: list[MotionHandle]) -> None:
    require(set(over) == set(motions), f"the monitor named a rule: of {motions}, {sorted(over)} ended")
    for how in over.values():
        require(
            how == MotionCompletion(False, f"monitor:{MONITOR_RULE}"),
            f"the monitor named a rule, but one motion ended with {how}",
        )


def _require_ended_for_good(subject: PlantUnderTest, plant: Plant) -> None:
    """Check that nothing goes on by itself, and that a new motion runs to its own end."""
    before = values_of(plant.observe())
    new = begin_motion(plant, subject.parallel_action)
    over = plant.advance(RecordingMonitor(), plant.now() + MOTION_TIMEOUT_S)
    require(over == {new: MotionCompletion(True)}, f"{new} was begun after all had ended; {over} ended")
    require_unchanged(subject, before, values_of(plant.observe()), "after everything came to rest")


def _require_braking_distance(
    subject: PlantUnderTest, watch: RecordingMonitor, after: Mapping[str, Any]
) -> None:
    """Check that joints and base braked within their limits from the speeds last seen.

    At most: braking evenly within `max_stop_time`, v·T/2, and two ticks until it begins. At least: v²/2a.
    """
    if subject.period is None:
        return
    moving = [values for time, values in watch.seen if time - subject.period < watch.rule_time]
    if subject.deceleration:
        before, last = (values[subject.joint_variable] for values in moving[-2:])
        rest = after[subject.joint_variable]
        speeds = [(b - a) / subject.period for a, b in zip(before, last, strict=True)]
        require(dist(speeds, [0.0] * len(speeds)) > 0.0, "nothing moved at the time of the stop")
        for v, a, was, now in zip(speeds, subject.deceleration, last, rest, strict=True):
            way = (now - was) * (1.0 if v > 0.0 else -1.0)
            _check_braking(subject, abs(v), a, way, "a joint", "rad or m")
    if subject.base_deceleration:
        before, last = (values[subject.base_variable] for values in moving[-2:])
        rest = after[subject.base_variable]
        speed = dist(before, last) / subject.period
        require(speed > 0.0, "the base did not move at the time of the stop")
        _check_braking(subject, speed, subject.base_deceleration, dist(last, rest), "the base", "m")


def _check_braking(subject: PlantUnderTest, v: float, a: float, way: float, what: str, unit: str) -> None:
    assert subject.period is not None  # noqa: S101  for the type checker
    most = v * (subject.max_stop_time / 2.0 + 2.0 * subject.period) + subject.tracking_tolerance
    least = v * v / (2.0 * a) - subject.tracking_tolerance
    require(way <= most, f"while stopping, {what} moved by {way:.4f} {unit}; {most:.4f} would be enough")
    require(way >= least - 1e-9, f"a stop within the limits needs {least:.4f} {unit}; it took {way:.4f}")
