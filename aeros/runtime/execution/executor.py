"""The executor: runs steps, skill → gate → motion → record → plant → observation, in this order and no other.

Rules, which the modules of this package name by their numbers:

1. No motion without a decision on readings taken just before, and no decision acted on before its record is
   durable (`step_control`).
2. Several steps may be under way, in one thread: whichever skill is due yields its next action, and time
   goes on for all motions together once each skill has one.  An action is decided by itself and together
   with those under way (`scheduler`).
3. However a step ends, by itself, denied, stopped, late, cancelled, or because something here is broken,
   the same clean-up runs once: what it moves is brought to rest unless the skill finished, the generator
   is closed, the plant hears that the skill ended, what it held is released, the end is recorded
   (`clean_up`).
4. A violation at a control tick is a protective stop of everything that moves, and ends every step that
   does.  A denial, a time-out or a revocation ends its own step alone (`scheduler`).
5. What a skill, a planner or a caller gets wrong is a `StepResult`.  What is wrong with AEROS itself
   (`InternalError` from the gate, a plant that raises) or with the record (`AuditError`) is raised,
   after the clean-up of every step (`clean_up`).
6. A configuration that changed is followed once nothing moves that was begun under the one before
   (`governor.FollowedConfiguration`).

An isolated skill is interrupted at any time; one that runs in this process, not while its own code runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, Self

from aeros.runtime.audit.log import AuditError, AuditLog, DecisionCounts
from aeros.runtime.canonical_json import decode_value
from aeros.runtime.execution.clean_up import CleanUp, ExecutionContext
from aeros.runtime.execution.decision_pipeline import DecisionPipeline
from aeros.runtime.execution.governor import FixedGovernor, FollowedConfiguration, Governor, OperatorCommand
from aeros.runtime.execution.prepare import StepRefusedError, prepare_step
from aeros.runtime.execution.resources import ResourceQueue
from aeros.runtime.execution.scheduler import Scheduler
from aeros.runtime.execution.step import StepTable, resource_capacities
from aeros.runtime.execution.step_control import StepControl
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.port import Gate
from aeros.runtime.ports import (
    EMPTY_LOG_HEAD,
    AuditEvent,
    EndedStep,
    LogHead,
    Plant,
    Readings,
    StepHandle,
    StepRequest,
    StepResult,
    StepStatus,
)
from aeros.runtime.records.records import session_details
from aeros.runtime.records.recount import SessionState, recount_records
from aeros.runtime.skills.in_process_run import OpenRun, SkillRunResult
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.model import Ecm, Site
from aeros.spec.verification.certificate import Certificate


class Executor:
    """The runtime as the agent sees it (`ports.Runtime`), for one configuration and one plant.

    It owns neither plant nor log: whoever made them closes them.  As a context manager it leaves no step
    under way.

    Args:
        configuration: the site and the modules that govern at first.
        gate: decides every action; replaced by `gate.set_capacities` where the configuration changes.
        plant: what moves, and what measures.
        audit: the log that every decision is in before it is acted on.
        open_run: opens a run of a skill, in this process or isolated.
        governor: names the configuration in force and passes on the operator's commands; without one,
            `configuration` is in force for good.
        resumed: go on with the session that the log holds, which ended without a word: its counts of quotas
            and its histories are taken over, with a gap since.

    Raises:
        AuditError: another site governed the session that is resumed.
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
    ) -> None:
        self._plant = plant
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
        if resumed and audit.head.records:
            self._pipeline.resume_from(_recount_sessions(audit, configuration.site))
            audit.append("session-resumed", session_details(configuration))
        else:
            audit.append("session-opened", session_details(configuration))

    @property
    def site(self) -> Site:
        """The site whose policy governs."""
        return self._followed.configuration.site

    @property
    def is_stopped(self) -> bool:
        """See `ports.Runtime`."""
        return self._governor.command is OperatorCommand.STOP

    def active_modules(self) -> Mapping[str, Ecm]:
        """Return the certified, active modules by name."""
        self._followed.follow()
        return self._followed.configuration.modules

    def certificate(self, module: str) -> Certificate | None:
        """Return what is proved of an active module."""
        return self._followed.configuration.certificates.get(module)

    def now(self) -> float:
        """Return the time on the plant's clock, s."""
        return self._plant.now()

    def observe(self) -> Readings:
        """Return everything that is measured now."""
        return self._plant.observe()

    def note(self, event: str, details: Mapping[str, Any]) -> None:
        """Record an event of the agent's, as a note, so that it cannot pass for one of the runtime's."""
        self._audit.append("note", {"event": event, "details": dict(details)})

    def log_head(self) -> LogHead:
        """See `ports.Runtime`."""
        return self._audit.head

    def events_since(self, head: LogHead) -> Sequence[AuditEvent] | None:
        """See `ports.Runtime`."""
        records = self._audit.records_since(head)
        if records is None:
            return None
        own = (one for one in records if one["event"] != "note")
        return [AuditEvent(one["sequence"], one["event"], decode_value(one["details"])) for one in own]

    def run_step(self, request: StepRequest) -> StepResult:
        """Run one skill to its end; never raises for a bad request."""
        started = self.start(request)
        if isinstance(started, StepResult):
            return started
        while started not in self._table.results:
            self._scheduler.run_until(inf)
        return self._table.results.pop(started)

    def start(self, request: StepRequest) -> StepHandle | StepResult:
        """See `ports.Runtime`; never raises for a bad request."""
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
        """See `ports.Runtime`."""
        if not self._table.steps and not self._table.results:
            if until == inf:
                raise MisuseError("nothing was started that could end")
            with self._clean_up.on_error:
                self._plant.advance(self._scheduler.monitor_tick, until)
            return None
        while not self._table.results:
            if self._plant.now() >= until or self._scheduler.run_until(until):
                return None
        return self._table.next_ended()

    def advance_once(self, until: float) -> EndedStep | None:
        """Let one skill act, or time go on until `until` at most (plant seconds).

        For callers that have to look at something else too; returns soon, also while the operator pauses.

        Returns:
            A step that has ended, if any has.
        """
        if not self._table.results:
            self._scheduler.run_until(until)
        return self._table.next_ended() if self._table.results else None

    def cancel(self, step: StepHandle, reason: str) -> None:
        """See `ports.Runtime`."""
        if step in self._table.steps:
            with self._clean_up.on_error:
                self._clean_up.halt_step(step, SkillRunResult(StepStatus.CANCELLED, reason))

    def decision_counts(self, step: StepHandle) -> DecisionCounts | None:
        """Count the decisions on a step so far; None once it has ended."""
        under_way = self._table.steps.get(step)
        return None if under_way is None else under_way.decision_counts

    def close(self) -> None:
        """Clean up after every step that has not ended; safe to call twice."""
        if self._table.steps:
            self._clean_up.clean_up_all(MisuseError("whoever had asked for it is gone"))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # A configuration that changed; see `FollowedConfiguration`.

    def _switch(self, configuration: Configuration) -> None:
        """Decide and grant under `configuration` from now on."""
        self._pipeline.switch_configuration(configuration)
        self._resources.set_capacities(resource_capacities(configuration.site))

    def _record_switch(self, configuration: Configuration) -> None:
        self._audit.append("configuration-changed", session_details(configuration))


def _recount_sessions(audit: AuditLog, site: Site) -> SessionState:
    """Add up the sessions in the log; raises `AuditError` unless it was `site` that governed them."""
    records = audit.records_since(EMPTY_LOG_HEAD) or []
    opening = ("session-opened", "session-resumed", "configuration-changed")
    governed = [one["details"]["site"]["digest"] for one in records if one["event"] in opening]
    if any(digest != site.digest for digest in governed):
        raise AuditError(f"`{audit.path}` cannot be gone on with: another site governed it")
    return recount_records(records, site)
