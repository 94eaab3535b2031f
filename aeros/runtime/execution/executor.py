"""The executor: runs steps, always in the order skill, gate, motion check, record, plant, observation.

Rules, which the modules of this package cite by number:

1. No motion starts without a decision on readings taken just before. No decision takes effect before its
   record is durable (`scheduler.StepControl`).
2. Several steps may be active, in one thread. The skill that is due yields its next action; once every
   skill has an action, time advances for all motions together. An action is decided alone and jointly
   with the active actions (`scheduler`).
3. However a step ends (finished, denied, stopped, late, cancelled, or because AEROS itself is broken), the
   same clean-up runs once: its motion is brought to rest unless the skill finished, the generator is
   closed, the plant is notified, the step's resources are released, and the end is recorded (`clean_up`).
4. A violation at a control tick is a protective stop of all motions and ends every step that has one. A
   denial, a timeout or a revocation ends its own step alone; a skill that catches a denial for good may ask
   for another action instead (`scheduler`).
5. Errors of a skill, a planner or a caller become a `StepResult`. Errors of AEROS itself (`InternalError`
   from the gate, a plant that raises) and of the record (`AuditError`) are raised, after the clean-up of
   every step (`clean_up`).
6. A changed configuration takes effect once no motion is active that began under the previous one
   (`governor.FollowedConfiguration`).

An isolated skill can be interrupted at any time. A skill in this process cannot be interrupted while its
own code runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, Final, Protocol, Self

from aeros.runtime.audit.check import CHECKPOINT
from aeros.runtime.audit.log import AuditError, AuditLog, DecisionCounts
from aeros.runtime.canonical_json import decode_value
from aeros.runtime.execution.clean_up import CleanUp, ExecutionContext
from aeros.runtime.execution.decision_pipeline import DecisionPipeline
from aeros.runtime.execution.governor import FixedGovernor, FollowedConfiguration, Governor, OperatorCommand
from aeros.runtime.execution.prepare import StepRefusedError, prepare_step
from aeros.runtime.execution.resources import ResourceQueue
from aeros.runtime.execution.scheduler import Scheduler, StepControl
from aeros.runtime.execution.step import StepTable, resource_capacities
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import (
    EMPTY_LOG_HEAD,
    AuditEvent,
    EndedStep,
    LogHead,
    Obstacle,
    Plant,
    Readings,
    StepHandle,
    StepRequest,
    StepResult,
    StepStatus,
    known_obstacles,
)
from aeros.runtime.records.records import session_details
from aeros.runtime.records.recount import SessionState, recount_records
from aeros.runtime.skills.in_process_run import OpenRun, SkillRunResult
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.verification.certificate import Certificate

LOST_AGENT: Final = "the agent was lost; the plant stopped by itself, unseen"
"""Reason of the stop that a resumed session records if steps were under way when the last one broke off."""


class Perception(Protocol):
    """The perceivers of modules, as the executor steers them."""

    def attend(self, modules: frozenset[str] | None) -> None:
        """Implement `Runtime.attend`."""

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Implement `Runtime.set_parameters`."""

    def set_memories(self, memories: Mapping[str, Mapping[str, Any]]) -> None:
        """Implement `Runtime.set_memories`."""

    def close_perceivers(self) -> None:
        """End every perceiver; called when the executor is closed, after every step has ended."""


