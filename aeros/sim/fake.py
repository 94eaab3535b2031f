"""An in-memory plant for tests: it gives scripted answers, records every call and fails on demand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import Any

from aeros.runtime.ports import (
    Monitor,
    MotionCompletion,
    MotionHandle,
    NoMotion,
    PlannedMotion,
    Reading,
    Readings,
)
from aeros.skill import Action


class FakePlant:
    """Implementation of `aeros.runtime.ports.Plant` with scripted answers.

    Attributes:
        values: measured values by vocabulary name, SI; tests may change them at any time.
        time: the plant's clock, s; tests may change it at any time.
        planned: the plan that it returns for every action.
        decided: the plan that each action was begun with, in order.
        completions: ends of the next actions, in order; after the last, every action completes.
        during: values that the monitor sees, over `values`, at each tick of every `advance`.
        duration: plant seconds that an action takes.
        durations: the same for the next actions to begin, in order; after the last, `duration` holds.
        reading_age: seconds by which readings are older than the clock.
        failing: exception that a call raises, by method name.
        calls: method names with their arguments, in order, without `now` and `observe`.
    """

    def __init__(self, values: Mapping[str, Any] | None = None) -> None:
        self.values: dict[str, Any] = dict(values or {})
        self.time = 0.0
        self.planned: PlannedMotion = NoMotion("this plant has no body")
        self.decided: list[PlannedMotion | None] = []
        self.completions: list[MotionCompletion] = []
        self.during: list[Mapping[str, Any]] = []
        self.duration = 0.1
        self.durations: list[float] = []
        self.reading_age = 0.0
        self.failing: dict[str, BaseException] = {}
        self.calls: list[tuple[Any, ...]] = []
        self._ends: dict[MotionHandle, float] = {}
        self._halted: list[MotionHandle] = []

    def script(self, completions: Iterable[MotionCompletion]) -> None:
        """Set how the next actions end.

        Args:
            completions: one for each action, in order.
        """
        self.completions.extend(completions)

    @property
    def executed(self) -> list[Action]:
        """The actions that were begun, in order."""
        return [call[1] for call in self.calls if call[0] == "begin"]

    def call_count(self, method: str) -> int:
        """Count the calls of a method.

        Args:
            method: its name; `now` and `observe` are not recorded.

        Returns:
            The number of calls so far.
        """
        return sum(call[0] == method for call in self.calls)

    def now(self) -> float:
        """Implement `Plant.now`."""
        self._fail("now")
        return self.time

    def observe(self) -> Readings:
        """Implement `Plant.observe` with `values`, measured `reading_age` seconds ago."""
        self._fail("observe")
        return {name: Reading(value, self.time - self.reading_age) for name, value in self.values.items()}

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan` with `planned`."""
        self._call("plan", action)
        return self.planned

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle:
        """Implement `Plant.begin`: record the action and its plan, and schedule its end."""
        self._call("begin", action)
        self.decided.append(decided)
        motion = MotionHandle(len(self.executed))
        self._ends[motion] = self.time + (self.durations.pop(0) if self.durations else self.duration)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Implement `Plant.advance`: show the monitor the scripted ticks, then end the next motion."""
        self._call("advance", until)
        for tick in self.during or [{}]:
            rule = monitor(self.now(), {**self.values, **tick})
            if rule is not None:
                return self._end_motions(list(self._ends), MotionCompletion(False, f"monitor:{rule}"))
        if self._halted:
            return self._end_motions(self._halted, MotionCompletion(False, "halted"))
        ends = min(self._ends.values(), default=inf)
        if ends > until:
            self.time = max(self.time, until)
            return {}
        self.time = max(self.time, ends)
        first = next(motion for motion, at in self._ends.items() if at == ends)
        return self._end_motions(
            [first], self.completions.pop(0) if self.completions else MotionCompletion(True)
        )

    def halt(self, motion: MotionHandle) -> None:
        """Implement `Plant.halt`: record it; the motion ends in the next `advance`."""
        self._call("halt", motion)
        self._halted.append(motion)

    def stop(self) -> None:
        """Implement `Plant.stop`: record it and drop every motion."""
        self._call("stop")
        self._ends.clear()
        self._halted.clear()

    def skill_began(self, skill: str) -> None:
        """Implement `Plant.skill_began`: record it."""
        self._call("skill_began", skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Implement `Plant.skill_ended`: record it."""
        self._call("skill_ended", skill, finished)

    def close(self) -> None:
        """Implement `Plant.close`: record it."""
        self._call("close")

    def _end_motions(
        self, motions: list[MotionHandle], how: MotionCompletion
    ) -> Mapping[MotionHandle, MotionCompletion]:
        over = dict.fromkeys(motions, how)
        self._ends = {motion: at for motion, at in self._ends.items() if motion not in over}
        self._halted = [motion for motion in self._halted if motion not in over]
        return over

    def _call(self, method: str, *arguments: Any) -> None:
        self.calls.append((method, *arguments))
        self._fail(method)

    def _fail(self, method: str) -> None:
        if method in self.failing:
            raise self.failing[method]
