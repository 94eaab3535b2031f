"""The plant under test, its author's statements about it, and helpers that the checks share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from math import dist, inf
from typing import Any, Final

from aeros.runtime.ports import JointVector, MotionCompletion, MotionHandle, Plant, Readings
from aeros.sim.clock import TICK
from aeros.skill import Action

MONITOR_RULE: Final = "conformance"
"""Name of the rule that the suite's monitor reports as broken."""

MOTION_TIMEOUT_S: Final = 120.0
"""Plant time after which a motion counts as never ending, s."""


class ConformanceError(AssertionError):
    """A plant breaks a promise of its port; the message says which and how."""


@dataclass(frozen=True)
class PlantUnderTest:
    """A kind of plant and its author's statements about it; the checks hold the plant to both.

    Attributes:
        make_plant: makes a new plant at rest, with no motion under way. Each check makes its own and closes
            it.
        motion_action: an action that moves the robot for half a second or more from a new plant's state.
        parallel_action: an action that shares no actuator with it and ends at least half a second later.
        period: of control ticks, s; None for a plant without ticks, whose motions take effect at once.
        tracking_tolerance: greatest distance of a measured joint from its profile, rad (or of the base, m).
        max_overshoot: by how much a measured speed may exceed the profile's peak, rad/s (or m/s).
        deceleration: greatest with which each joint comes to rest, rad/s²; () if joints are not moved.
        base_deceleration: greatest with which the base comes to rest, m/s²; 0 if it is not moved.
        max_stop_time: longest time that coming to rest takes from the speeds of `motion_action`, s.
        noise: greatest change of a measured joint (rad) or position (m) while nothing moves.
        skill: one that the plant knows, as `MODULE.SKILL`.
        contact_actions: the last moves in contact, under feedback; the others bring a new plant's robot
            there; () for a plant without such an action.
        parallel_actions: an action that drives the base for a second or more, and one that moves the arm
            meanwhile; () for a plant without such actions.
        look_action: an action that takes a picture with one camera; None for a plant without cameras.
        handover: longest time at the beginning or the end of a motion in which the robot stands and reports
            nothing, as its driver changes over, s; 0 if it reports at every tick.
        repeats: True if the same actions on a new plant give the same ticks, bit for bit, as of a simulator;
            False for a robot, of which the checks that compare two runs allow for noise and tolerances.
        joint_variable: vocabulary name of the joint positions.
        base_variable: vocabulary name of the base position.
    """

    make_plant: Callable[[], Plant]
    motion_action: Action
    parallel_action: Action
    period: float | None = TICK
    tracking_tolerance: float = 0.0
    max_overshoot: float = 0.0
    deceleration: JointVector = ()
    base_deceleration: float = 0.0
    max_stop_time: float = 0.0
    noise: float = 0.0
    skill: str = "module.skill"
    contact_actions: tuple[Action, ...] = ()
    parallel_actions: tuple[Action, Action] | tuple[()] = ()
    look_action: Action | None = None
    handover: float = 0.0
    repeats: bool = True
    joint_variable: str = "joint_position"
    base_variable: str = "base_position"

    @contextmanager
    def plant(self) -> Iterator[Plant]:
        """Make a new plant, and close it at the end.

        Yields:
            The plant, at the start of its clock.
        """
        plant = self.make_plant()
        try:
            yield plant
        finally:
            plant.close()

    @property
    def tick(self) -> float:
        """Longest time between two calls of the monitor, s; 0 if motions take effect at once."""
        return self.period or 0.0


class RecordingMonitor:
    """A monitor that records its calls as (time, values).

    Args:
        rule_time: plant time from which it names `MONITOR_RULE`, s; by default never.
        ignored_calls: number of first calls in which it does not name it.

    Attributes:
        seen: time, s, and values by vocabulary name of each call.
        rule_time: as given.
    """

    def __init__(self, rule_time: float = inf, ignored_calls: int = 0) -> None:
        self.seen: list[tuple[float, Mapping[str, Any]]] = []
        self.rule_time: float = rule_time
        self._ignored_calls = ignored_calls

    def __call__(self, now: float, values: Mapping[str, Any]) -> str | None:
        """Record the call."""
        self.seen.append((now, dict(values)))
        return MONITOR_RULE if now >= self.rule_time and len(self.seen) > self._ignored_calls else None

    def history(self, name: str) -> list[Any]:
        """Return all values of a variable.

        Args:
            name: of the variable.

        Returns:
            Its values, in the order of the calls that have it.
        """
        return [values[name] for _, values in self.seen if name in values]


