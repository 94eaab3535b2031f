"""Makes things go wrong on a physics plant, as declared, and says so.

Each fault counts its own opportunities.  One that is taken begins at once, or after its delay; then it
acts tick by tick, beside all others.  Nothing is ever placed anywhere, and no predicate is touched.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from numpy.random import Generator

from aeros.sim.faults.degradation import UNHINDERED, Hindered, Hindrance
from aeros.sim.faults.effects import acting, seen
from aeros.sim.faults.model import Fault, OnLook, OnSkill, OnTime, Opportunity
from aeros.sim.faults.opportunities import Draws
from aeros.sim.physics import NoDisturbance, PlantParts
from aeros.sim.randomness import Chance
from aeros.sim.scenes.scene import Detected, Through
from aeros.spec.declared.faults import Misplace, Miss
from aeros.spec.diagnostics.errors import MisuseError


class Happening(NamedTuple):
    """Something a fault did, at a time on the plant's clock.

    event: `fault` when it begins, `fault-over` when it has ended, `fault-passed` when its opportunity was
        taken and over before it could begin.
    opportunity: which of the fault's opportunities it was, from 1.
    """

    time: float
    event: str
    fault: str
    text: str
    opportunity: int


@dataclass(eq=False)
class _Waiting:
    """A fault whose opportunity is taken; `due` is the tick it begins at, None until something is held."""

    fault: Fault
    on: OnSkill
    opportunity: int
    source: Generator
    due: int | None


@dataclass(eq=False)
class _Acting:
    """A fault that has begun, tick by tick."""

    fault: Fault
    opportunity: int
    ticks: Iterator[Hindrance]


class Injector(NoDisturbance):
    """Faults on one plant, in one run; `tell` hears of each as it happens."""

    def __init__(self, faults: Sequence[Fault], seed: int, tell: Callable[[Happening], None]) -> None:
        chance = Chance(seed)
        self._faults = tuple(faults)
        self._draws = {fault.name: Draws(fault, chance) for fault in faults}
        self._tell = tell
        self._waiting: list[_Waiting] = []
        self._acting: list[_Acting] = []
        self._under_way: Counter[str] = Counter()

    @property
    def alike(self) -> tuple[float, float]:
        """Rates of all faults between which everything would be as it is; see `Draws.alike`."""
        each = [draws.alike for draws in self._draws.values()]
        return max((low for low, _ in each), default=0.0), min((high for _, high in each), default=1.0)

    def attach(self, stage: PlantParts) -> None:
        """See `NoDisturbance`."""
        self._stage = stage
        self._world = stage.world
        self._hindered = Hindered(stage)

    def skill_began(self, skill: str) -> None:
        """Each fault on this skill has an opportunity."""
        self._under_way[skill] += 1
        for fault in self._faults:
            on = fault.opportunity
            if isinstance(on, OnSkill) and on.skill == skill:
                source = self._draws[fault.name].next()
                if source is not None:
                    due = None if on.once_holding else self._world.ticks + on.after
                    self._waiting.append(_Waiting(fault, on, self._number(fault), source, due))

    def skill_ended(self, skill: str) -> None:
        """What waited for a time in this invocation passes."""
        self._under_way[skill] -= 1
        passed = [one for one in self._waiting if one.on.skill == skill]
        self._waiting = [one for one in self._waiting if one.on.skill != skill]
        for one in passed:
            self._say("fault-passed", one.fault, one.opportunity, f"passes: `{skill}` ended before")

    def before_tick(self) -> None:
        """Begin what is due, let everything act that has begun, and bring it to motors and pads."""
        self._begin_by_time()
        self._begin_waiting()
        now = UNHINDERED
        for one in list(self._acting):
            hindrance = next(one.ticks, None)
            if hindrance is not None:
                now = now.worse(hindrance)
            else:
                self._acting.remove(one)
                self._say("fault-over", one.fault, one.opportunity, "is over")
        self._hindered.apply(now)

    def detection_filter(self, camera: str) -> Through:
        """Each fault on this camera has an opportunity; a miss hides whatever others made of a thing."""
        happening = []
        for fault in self._faults:
            kind = fault.kind
            if isinstance(kind, Miss | Misplace) and self._is_look(fault.opportunity, camera):
                source = self._draws[fault.name].next()
                if source is not None:
                    self._say("fault", fault, self._number(fault), "happens")
                    happening.append(seen(kind, source))

        def through(found: Detected) -> Detected:
            for one in happening:
                found = one(found)
            return found

        return through

    # Inside.

    def _is_look(self, on: Opportunity, camera: str) -> bool:
        """Whether a picture that `camera` takes now is an opportunity."""
        if not isinstance(on, OnLook) or on.camera != camera:
            return False
        return on.during is None or self._under_way[on.during] > 0

    def _begin_by_time(self) -> None:
        ticks = self._world.ticks
        for fault in self._faults:
            on = fault.opportunity
            if isinstance(on, OnTime) and ticks > 0 and ticks % on.period == 0:
                source = self._draws[fault.name].next()
                if source is not None:
                    self._begin(fault, self._number(fault), source)

    def _begin_waiting(self) -> None:
        if not self._waiting:
            return
        ticks = self._world.ticks
        holding = any(one.due is None for one in self._waiting) and self._stage.robot.is_holding()
        for one in self._waiting:
            if one.due is None and holding:
                one.due = ticks + one.on.after
        due = [one for one in self._waiting if one.due is not None and one.due <= ticks]
        self._waiting = [one for one in self._waiting if one not in due]
        for one in due:
            self._begin(one.fault, one.opportunity, one.source)

    def _begin(self, fault: Fault, opportunity: int, source: Generator) -> None:
        if isinstance(fault.kind, Miss | Misplace):
            raise MisuseError(f"`{fault.name}` is of what a camera sees, and goes with its looks")
        name = f"{fault.name} {opportunity}"
        ticks = acting(fault.kind, source, name, self._stage)
        self._acting.append(_Acting(fault, opportunity, ticks))
        self._say("fault", fault, opportunity, "begins")

    def _number(self, fault: Fault) -> int:
        """Which opportunity of this fault was drawn last."""
        return self._draws[fault.name].count

    def _say(self, event: str, fault: Fault, opportunity: int, what: str) -> None:
        text = f"fault `{fault.name}` {what} (opportunity {opportunity})"
        self._tell(Happening(self._world.time, event, fault.name, text, opportunity))
