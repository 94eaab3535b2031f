"""The in-memory plant for tests: says what it is told to, remembers every call, fails on demand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import Any

from aeros.runtime.ports import Completion, Monitor, Motion, Motionless, Plan, Reading, Readings
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
        self.planned: Plan = Motionless("this plant has no body")
        self.decided: list[Plan | None] = []
        self.completions: list[Completion] = []
        self.during: list[Mapping[str, Any]] = []
        self.duration = 0.1
        self.durations: list[float] = []
        self.stale = 0.0
        self.failing: dict[str, BaseException] = {}
        self.calls: list[tuple[Any, ...]] = []
        self._ends: dict[Motion, float] = {}
        self._halted: list[Motion] = []

    def script(self, completions: Iterable[Completion]) -> None:
        """Let the next actions end like this."""
        self.completions.extend(completions)

    @property
    def executed(self) -> list[Action]:
        """The actions that were begun, in order."""
        return [call[1] for call in self.calls if call[0] == "begin"]

    def count(self, method: str) -> int:
        """How often `method` was called."""
        return sum(call[0] == method for call in self.calls)

    def now(self) -> float:
        """The plant's clock."""
        self._fail("now")
        return self.time

    def observe(self) -> Readings:
        """`values`, measured `stale` seconds ago."""
        self._fail("observe")
        return {name: Reading(value, self.time - self.stale) for name, value in self.values.items()}

    def plan(self, action: Action) -> Plan:
        """`planned`."""
        self._call("plan", action)
        return self.planned

    def begin(self, action: Action, decided: Plan | None = None) -> Motion:
        """Remember the beginning."""
        self._call("begin", action)
        self.decided.append(decided)
        motion = Motion(len(self.executed))
        self._ends[motion] = self.time + (self.durations.pop(0) if self.durations else self.duration)
        return motion

    def advance(self, monitor: Monitor, until: float) -> Mapping[Motion, Completion]:
        """Show the monitor what is scripted, then let end what ends next, as is scripted."""
        self._call("advance", until)
        for tick in self.during or [{}]:
            rule = monitor(self.now(), {**self.values, **tick})
            if rule is not None:
                return self._ended(list(self._ends), Completion(False, f"monitor:{rule}"))
        if self._halted:
            return self._ended(self._halted, Completion(False, "halted"))
        ends = min(self._ends.values(), default=inf)
        if ends > until:
            self.time = max(self.time, until)
            return {}
        self.time = max(self.time, ends)
        first = next(motion for motion, at in self._ends.items() if at == ends)
        return self._ended([first], self.completions.pop(0) if self.completions else Completion(True))

    def halt(self, motion: Motion) -> None:
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

    def _ended(self, motions: list[Motion], how: Completion) -> Mapping[Motion, Completion]:
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
