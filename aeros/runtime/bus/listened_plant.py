"""A plant whose measurements listeners hear of; in everything else the plant that it wraps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from aeros.runtime.bus.message_publisher import RobotChain
from aeros.runtime.ports import (
    Monitor,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    PlannedMotion,
    Plant,
    Readings,
    Trajectory,
)
from aeros.skill import Action


class MeasurementListener(Protocol):
    """Who hears what is measured; it may not raise, and should not take long."""

    def on_tick(self, now: float, values: Mapping[str, Any], chain: RobotChain) -> None:
        """What was measured at the control tick at `now`, by vocabulary name, SI."""

    def on_observed(self, readings: Readings, chain: RobotChain) -> None:
        """What was measured, each value at its own time."""


class ListenedPlant:
    """Implements `ports.Plant` by `plant`, and tells `listeners` what is observed and each control tick.

    A plant is wrapped once, with as many listeners as there are.
    Of the robot it knows what plans say of it: the body, and where the base is, as long as nothing was
    begun since that may move the base.
    """

    def __init__(self, plant: Plant, *listeners: MeasurementListener) -> None:
        self._plant = plant
        self._listeners = listeners
        self._chain = RobotChain()
        self._travelling: set[MotionHandle] = set()

    def now(self) -> float:
        """See `Plant`."""
        return self._plant.now()

    def observe(self) -> Readings:
        """See `Plant`."""
        readings = self._plant.observe()
        for listener in self._listeners:
            listener.on_observed(readings, self._chain)
        return readings

    def plan(self, action: Action) -> PlannedMotion:
        """See `Plant`."""
        plan = self._plant.plan(action)
        if isinstance(plan, Trajectory):
            self._chain = RobotChain(plan.body, None if self._travelling else plan.base)
        return plan

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle | MotionCompletion:
        """See `Plant`."""
        begun = self._plant.begin(action, decided)
        if not isinstance(begun, MotionCompletion) and not _base_is_fixed(decided):
            self._travelling.add(begun)
            self._chain = self._chain._replace(base=None)
        return begun

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """See `Plant`; what the monitor says is passed on before anything is told."""

        def watching(now: float, values: Mapping[str, Any]) -> str | None:
            rule = monitor(now, values)
            for listener in self._listeners:
                listener.on_tick(now, values, self._chain)
            return rule

        ended = self._plant.advance(watching, until)
        self._travelling.difference_update(ended)
        return ended

    def halt(self, motion: MotionHandle) -> None:
        """See `Plant`."""
        self._plant.halt(motion)

    def stop(self) -> None:
        """See `Plant`."""
        self._plant.stop()
        self._travelling.clear()

    def skill_began(self, skill: str) -> None:
        """See `Plant`."""
        self._plant.skill_began(skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """See `Plant`."""
        self._plant.skill_ended(skill, finished=finished)

    def close(self) -> None:
        """See `Plant`."""
        self._plant.close()


def _base_is_fixed(plan: PlannedMotion | None) -> bool:
    """Whether the plant has said that the base does not move."""
    return isinstance(plan, NoMotion) or (isinstance(plan, Trajectory) and not any(plan.base_path))
