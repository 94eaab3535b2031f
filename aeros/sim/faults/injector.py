"""Inject declared faults into a physics plant and report each as an event.

Each fault counts its own opportunities. When one is taken, the fault begins at once or after its delay;
then it acts tick by tick, independently of all others. A fault never moves an object to a place and never
changes a predicate.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from numpy.random import Generator

from aeros.runtime.ports import CameraPicture
from aeros.sim.faults.degradation import NO_DEGRADATION, Degradation, DegradationApplier
from aeros.sim.faults.effects import physical_effect, picture_effect
from aeros.sim.faults.model import CameraOpportunity, Fault, Opportunity, SkillOpportunity, TimedOpportunity
from aeros.sim.faults.opportunities import OpportunitySampler
from aeros.sim.physics import NoDisturbance, PlantParts
from aeros.sim.randomness import RandomSource
from aeros.spec.declared.faults import MisplacedPictureFault, MissedPictureFault
from aeros.spec.diagnostics.errors import MisuseError


class FaultEvent(NamedTuple):
    """Something that a fault did, at a time on the plant's clock.

    Attributes:
        time: s.
        event: `fault-started` when it begins; `fault-ended` when it ends; `fault-not-triggered` when the
            skill ended before the fault could begin.
        fault: its name.
        text: for people.
        opportunity: number of the fault's opportunity, from 1.
    """

    time: float
    event: str
    fault: str
    text: str
    opportunity: int


@dataclass(eq=False)
class _PendingFault:
    """A fault that waits to begin at `start_tick`; None until the robot first holds something."""

    fault: Fault
    opportunity_kind: SkillOpportunity
    opportunity: int
    rng: Generator
    start_tick: int | None


@dataclass(eq=False)
class _ActiveFault:
    """A fault that has begun, and its effect tick by tick."""

    fault: Fault
    opportunity: int
    ticks: Iterator[Degradation]


class FaultInjector(NoDisturbance):
    """Faults on one plant, in one run.

    Args:
        faults: the declared faults; their names differ.
        seed: of occurrence and of random effects.
        on_event: called with each event as it happens.
    """

    def __init__(self, faults: Sequence[Fault], seed: int, on_event: Callable[[FaultEvent], None]) -> None:
        chance = RandomSource(seed)
        self._faults = tuple(faults)
        self._draws = {fault.name: OpportunitySampler(fault, chance) for fault in faults}
        self._on_event = on_event
        self._waiting: list[_PendingFault] = []
        self._acting: list[_ActiveFault] = []
        self._under_way: Counter[str] = Counter()

    @property
    def equivalent_rates(self) -> tuple[float, float]:
        """Open interval of rates of all faults with which this run would be the same.

        See `OpportunitySampler.equivalent_rates`.
        """
        each = [draws.equivalent_rates for draws in self._draws.values()]
        return max((low for low, _ in each), default=0.0), min((high for _, high in each), default=1.0)

    def attach(self, parts: PlantParts) -> None:
        """Implement `NoDisturbance.attach`."""
        self._parts = parts
        self._world = parts.world
        self._applier = DegradationApplier(parts)

    def skill_began(self, skill: str) -> None:
        """Implement `NoDisturbance.skill_began`: each fault on this skill has an opportunity."""
        self._under_way[skill] += 1
        for fault in self._faults:
            trigger = fault.opportunity
            if isinstance(trigger, SkillOpportunity) and trigger.skill == skill:
                rng = self._draws[fault.name].next()
                if rng is not None:
                    start_tick = None if trigger.from_first_grip else self._world.ticks + trigger.delay_ticks
                    self._waiting.append(
                        _PendingFault(fault, trigger, self._last_opportunity(fault), rng, start_tick)
                    )

    def skill_ended(self, skill: str) -> None:
        """Implement `NoDisturbance.skill_ended`: faults that still wait in this invocation do not begin."""
        self._under_way[skill] -= 1
        passed = [pending for pending in self._waiting if pending.opportunity_kind.skill == skill]
        self._waiting = [pending for pending in self._waiting if pending.opportunity_kind.skill != skill]
        for pending in passed:
            self._emit(
                "fault-not-triggered",
                pending.fault,
                pending.opportunity,
                f"not triggered: `{skill}` ended first",
            )

    def before_tick(self) -> None:
        """Begin the faults that are due, and apply the combined effect of all active ones."""
        self._begin_timed()
        self._begin_pending()
        now = NO_DEGRADATION
        for active in list(self._acting):
            degradation = next(active.ticks, None)
            if degradation is not None:
                now = now.combine_worst(degradation)
            else:
                self._acting.remove(active)
                self._emit("fault-ended", active.fault, active.opportunity, "is over")
        self._applier.apply(now)

    def disturb_picture(self, picture: CameraPicture) -> CameraPicture:
        """Implement `NoDisturbance.disturb_picture`: each fault on this camera has an opportunity."""
        for fault in self._faults:
            kind = fault.kind
            if isinstance(kind, MissedPictureFault | MisplacedPictureFault) and self._is_opportunity(
                fault.opportunity, picture.camera
            ):
                rng = self._draws[fault.name].next()
                if rng is not None:
                    self._emit("fault-started", fault, self._last_opportunity(fault), "happens")
                    picture = picture_effect(kind, rng)(picture)
        return picture

    # Internals.

    def _is_opportunity(self, opportunity: Opportunity, camera: str) -> bool:
        """Return True if a picture that `camera` takes now is an opportunity."""
        if not isinstance(opportunity, CameraOpportunity) or opportunity.camera != camera:
            return False
        return opportunity.while_skill is None or self._under_way[opportunity.while_skill] > 0

    def _begin_timed(self) -> None:
        ticks = self._world.ticks
        for fault in self._faults:
            trigger = fault.opportunity
            if isinstance(trigger, TimedOpportunity) and ticks > 0 and ticks % trigger.period_ticks == 0:
                rng = self._draws[fault.name].next()
                if rng is not None:
                    self._begin(fault, self._last_opportunity(fault), rng)

    def _begin_pending(self) -> None:
        if not self._waiting:
            return
        ticks = self._world.ticks
        holding = (
            any(pending.start_tick is None for pending in self._waiting) and self._parts.robot.is_holding()
        )
        for pending in self._waiting:
            if pending.start_tick is None and holding:
                pending.start_tick = ticks + pending.opportunity_kind.delay_ticks
        due = [
            pending
            for pending in self._waiting
            if pending.start_tick is not None and pending.start_tick <= ticks
        ]
        self._waiting = [pending for pending in self._waiting if pending not in due]
        for pending in due:
            self._begin(pending.fault, pending.opportunity, pending.rng)

    def _begin(self, fault: Fault, opportunity: int, rng: Generator) -> None:
        if isinstance(fault.kind, MissedPictureFault | MisplacedPictureFault):
            raise MisuseError(f"`{fault.name}` is a fault of pictures and needs `at: look`")
        name = f"{fault.name} {opportunity}"
        ticks = physical_effect(fault.kind, rng, name, self._parts)
        self._acting.append(_ActiveFault(fault, opportunity, ticks))
        self._emit("fault-started", fault, opportunity, "begins")

    def _last_opportunity(self, fault: Fault) -> int:
        """Return the number of the latest opportunity of this fault."""
        return self._draws[fault.name].count

    def _emit(self, event: str, fault: Fault, opportunity: int, what: str) -> None:
        text = f"fault `{fault.name}` {what} (opportunity {opportunity})"
        self._on_event(FaultEvent(self._world.time, event, fault.name, text, opportunity))
