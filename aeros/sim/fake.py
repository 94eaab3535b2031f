"""The in-memory plant for tests: says what it is told to, remembers every call, fails on demand."""

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
    """Implements `aeros.runtime.ports.Plant`.

    values: what is measured, by vocabulary name, SI; change it at will.
    time: the plant's clock, s; change it at will.
    planned: what it says of the motion of every action.
    decided: the motions that its actions were begun with, in order.
    completions: how the actions end, in order; after the last, every action completes.
    during: what the monitor sees, over `values`, at each tick of every `advance`.
    duration: plant seconds an action takes.
    durations: likewise, of the next actions to begin, in order; after the last, `duration`.
    stale: seconds by which readings lag behind the clock.
    failing: by method name, what calling it raises.
    calls: method names with their arguments, in order; `now` and `observe` are not among them.
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
        """Let the next actions end like this."""
        self.completions.extend(completions)

    @property
    def executed(self) -> list[Action]:
        """The actions that were begun, in order."""
        return [call[1] for call in self.calls if call[0] == "begin"]

    def call_count(self, method: str) -> int:
        """How often `method` was called."""
        return sum(call[0] == method for call in self.calls)

    def now(self) -> float:
        """The plant's clock."""
        self._fail("now")
        return self.time

    def observe(self) -> Readings:
        """`values`, measured `reading_age` seconds ago."""
        self._fail("observe")
        return {name: Reading(value, self.time - self.reading_age) for name, value in self.values.items()}

    def plan(self, action: Action) -> PlannedMotion:
        """`planned`."""
        self._call("plan", action)
        return self.planned

    def begin(self, action: Action, decided: PlannedMotion | None = None) -> MotionHandle:
        """Remember the beginning."""
        self._call("begin", action)
        self.decided.append(decided)
        motion = MotionHandle(len(self.executed))
        self._ends[motion] = self.time + (self.durations.pop(0) if self.durations else self.duration)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[MotionHandle, MotionCompletion]:
        """Show the monitor what is scripted, then let end what ends next, as is scripted."""
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
        """Remember the halt."""
        self._call("halt", motion)
        self._halted.append(motion)

    def stop(self) -> None:
        """Remember the stop."""
        self._call("stop")
        self._ends.clear()
        self._halted.clear()

    def skill_began(self, skill: str) -> None:
        """Remember the beginning."""
        self._call("skill_began", skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Remember the end."""
        self._call("skill_ended", skill, finished)

    def close(self) -> None:
        """Remember the close."""
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
