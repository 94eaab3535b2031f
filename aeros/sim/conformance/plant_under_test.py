"""The plant that is held to its port, what its author says of it, and how the checks look at it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from math import dist, inf
from typing import Any, Final

from aeros.runtime.ports import JointVector, MotionCompletion, MotionHandle, Plant, Readings
from aeros.sim.clock import TICK
from aeros.skill import Action

MONITOR_RULE: Final = "conformance"
"""The rule that the suite's monitor names."""

MOTION_TIMEOUT_S: Final = 120.0
"""Plant seconds after which a motion that has not ended never will."""


class ConformanceError(AssertionError):
    """A plant breaks a promise; the message says which and how."""


@dataclass(frozen=True)
class PlantUnderTest:
    """A kind of plant and what its author states of it; checks hold it to both.

    make: a new plant at rest, with nothing under way.  Each check makes its own and closes it.
    moving: an action that moves the robot for half a second or more from where a new plant is.
    beside: an action that shares no actuator with it, and ends at least half a second later.
    period: of control ticks, s; None for a plant that has none, whose motions take effect at once.
    follows_within: farthest of a measured joint from its profile, rad (or of the base, m).
    overshoots: by how much a measured speed may exceed the profile's peak, rad/s (or m/s).
    deceleration: greatest that a joint comes to rest with, rad/s²; () where joints are not moved.
    base_deceleration: greatest that the base comes to rest with, m/s²; 0 where it is not moved.
    stops_within: longest time that coming to rest takes from the speeds of `motion_action`, s.
    noise: how much a measured joint (rad) or place (m) may change while nothing moves.
    skill: one that the plant has heard of, as `MODULE.SKILL`.
    pressing: actions of which the last moves in contact, under feedback, and the others bring the robot
        there from where a new plant is; () for a plant that has no such action.
    together: an action that drives the base for a second or more, and one that moves the arm meanwhile;
        () for a plant that has no such two.
    joints, base: the vocabulary's names for positions of joints and of the base.
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
    joint_variable: str = "joint_position"
    base_variable: str = "base_position"

    @contextmanager
    def plant(self) -> Iterator[Plant]:
        """A new plant, closed again."""
        plant = self.make_plant()
        try:
            yield plant
        finally:
            plant.close()

    @property
    def tick(self) -> float:
        """The longest time between two looks of the monitor, s; 0 where motions take effect at once."""
        return self.period or 0.0


class RecordingMonitor:
    """A monitor that notes what it sees: (time, values) of each look.

    names: it names `MONITOR_RULE` from this time on, plant seconds, though not in its first `forward_to`
        looks.
    """

    def __init__(self, names: float = inf, forward_to: int = 0) -> None:
        self.seen: list[tuple[float, Mapping[str, Any]]] = []
        self.names = names
        self._passing = forward_to

    def __call__(self, now: float, values: Mapping[str, Any]) -> str | None:
        """Note it."""
        self.seen.append((now, dict(values)))
        return MONITOR_RULE if now >= self.names and len(self.seen) > self._passing else None

    def history(self, name: str) -> list[Any]:
        """All values of `name`, in order."""
        return [values[name] for _, values in self.seen if name in values]


def require(holds: bool, promise: str) -> None:
    """Raise `ConformanceError` unless `holds`."""
    if not holds:
        raise ConformanceError(promise)


def values_of(readings: Readings) -> dict[str, Any]:
    """The values alone."""
    return {name: reading.value for name, reading in readings.items()}


def begin_motion(plant: Plant, action: Action) -> MotionHandle:
    """The motion of `action`, planned and begun as the runtime does it."""
    plan = plant.plan(action)
    require(
        not isinstance(plan, MotionCompletion),
        f"it cannot plan `{action.kind}`, which it was said to do: {plan}",
    )
    motion = plant.begin(action, plan)
    require(
        not isinstance(motion, MotionCompletion), f"it cannot begin what it has planned just before: {motion}"
    )
    assert not isinstance(motion, MotionCompletion)  # noqa: S101  for the type checker
    return motion


def wait_for_end(plant: Plant, motion: MotionHandle, watch: RecordingMonitor) -> MotionCompletion:
    """How `motion` ends, whatever else does before."""
    latest = plant.now() + MOTION_TIMEOUT_S
    while plant.now() < latest:
        over = plant.advance(watch, latest)
        if motion in over:
            return over[motion]
    raise ConformanceError(f"a motion has not ended after {MOTION_TIMEOUT_S:g} s")


def require_unchanged(
    subject: PlantUnderTest, before: Mapping[str, Any], after: Mapping[str, Any], meanwhile: str
) -> None:
    """Require that nothing moved: joints and places within noise, and no true became false or was lost."""
    require(before.keys() == after.keys(), f"{meanwhile}: other values are measured than before")
    for name, was in before.items():
        now = after[name]
        if name == subject.joint_variable or _is_position(was):
            require(dist(was, now) <= subject.noise, f"{meanwhile}: `{name}` went from {was} to {now}")
        elif isinstance(was, bool | str):
            require(was == now, f"{meanwhile}: `{name}` went from {was} to {now}")


def _is_position(value: Any) -> bool:
    return isinstance(value, tuple) and len(value) == 3 and all(isinstance(part, float) for part in value)
