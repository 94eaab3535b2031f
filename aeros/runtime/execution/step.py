"""Steps of the executor: the run of a skill, the decisions on it, and its active motion."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from math import isfinite
from typing import Any, Final, NamedTuple

from aeros.runtime.execution.governor import FollowedConfiguration
from aeros.runtime.execution.hold_condition import HoldCondition
from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.monitor.monitor import RuntimeMonitor
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
from aeros.spec.model.ecm import Ecm, Skill
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared


class ActiveMotion(NamedTuple):
    """Action of a step that the plant is executing.

    Attributes:
        handle: names the motion to the plant.
        active_action: the decided action.
        plan: motion that the plant planned; None if it was not asked.
        is_halting: the motion is being brought to rest before its end.
    """

    handle: MotionHandle
    active_action: ActiveAction
    plan: PlannedMotion | None
    is_halting: bool = False


class ObservationFilter:
    """State that a module may sense under a site, under the names that its conditions use.

    These are fresh values of the sensors that it declares, also under its names for what it needs; of its own
    variables under short names; and of those that the site shares of modules it requires.
    """

    def __init__(self, ecm: Ecm, site: Site) -> None:
        self.site = site
        self._sensed = [
            (name, seen_as, declared.max_age)
            for name, declared in site.state.items()
            for seen_as in _names_for(ecm, site, name, declared)
            if declared.max_age is not None
        ]
        # Columns of the latest snapshot: all names, and the module's name and index of each sensed variable.
        self._order: ColumnNames | None = None
        self._places: list[tuple[str, int]]
        # The latest column, and the sensed values in it; all three are set with the first order.
        self._column: tuple[Any, ...] | None
        self._values: dict[str, Any]

    def observe(self, readings: Readings, now: float) -> dict[str, Any]:
        """Select what the module may sense of `readings`.

        A reading is fresh if it is at most its variable's `max_age` old and not from the future. Everything
        else is left out, which a skill reads as unknown.

        Args:
            readings: all measured values (SI) with their plant times (s), by name.
            now: plant seconds.

        Returns:
            Values (SI) by the module's name for the variable, in a new dict that the caller may change.
        """
        if not isfinite(now):
            return {}
        if type(readings) is Snapshot and readings.time == now:
            return self._observe_snapshot(readings)
        return {
            seen_as: reading.value
            for name, seen_as, max_age in self._sensed
            if (reading := readings.get(name)) is not None
            and (reading.time == now or _is_recent(reading.time, now, max_age))
        }

    def _observe_snapshot(self, snapshot: Snapshot) -> dict[str, Any]:
        """Select what is sensed of readings that were all taken now."""
        if snapshot.order is not self._order:
            self._order, self._column, places = snapshot.order, None, snapshot.order.places
            self._places = [(seen_as, places[name]) for name, seen_as, _ in self._sensed if name in places]
        if snapshot.column is not self._column:
            column = self._column = snapshot.column
            self._values = {name: column[place] for name, place in self._places}
        # A copy, because the skill may change it.
        return dict(self._values)


def _names_for(ecm: Ecm, site: Site, name: str, declared: Declared) -> tuple[str, ...]:
    """Return the names under which a module senses a state variable; none if it may not."""
    module, dot, short = name.partition(".")
    is_measured = declared.sensor is not None and "." not in declared.sensor
    if (not dot or is_measured) and declared.sensor not in ecm.requested_access.sensors:
        return ()
    if not dot:
        own = tuple(one for one, bound in ecm.names.variables.items() if bound == name)
        return own if name in ecm.names.variables else (*own, name)
    if module == ecm.id:
        return (short,)
    is_readable = name in site.perception.shared or (site.perception.public and declared.is_public)
    return (name,) if is_readable and module in ecm.required_modules else ()


def _is_recent(time: float, now: float, max_age: Fraction) -> bool:
    return isfinite(time) and 0 <= Fraction(now) - Fraction(time) <= max_age


@dataclass
class ActiveStep:
    """A step that was started and has not ended.

    Attributes:
        ecm: the module that has the skill.
        skill: the skill that it runs.
        caller: module, skill and inputs, as the gate sees them.
        run: the run of its skill.
        hold_conditions: conditions that must be measured as true while it runs.
        deadline: plant seconds at which its timeout passes; set when it begins.
        is_running: it holds its resources, so its skill may act.
        request_count: number of actions that the skill was asked for.
        answer_time: real time that its skill took for its answers so far, s.
        observation_filter: selects the values that its skill may sense, by the site at its last
            observation.
        requested_action: action that it asked for and that is not decided yet.
        pending_legs: actions that lead round an obstacle to where the skill asked for; it goes on after them.
        active_motion: its motion on the plant.
        is_transient: its latest denial may turn into an allowance later.
        denials: endings that its denials for good would have been; each is given to the skill, which may
            try another way.
        is_denial_open: the skill does not know of the last one yet.
        is_held_back: it was just denied, so that the motions of others go on first.
        result: its ending; None until that is known.  Its motion may still have to come to rest.
        decision_counts: number of decisions on it so far, by kind.
    """

    ecm: Ecm
    skill: Skill
    caller: Caller
    run: SkillRunProtocol
    hold_conditions: tuple[HoldCondition, ...] = ()
    deadline: float = 0.0
    is_running: bool = False
    request_count: int = 0
    answer_time: float = 0.0
    observation_filter: ObservationFilter | None = None
    requested_action: Action | None = None
    pending_legs: deque[Action] = field(default_factory=deque)
    active_motion: ActiveMotion | None = None
    is_transient: bool = False
    denials: list[SkillRunResult] = field(default_factory=list)
    is_denial_open: bool = False
    is_held_back: bool = False
    result: SkillRunResult | None = None
    decision_counts: Counter[DecisionKind] = field(default_factory=Counter)

    @property
    def name(self) -> str:
        """The skill, as `MODULE.SKILL`."""
        return f"{self.caller.module}.{self.caller.skill}"

    @property
    def is_due(self) -> bool:
        """True if its skill acts next: it has begun and has no active motion."""
        return self.is_running and self.active_motion is None

    @property
    def is_finished(self) -> bool:
        """True if the skill ran to its own end."""
        return self.result is not None and self.result.status is StepStatus.FINISHED

    def close_skill(self) -> None:
        """Close the run of the skill; if the skill's own clean-up raises, add that to the result's reason."""
        complaint = self.run.close()
        if complaint is not None and self.result is not None:
            reason = f"{self.result.reason}; and its own clean-up raised {complaint}"
            self.result = self.result._replace(reason=reason)


class StepTable:
    """Steps of one executor: those that have not ended, and the results of those that have.

    Attributes:
        steps: by handle, in the order in which they were started.
        hold_conditions: by handle, the hold-conditions of these steps.
        results: by handle, results that the caller has not fetched yet.
    """

    def __init__(self) -> None:
        self.steps: dict[StepHandle, ActiveStep] = {}
        self.hold_conditions: dict[StepHandle, tuple[HoldCondition, ...]] = {}
        self.results: dict[StepHandle, StepResult] = {}
        self._last_handle = 0

    def add(self, step: ActiveStep) -> StepHandle:
        """Add a step and number it.

        Args:
            step: the step to add.

        Returns:
            Its handle.
        """
        self._last_handle += 1
        handle = StepHandle(self._last_handle)
        self.steps[handle] = step
        if step.hold_conditions:
            self.hold_conditions[handle] = step.hold_conditions
        return handle

    def next_ended(self) -> EndedStep:
        """Remove and return the oldest result; there must be one.

        Returns:
            Handle and result of a step that has ended.
        """
        handle = next(iter(self.results))
        return EndedStep(handle, self.results.pop(handle))

    def active_motions(self) -> list[ActiveMotion]:
        """List the active motions.

        Returns:
            One for each step that has one, including motions that are being brought to rest.
        """
        return [step.active_motion for step in self.steps.values() if step.active_motion is not None]

    def is_moving(self) -> bool:
        """Check all steps for motions on the plant.

        Returns:
            True if any step has an active motion.
        """
        for step in self.steps.values():  # noqa: SIM110  `any` takes three times as long, at every action
            if step.active_motion is not None:
                return True
        return False


def end_motions(
    table: StepTable,
    handles: Iterable[StepHandle],
    monitors: RuntimeMonitor,
    followed: FollowedConfiguration,
) -> None:
    """Mark motions as over: the monitor drops them, and a configuration held for them is released.

    Args:
        table: the executor's steps.
        handles: steps, with or without an active motion.
        monitors: watches the motions.
        followed: holds the configuration while any motion is active.
    """
    for handle in handles:
        step = table.steps[handle]
        if step.active_motion is not None:
            monitors.remove(step.active_motion.active_action)
            step.active_motion = None
    followed.release()


HALTED: Final = SkillRunResult(StepStatus.HALTED, "stopped by the operator")
"""Ending of every step when the operator stops the run."""


def ending_unheld(
    holds: Iterable[HoldCondition], violation: Callable[[HoldCondition], Cause | None]
) -> SkillRunResult | None:
    """Return the ending for a check of hold-conditions.

    Args:
        holds: the conditions.
        violation: tells why a condition is violated; None if it holds.

    Returns:
        The ending of the step for the first that is violated; None if all hold.
    """
    for hold in holds:
        cause = violation(hold)
        if cause is not None:
            status = StepStatus.HOLD_LOST if hold.place is None else StepStatus.CANCELLED
            return SkillRunResult(status, str(cause), causes=(cause,), lost_hold=hold.place)
    return None


def ending_stopped(completion: MotionCompletion) -> SkillRunResult:
    """Return the ending of a step whose motion broke off.

    Args:
        completion: end of the motion, as the plant reports it.

    Returns:
        The ending, with status STOPPED and the plant's reason.
    """
    return SkillRunResult(StepStatus.STOPPED, completion.reason or "the plant gave no reason")


def required_resources(skill: Skill) -> frozenset[str]:
    """List the resources that a step of a skill holds.

    Args:
        skill: the skill.

    Returns:
        Its resources, and its actuators as `actuator NAME`.
    """
    return skill.resources | {_actuator(name) for name in skill.actuators}


def resource_capacities(site: Site) -> dict[str, int]:
    """Return the capacities of a site's resources.

    Args:
        site: declares resources and action kinds.

    Returns:
        By resource, how many steps may hold it at a time; 1 for each actuator.
    """
    moved = {name for kind in site.kinds.values() for name in kind.actuators}
    return {**site.resources, **{_actuator(name): 1 for name in moved}}


def _actuator(name: str) -> str:
    """Return the resource name of an actuator, distinct from a declared resource of the same name."""
    return f"actuator {name}"