class Executor:
    """The runtime as the agent uses it (`ports.Runtime`), for one configuration and one plant.

    It does not own the plant or the log: their creators close them. As a context manager it leaves no step
    active.

    Args:
        configuration: site and modules in force at first.
        gate: decides every action; replaced by `gate.with_configuration` when the configuration changes.
        plant: moves and measures.
        audit: log that holds every decision before it takes effect.
        open_run: opens a run of a skill, in this process or isolated.
        governor: names the configuration in force and passes on the operator's commands; without one,
            `configuration` stays in force.
        resumed: continue the session in the log, which ended without a closing record. Its quota counts and
            histories are restored, with a gap since its last record.
        perception: measures with the perceivers of modules; None if there are none.

    Raises:
        AuditError: another site was in force in the session to resume.
    """

    def __init__(
        self,
        configuration: Configuration,
        gate: Gate,
        plant: Plant,
        audit: AuditLog,
        open_run: OpenRun,
        governor: Governor | None = None,
        *,
        resumed: bool = False,
        perception: Perception | None = None,
    ) -> None:
        self._plant = plant
        self._perception = perception
        self._audit = audit
        self._open_run = open_run
        self._table = StepTable()
        self._resources = ResourceQueue(resource_capacities(configuration.site))
        self._pipeline = DecisionPipeline(configuration, gate, plant, audit)
        self._governor = FixedGovernor(configuration) if governor is None else governor
        self._followed = FollowedConfiguration(
            configuration, self._governor, self._table.is_moving, self._switch, self._record_switch
        )
        context = ExecutionContext(
            self._table, plant, audit, self._resources, self._pipeline, self._governor, self._followed
        )
        self._clean_up = CleanUp(context)
        self._scheduler = Scheduler(context, self._clean_up, StepControl(context, self._clean_up))
        earlier = _recount_sessions(audit, configuration.site) if resumed else None
        if earlier is not None:
            self._pipeline.resume_from(earlier)
            was_moving = _has_open_step(audit)
            audit.append("session-resumed", session_details(configuration))
            if was_moving:
                self._pipeline.monitors.stops.begin_stop(LOST_AGENT, plant.now())
                self._pipeline.monitors.stops.add(plant.observe())
                details = self._pipeline.monitors.stops.end_stop(plant.now()) or {}
                del details["began"]  # nobody saw it
                audit.append("stopped", details)
        else:
            audit.append("session-opened", session_details(configuration))

    @property
    def site(self) -> Site:
        """The site whose policy is in force."""
        return self._followed.configuration.site

    @property
    def is_stopped(self) -> bool:
        """Implement `Runtime.is_stopped`."""
        return self._governor.command is OperatorCommand.STOP

    def active_modules(self) -> Mapping[str, Ecm]:
        """Implement `Runtime.active_modules`."""
        self._followed.follow()
        return self._followed.configuration.modules

    def certificate(self, module: str) -> Certificate | None:
        """Implement `Runtime.certificate`."""
        return self._followed.configuration.certificates.get(module)

    def now(self) -> float:
        """Implement `Runtime.now`."""
        return self._plant.now()

    def attend(self, modules: frozenset[str] | None) -> None:
        """Implement `Runtime.attend`."""
        if self._perception is not None:
            self._perception.attend(modules)

    def set_parameters(self, values: Mapping[str, Any]) -> None:
        """Implement `Runtime.set_parameters`."""
        if self._perception is not None:
            self._perception.set_parameters(values)

    def set_memories(self, memories: Mapping[str, Mapping[str, Any]]) -> None:
        """Implement `Runtime.set_memories`."""
        if self._perception is not None:
            self._perception.set_memories(memories)

    def observe(self) -> Readings:
        """Implement `Runtime.observe`."""
        return self._plant.observe()

    def obstacles(self) -> Sequence[Obstacle]:
        """Implement `Runtime.obstacles`."""
        return known_obstacles(self._plant)

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Record an event of the agent as a note, so that it cannot be mistaken for an event of the runtime.

        Args:
            event: name of the agent's event.
            details: JSON-encodable values.
        """
        self._audit.append("note", {"event": event, "details": dict(details)})

    def log_head(self) -> LogHead:
        """Implement `Runtime.log_head`."""
        return self._audit.head

    def events_since(self, head: LogHead) -> Sequence[AuditEvent] | None:
        """Implement `Runtime.events_since`."""
        records = self._audit.records_since(head)
        if records is None:
            return None
        # A checkpoint is of the log, not of the session, and has the time of day.
        own = (record for record in records if record["event"] not in ("note", CHECKPOINT))
        return [
            AuditEvent(record["sequence"], record["event"], decode_value(record["details"])) for record in own
        ]

    def run_step(self, request: StepRequest) -> StepResult:
        """Run one skill to its end; never raises for a bad request.

        Args:
            request: module, skill and inputs (SI).

        Returns:
            The result; with status REFUSED and a reason for a bad request.
        """
        started = self.start(request)
        if isinstance(started, StepResult):
            return started
        self._scheduler.run_to_end(started)
        return self._table.results.pop(started)

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """Implement `Runtime.start`; never raises for a bad request."""
        with self._clean_up.on_error:
            self._followed.follow()
            asked = {"module": request.module, "skill": request.skill, "inputs": request.inputs}
            try:
                step = prepare_step(request, self._followed.configuration, self._resources, self._open_run)
            except StepRefusedError as refusal:
                self._audit.append("step-refused", {"reason": str(refusal), **asked})
                return StepResult(StepStatus.REFUSED, str(refusal))
            return self._scheduler.enqueue(step)

    def wait(self, until: float = inf) -> EndedStep | None:
        """Implement `Runtime.wait`.

        Raises:
            MisuseError: no step was started.
        """
        if not self._table.steps and not self._table.results:
            if until == inf:
                raise MisuseError("no step was started, so none can end")
            with self._clean_up.on_error:
                self._plant.advance(self._scheduler.tick_monitor, until)
            return None
        return self._table.next_ended() if self._scheduler.run_until_one_ends(until) else None

    def advance_once(self, until: float) -> EndedStep | None:
        """Let one skill act, or advance time.

        For callers that poll something else in between: returns soon, also while the operator pauses.

        Args:
            until: latest time to advance to, plant seconds.

        Returns:
            A step that has ended; None if none has.
        """
        if not self._table.results:
            self._scheduler.run_until(until)
        return self._table.next_ended() if self._table.results else None

    def cancel(self, step: StepHandle, reason: str) -> None:
        """Implement `Runtime.cancel`."""
        if step in self._table.steps:
            with self._clean_up.on_error:
                self._clean_up.halt_step(step, SkillRunResult(StepStatus.CANCELLED, reason))

    def decision_counts(self, step: StepHandle) -> DecisionCounts | None:
        """Return the counts of decisions on an active step.

        Args:
            step: the step.

        Returns:
            Numbers of allowed, attenuated and denied actions so far; None once the step has ended.
        """
        active_step = self._table.steps.get(step)
        if active_step is None:
            return None
        counts = active_step.decision_counts
        return DecisionCounts(
            counts[DecisionKind.ALLOW], counts[DecisionKind.ATTENUATE], counts[DecisionKind.DENY]
        )

    def close(self) -> None:
        """Clean up every step that has not ended; safe to call twice."""
        if self._table.steps:
            self._clean_up.clean_up_all(MisuseError("the executor was closed before the step ended"))
        if self._perception is not None:
            self._perception.close_perceivers()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # Called by `FollowedConfiguration` when the configuration has changed.

    def _switch(self, configuration: Configuration) -> None:
        """Decide, and grant resources, under `configuration` from now on."""
        self._pipeline.switch_configuration(configuration)
        self._resources.set_capacities(resource_capacities(configuration.site))

    def _record_switch(self, configuration: Configuration) -> None:
        self._audit.append("configuration-changed", session_details(configuration))


def _has_open_step(audit: AuditLog) -> bool:
    """Return True if the log has more beginnings than ends of steps."""
    changes = {"step-began": 1, "step-ended": -1, "step-broken": -1}
    records = audit.records_since(EMPTY_LOG_HEAD) or []
    return sum(changes.get(record["event"], 0) for record in records) > 0


def _recount_sessions(audit: AuditLog, site: Site) -> SessionState | None:
    """Rebuild counts and histories from the log; None if it has no session, perhaps only signatures.

    Raises:
        AuditError: another site was in force in it.
    """
    records = audit.records_since(EMPTY_LOG_HEAD) or []
    opening = ("session-opened", "session-resumed", "configuration-changed")
    governed = [one["details"]["site"]["digest"] for one in records if one["event"] in opening]
    if not governed:
        return None
    if any(digest != site.digest for digest in governed):
        raise AuditError(
            f"`{audit.path}` cannot be resumed: another site was in force, or other blocks of the operator; "
            "start the task again"
        )
    return recount_records(records, site)
