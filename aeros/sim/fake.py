"""The in-memory plant for tests: says what it is told to, remembers every call, fails on demand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from aeros.runtime.ports import Completion, Monitor, Motionless, Plan, Reading, Readings
from aeros.skill import Action


class FakePlant:
    """Implements `aeros.runtime.ports.Plant`.

    values: what is measured, by vocabulary name, SI; change it at will.
    time: the plant's clock, s; change it at will.
    planned: what it says of the motion of every action.
    decided: the motions that its actions were executed with, in order.
    completions: how the actions end, in order; after the last, every action completes.
    during: what the monitor sees under way, over `values`, at each tick of every action.
    duration: plant seconds an action takes; one that would pass its deadline stops at it.
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
        self.stale = 0.0
        self.failing: dict[str, BaseException] = {}
        self.calls: list[tuple[Any, ...]] = []

    def script(self, completions: Iterable[Completion]) -> None:
        """Let the next actions end like this."""
        self.completions.extend(completions)

    @property
    def executed(self) -> list[Action]:
        """The actions that were executed, in order."""
        return [call[1] for call in self.calls if call[0] == "execute"]

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

    def execute(
        self, action: Action, monitor: Monitor, deadline: float, decided: Plan | None = None
    ) -> Completion:
        """Show the monitor what is scripted, then end as is scripted."""
        self._call("execute", action, deadline)
        self.decided.append(decided)
        for tick in self.during or [{}]:
            rule = monitor(self.now(), {**self.values, **tick})
            if rule is not None:
                return Completion(False, f"monitor:{rule}")
        if self.time + self.duration > deadline:
            self.time = deadline
            return Completion(False, "deadline")
        self.time += self.duration
        return self.completions.pop(0) if self.completions else Completion(True)

    def stop(self) -> None:
        """Remember the stop."""
        self._call("stop")

    def skill_began(self, skill: str) -> None:
        """Remember the beginning."""
        self._call("skill_began", skill)

    def skill_ended(self, skill: str, *, finished: bool) -> None:
        """Remember the end."""
        self._call("skill_ended", skill, finished)

    def close(self) -> None:
        """Remember the close."""
        self._call("close")

    def _call(self, method: str, *arguments: Any) -> None:
        self.calls.append((method, *arguments))
        self._fail(method)

    def _fail(self, method: str) -> None:
        if method in self.failing:
            raise self.failing[method]