def require(holds: bool, promise: str) -> None:
    """Check a promise.

    Args:
        holds: True if the plant keeps it.
        promise: the message if it does not.

    Raises:
        ConformanceError: it does not hold.
    """
    if not holds:
        raise ConformanceError(promise)


def values_of(readings: Readings) -> dict[str, Any]:
    """Drop the times of readings.

    Args:
        readings: by vocabulary name.

    Returns:
        The values by vocabulary name.
    """
    return {name: reading.value for name, reading in readings.items()}


def begin_motion(plant: Plant, action: Action) -> MotionHandle:
    """Plan and begin an action as the runtime does.

    Args:
        plant: the plant.
        action: an action that it can do.

    Returns:
        The motion.

    Raises:
        ConformanceError: the plant refuses it.
    """
    plan = plant.plan(action)
    require(
        not isinstance(plan, MotionCompletion),
        f"it cannot plan `{action.kind}`, which its subject declares: {plan}",
    )
    motion = plant.begin(action, plan)
    require(
        not isinstance(motion, MotionCompletion),
        f"it cannot begin the motion that it has just planned: {motion}",
    )
    assert not isinstance(motion, MotionCompletion)  # noqa: S101  for the type checker
    return motion


def wait_for_end(plant: Plant, motion: MotionHandle, watch: RecordingMonitor) -> MotionCompletion:
    """Advance until a motion ends, whatever other motions end before.

    Args:
        plant: the plant.
        motion: the motion.
        watch: the monitor.

    Returns:
        The completion of the motion.

    Raises:
        ConformanceError: it has not ended after `MOTION_TIMEOUT_S`.
    """
    latest = plant.now() + MOTION_TIMEOUT_S
    while plant.now() < latest:
        over = plant.advance(watch, latest)
        if motion in over:
            return over[motion]
    raise ConformanceError(f"a motion has not ended after {MOTION_TIMEOUT_S:g} s")


def require_every_tick(subject: PlantUnderTest, times: Sequence[float], end: float) -> None:
    """Check that the monitor was asked at every tick of a stop, until the robot was at rest.

    Args:
        subject: the plant under test.
        times: plant times of the calls, from the one that named a rule, s.
        end: plant time at which the plant reported the stop's end, s.

    Raises:
        ConformanceError: it was not.
    """
    if subject.period is None:
        return
    gaps = [after - before for before, after in pairwise([*times, end])]
    require(
        max(gaps) <= max(1.5 * subject.period, subject.handover),
        f"during a stop the monitor was not asked for {max(gaps):.3f} s",
    )


def require_heeded_at_once(first: RecordingMonitor, later: RecordingMonitor) -> None:
    """Check that the tick after a rule was named is not the one that would have come without it.

    Args:
        first: the monitor of a run in which it named a rule.
        later: the monitor of the same run on a new plant, in which it named the rule a tick later.

    Raises:
        ConformanceError: both runs are the same until the tick after.
    """
    index = next(number for number, (time, _) in enumerate(first.seen) if time >= first.rule_time) + 1
    require(
        len(first.seen) > index and first.seen[index] != later.seen[index],
        "the monitor named a rule, and in the tick after it the plant went on as if it had not",
    )


def require_unchanged(
    subject: PlantUnderTest, before: Mapping[str, Any], after: Mapping[str, Any], meanwhile: str
) -> None:
    """Check that nothing moved: joints and positions within noise, booleans and words exactly equal.

    Args:
        subject: the plant under test.
        before: values by vocabulary name.
        after: values by vocabulary name, later.
        meanwhile: event in between, for the message.

    Raises:
        ConformanceError: a value changed, appeared or disappeared.
    """
    require(before.keys() == after.keys(), f"{meanwhile}: other values are measured than before")
    for name, was in before.items():
        now = after[name]
        if name == subject.joint_variable or _is_position(was):
            require(dist(was, now) <= subject.noise, f"{meanwhile}: `{name}` went from {was} to {now}")
        elif isinstance(was, bool | str):
            require(was == now, f"{meanwhile}: `{name}` went from {was} to {now}")


def _is_position(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 3 and all(isinstance(part, float) for part in value)
