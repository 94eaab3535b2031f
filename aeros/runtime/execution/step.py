"""Steps as the executor has them: the run of a skill, what was decided of it, and what it moves."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from math import isfinite
from typing import Any, Final, NamedTuple

from aeros.runtime.audit.log import DecisionCounts
from aeros.runtime.execution.hold_condition import HoldCondition
from aeros.runtime.gate.decision import Caller
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.ports import (
    ColumnNames,
    EndedStep,
    MotionCompletion,
    MotionHandle,
    PlannedMotion,
    Readings,
    Snapshot,
    StepHandle,
    StepResult,
    StepStatus,
)
from aeros.runtime.skills.in_process_run import SkillRunProtocol, SkillRunResult
from aeros.skill import Action
from aeros.spec.model.cause import Cause
from aeros.spec.model.model import Ecm, Site, Skill


class ActiveMotion(NamedTuple):
    """A step's action on the plant.

    plan: what the plant said it would be, where it was asked.
    is_halting: it comes to rest before its end.
    """

    handle: MotionHandle
    active_action: ActiveAction
    plan: PlannedMotion | None
    is_halting: bool = False


class ObservationFilter:
    """The state that a module may sense under a site: that of the sensors which it declares, while fresh."""

    def __init__(self, ecm: Ecm, site: Site) -> None:
        self.site = site
        self._sensed = [
            (name, declared.max_age)
            for name, declared in site.state.items()
            if declared.sensor in ecm.requested_access.sensors and declared.max_age is not None
        ]
        # Of the moments that are observed: their names, those of them that are sensed, with their places.
        self._order: ColumnNames | None = None
        self._places: list[tuple[str, int]] = []
        # The last column, and what was sensed of it.
        self._column: tuple[Any, ...] = ()
        self._values: dict[str, Any] = {}

    def observe(self, readings: Readings, now: float) -> dict[str, Any]:
        """Select what the module senses of `readings`, as far as it is fresh.

        A reading is fresh when it is at most its variable's `max_age` old and not from the future.
        Everything else is left out, which a skill reads as unknown.

        Args:
            readings: everything that is measured.
            now: plant seconds.

        Returns:
            Values by vocabulary name, SI; the caller may change it.
        """
        if not isfinite(now):
            return {}
        if type(readings) is Snapshot and readings.time == now:
            return self._observe_moment(readings)
        return {
            name: reading.value
            for name, max_age in self._sensed
            if (reading := readings.get(name)) is not None
            and (reading.time == now or _is_recent(reading.time, now, max_age))
        }

    def _observe_moment(self, moment: Snapshot) -> dict[str, Any]:
        """Select what is sensed of readings that were all taken now."""
        if moment.order is not self._order:
            self._order, self._column, places = moment.order, (), moment.order.places
            self._places = [(name, places[name]) for name, _ in self._sensed if name in places]
        if moment.column is not self._column:
            column = self._column = moment.column
            self._values = {name: column[place] for name, place in self._places}
        # A copy, as the skill may change it.
        return dict(self._values)


def _is_recent(time: float, now: float, max_age: Fraction) -> bool:
    return isfinite(time) and 0 <= Fraction(now) - Fraction(time) <= max_age


@dataclass
class ActiveStep:
    """A step that was started.

    deadline: plant seconds; runs once it has begun, which is when it holds what it needs.
    hold: what must be measured as long as it runs.
    actions: how often the skill was asked for one.
    observation_filter: what its skill may sense, by the site that governed at its last observation.
    asked: the action that it asked for, not yet decided.
    may_pass: what it was denied last may be allowed later.
    ending: how it ends, from when that is known; what it moves may still have to come to rest.
    """

    ecm: Ecm
    skill: Skill
    caller: Caller
    run: SkillRunProtocol
    hold_condition: HoldCondition | None = None
    deadline: float = 0.0
    has_begun: bool = False
    request_count: int = 0
    observation_filter: ObservationFilter | None = None
    requested_action: Action | None = None
    active_motion: ActiveMotion | None = None
    is_transient: bool = False
    result: SkillRunResult | None = None
    decision_counts: DecisionCounts = field(default_factory=DecisionCounts)

    @property
    def name(self) -> str:
        """The skill, as `MODULE.SKILL`."""
        return f"{self.caller.module}.{self.caller.skill}"

    @property
    def is_due(self) -> bool:
        """Whether its skill is the next to do something."""
        return self.has_begun and self.active_motion is None

    @property
    def is_finished(self) -> bool:
        """Whether the skill ran to its own end."""
        return self.result is not None and self.result.status is StepStatus.FINISHED

    def close_skill(self) -> None:
        """End the skill; where its own clean-up raises, the ending says so."""
        complaint = self.run.close()
        if complaint is not None and self.result is not None:
            reason = f"{self.result.reason}; and its own clean-up raised {complaint}"
            self.result = self.result._replace(reason=reason)


class StepTable:
    """The steps of one executor: those that have not ended, and the results of those that have.

    steps: by handle, in the order in which they were started.
    hold_conditions: of these steps, by handle, those conditions that must be measured as long as they run.
    results: of steps that have ended, until the caller has fetched them.
    """

    def __init__(self) -> None:
        self.steps: dict[StepHandle, ActiveStep] = {}
        self.hold_conditions: dict[StepHandle, HoldCondition] = {}
        self.results: dict[StepHandle, StepResult] = {}
        self._started = 0

    def add(self, step: ActiveStep) -> StepHandle:
        """Add a step that is started, and number it."""
        self._started += 1
        handle = StepHandle(self._started)
        self.steps[handle] = step
        if step.hold_condition is not None:
            self.hold_conditions[handle] = step.hold_condition
        return handle

    def next_ended(self) -> EndedStep:
        """Remove the first of the results and return it."""
        handle = next(iter(self.results))
        return EndedStep(handle, self.results.pop(handle))

    def active_motions(self) -> list[ActiveMotion]:
        """List what is under way, what comes to rest included."""
        return [step.active_motion for step in self.steps.values() if step.active_motion is not None]

    def is_moving(self) -> bool:
        """Say whether anything is under way."""
        for step in self.steps.values():  # noqa: SIM110  `any` takes three times as long, at every action
            if step.active_motion is not None:
                return True
        return False


HALTED: Final = SkillRunResult(StepStatus.HALTED, "the operator stops it")
"""How a step ends when the operator stops everything."""


def ending_unheld(cause: Cause | None) -> SkillRunResult | None:
    """Return how a step ends whose hold-condition is not measured; None where nothing objects."""
    return None if cause is None else SkillRunResult(StepStatus.HOLD_LOST, str(cause), causes=(cause,))


def ending_stopped(completion: MotionCompletion) -> SkillRunResult:
    """Return how a step ends whose motion did not reach its end."""
    return SkillRunResult(StepStatus.STOPPED, completion.reason or "the plant gave no reason")


def required_resources(skill: Skill) -> frozenset[str]:
    """What a step of the skill holds: its resources and its actuators."""
    return skill.resources | {_actuator(name) for name in skill.actuators}


def resource_capacities(site: Site) -> dict[str, int]:
    """How many steps may hold each resource at one time, and each actuator: one."""
    moved = {name for kind in site.kinds.values() for name in kind.actuators}
    return {**site.resources, **{_actuator(name): 1 for name in moved}}


def _actuator(name: str) -> str:
    """Named apart: a site may have a resource of the same name, and count it otherwise."""
    return f"actuator {name}"
