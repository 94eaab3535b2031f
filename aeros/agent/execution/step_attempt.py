"""One skill invocation, whole: precondition, request, submission, new observation, judgement, memory."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Final

from aeros.agent.execution.dispatcher import Dispatch, Dispatcher, DispatchError
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.report import StepRecord, StepRole
from aeros.agent.execution.supervisor import assess_step
from aeros.agent.execution.uncertain_steps import UncertainSteps
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, Memory
from aeros.agent.world.incremental import IncrementalWorld
from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import EndedStep, LogHead, Runtime, StepHandle, StepResult, StepStatus
from aeros.spec.model.cause import Cause, causes_to_json
from aeros.spec.verification.outcome_dependencies import obligations_assuming_outcomes

RAN_STATUSES: Final = frozenset(
    {
        StepStatus.FINISHED,
        StepStatus.STOPPED,
        StepStatus.TIMED_OUT,
        StepStatus.RAISED,
        StepStatus.HOLD_LOST,
    }
)
"""How a skill ends that ran: what further tries are for."""


def _counts_toward_record(result: StepResult) -> bool:
    """Whether what came of it says how good the skill is.

    What others kept from its end does not, nor does a denial on account of what is measured alone: it is
    waited out, so one person who stands nearby would count sixty times.  Any other denial does: the skill
    asks for what it may not do, and will again.
    """
    return result.status in RAN_STATUSES or (result.status is StepStatus.DENIED and not result.is_transient)


@dataclass(frozen=True, slots=True)
class AttemptResult:
    """What came of trying to run a skill.

    failed: not starting is failing too.
    reason: why it failed.
    repeatable: it failed in the way that retries are for: the skill ran, and failed as declared.  After
        a denial, a refusal, an unmet precondition, an undeclared or unknown outcome the plan rests on
        something that is not so.
    record: None where it was not submitted.
    outputs: what the skill gave, by name, SI.
    hopeless: why a further try is, by what is remembered; empty where it is not.
    may_pass: it was denied, and may be allowed later.
    stops: it came to what it does not declare, and the site says that nothing goes on then.
    """

    failed: bool
    reason: str
    is_retryable: bool = False
    record: StepRecord | None = None
    outputs: Mapping[str, Any] = field(default_factory=dict)
    is_transient: bool = False
    no_retry_reason: str = ""
    ends_run: bool = False

    @property
    def is_denied(self) -> bool:
        """Whether the gate denied an action of it."""
        return self.record is not None and self.record.status is StepStatus.DENIED

    @property
    def is_halted(self) -> bool:
        """Whether the operator stopped everything, so that nothing begins any more."""
        return self.record is not None and self.record.status is StepStatus.HALTED


@dataclass(frozen=True, slots=True)
class PendingAttempt:
    """A request, and what was known when it was made; `episode`: its number in memory."""

    role: StepRole
    dispatch: Dispatch
    episode_start: EpisodeStart
    episode_id: int


@dataclass(frozen=True, slots=True)
class RunningAttempt:
    """A try under way, by the number that the runtime knows it by."""

    handle: StepHandle
    pending: PendingAttempt


class StepRunner:
    """Runs skills through the runtime, and keeps the world as last measured."""

    def __init__(self, runtime: Runtime, memory: Memory, journal: Journal, task: str, seed: int = 0) -> None:
        self._runtime = runtime
        self._memory = memory
        self._journal = journal
        self.dispatcher = Dispatcher(runtime, memory, task, seed)
        self._task = task
        self._measuring = IncrementalWorld(runtime.site.state)
        self.planned_in: list[Mapping[str, Any]] = []
        self._failures: list[Cause] = []
        self.records: list[StepRecord] = []
        self.bars = UncertainSteps()
        self._world = self.observe()

    def restore(
        self,
        steps: Iterable[StepRecord],
        planned_in: Iterable[Mapping[str, Any]],
        avoided_skills: Iterable[tuple[str, str]],
    ) -> None:
        """Take over what an earlier session of the same run had come to."""
        self.records.extend(steps)
        self.planned_in.extend(planned_in)
        self.dispatcher.denied.update(avoided_skills)

    @property
    def audit_head(self) -> LogHead:
        """Where the audit record ends now."""
        return self._runtime.log_head()

    @property
    def world(self) -> WorldModel:
        """What is known now, by what was measured last."""
        return self._world.at_time(self._runtime.now())

    def observe(self) -> WorldModel:
        """Measure the world anew."""
        # In this order: a reading is never younger than the time it is judged at.
        readings, state = self._runtime.observe(), self._runtime.site.state
        if state is not self._measuring.state:
            self._measuring = IncrementalWorld(state)
        self._world = self._measuring.world(readings, self._runtime.now())
        return self._world

    def planning_world(self) -> WorldModel:
        """The world as last measured, kept as one that a plan is made in, with why steps since failed."""
        world = replace(self.world, failures=tuple(self._failures))
        self._failures.clear()
        if world.predicates not in self.planned_in:
            self.planned_in.append(world.predicates)
        return world

    def has_planned_in_current_state(self) -> bool:
        """Whether a plan of this run was made when the predicates were measured as they are now."""
        return self.world.predicates in self.planned_in

    def wait(self, until: float) -> EndedStep | None:
        """The next step that ends before `until`, plant seconds; see `ports.Runtime`."""
        return self._runtime.wait(until)

    def idle_until(self, until: float) -> None:
        """Let time go on while nothing is under way, and measure the world as it is then."""
        self._runtime.wait(until)
        self.observe()

    def cancel(self, handle: StepHandle, reason: str) -> None:
        """Halt a step that is under way."""
        self._runtime.cancel(handle, reason)

    def start(
        self, role: StepRole, module: str, skill: str, inputs: Mapping[str, Any]
    ) -> RunningAttempt | AttemptResult:
        """Start `module.skill` if it is active and its precondition is measured now."""
        try:
            dispatch = self.dispatcher.dispatch(module, skill, inputs, self.world)
        except DispatchError as error:
            return self._not_started(role, module, skill, str(error), error.causes)
        request = dispatch.request
        barred = self.bars.reason_not_to_start(module, dispatch.skill, request.inputs, self.world)
        if barred is not None:
            cause = Cause("interrupted", f"{module}.{request.skill}", barred)
            return self._not_started(role, module, request.skill, barred, (cause,))
        self._record_provider_choice(module, skill, dispatch)
        given = {key: to_json_value(value) for key, value in dispatch.request.inputs.items()}
        time, before = self._runtime.now(), self.world.predicates
        chosen = dispatch.request.skill
        beginning = EpisodeStart(
            self._task, module, chosen, role.value, given, time, before, dispatch.context
        )
        episode = self._memory.start_episode(beginning)
        record, usual = dispatch.record, dispatch.typical_duration
        name = f"{module}.{chosen}"
        took = "" if usual is None else f"; successes take {usual}"
        self._journal.record_step(
            "step-started",
            f"{role.value} {name} ({record.successes} successes and {record.failures} failures so far{took})",
            skill=name,
            role=role.value,
            inputs=given,
            successes=record.successes,
            failures=record.failures,
            usual_seconds=None if usual is None else usual.median,
        )
        handle = self._runtime.start(dispatch.request)
        made = PendingAttempt(role, dispatch, beginning, episode)
        return self.finish(made, handle) if isinstance(handle, StepResult) else RunningAttempt(handle, made)

    def finish(self, pending: PendingAttempt, result: StepResult) -> AttemptResult:
        """What came of it, as the world measured now shows."""
        dispatch, role = pending.dispatch, pending.role
        request = dispatch.request
        name = f"{request.module}.{request.skill}"
        ended = self._runtime.now()
        after = self.observe()
        judgement = assess_step(request.module, dispatch.skill, result, after, pending.episode_start.before)
        causes = causes_to_json(judgement.causes)
        self._failures += judgement.causes
        ending = EpisodeEnd(
            result.status.value,
            judgement.outcome,
            judgement.failed,
            judgement.reason,
            ended,
            after.predicates,
            _counts_toward_record(result),
            causes,
        )
        self._memory.end_episode(pending.episode_id, ending)
        self._journal.record_step(
            "step-ended",
            f"{role.value} {name}: {judgement.reason or f'outcome `{judgement.outcome}`'}",
            skill=name,
            role=role.value,
            status=result.status.value,
            outcome=judgement.outcome,
            failed=judgement.failed,
            reason=judgement.reason,
            causes=causes,
        )
        if judgement.is_undeclared:
            self._record_broken_assumption(pending, result, after, causes)
        record = StepRecord(
            role=role,
            module=request.module,
            skill=request.skill,
            inputs=pending.episode_start.inputs,
            status=result.status,
            outcome=judgement.outcome,
            failed=judgement.failed,
            reason=judgement.reason,
            started=pending.episode_start.started,
            ended=ended,
            allowed=result.allowed,
            attenuated=result.attenuated,
            denied=result.denied,
        )
        self.records.append(record)
        is_known = not (judgement.is_undeclared or judgement.is_unknown)
        repeatable = record.failed and record.status in RAN_STATUSES and is_known
        hopeless = self._no_retry_reason(dispatch) if repeatable else ""
        if result.status is StepStatus.DENIED and not result.is_transient:
            self.dispatcher.avoid(request.module, request.skill)
        stops = judgement.is_undeclared and self._ends_run(result)
        return AttemptResult(
            record.failed,
            record.reason,
            repeatable,
            record,
            result.outputs,
            result.is_transient,
            hopeless,
            stops,
        )

    def _ends_run(self, result: StepResult) -> bool:
        """Whether an undeclared outcome of a step that ended so is the end of the run.

        A halt that nothing declares the state of is no outcome: the skill had none yet.
        """
        return result.status is StepStatus.FINISHED and self._runtime.site.stops_on_undeclared_outcome

    def _record_broken_assumption(
        self, made: PendingAttempt, result: StepResult, after: WorldModel, causes: list[dict[str, Any]]
    ) -> None:
        """That what was proved of the skill's module rests on outcomes, and this is none of them."""
        request, skill = made.dispatch.request, made.dispatch.skill
        name = f"{request.module}.{request.skill}"
        certificate = self._runtime.certificate(request.module)
        ecm = self._runtime.active_modules().get(request.module)
        resting = (
            []
            if certificate is None or ecm is None
            else obligations_assuming_outcomes(ecm, skill.id, certificate)
        )
        rests = f"; {len(resting)} of its module's proofs rest on those" if resting else ""
        self._journal.record(
            "broken-assumption",
            f"{name} ended in a state that its manifest does not declare{rests}",
            module=request.module,
            skill=name,
            halted=result.status is not StepStatus.FINISHED,
            stops=self._ends_run(result),
            declared=list(skill.outcomes),
            certificate=None if certificate is None else certificate.digest,
            version=None if certificate is None else certificate.version,
            obligations=[str(one) for one in resting],
            before=dict(made.episode_start.before),
            after=dict(after.predicates),
            causes=causes,
        )

    def _record_provider_choice(self, module: str, name: str, dispatch: Dispatch) -> None:
        if dispatch.options:
            self._journal.record(
                "skill-chosen",
                f"`{dispatch.request.skill}` for {module}.{name}: " + "; ".join(map(str, dispatch.options)),
                capability=f"{module}.{name}",
                skill=f"{module}.{dispatch.request.skill}",
                context=json.loads(dispatch.context),
                options=[asdict(option) for option in dispatch.options],
            )

    def _no_retry_reason(self, dispatch: Dispatch) -> str:
        """Why nothing is to be expected of a further try in the same context; empty where something is."""
        of = [option.skill for option in dispatch.options] or [dispatch.request.skill]
        records = [
            self._memory.success_record(dispatch.request.module, skill, dispatch.context) for skill in of
        ]
        if not all(record.is_hopeless for record in records):
            return ""
        said = ", ".join(f"`{skill}` {record}" for skill, record in zip(of, records, strict=True))
        return f"succeeded before in this context: {said}"

    def _not_started(
        self, role: StepRole, module: str, skill: str, reason: str, causes: tuple[Cause, ...]
    ) -> AttemptResult:
        name = f"{module}.{skill}"
        self._failures += causes
        self._journal.record(
            "step-not-started",
            f"{role.value} {name}: {reason}",
            skill=name,
            role=role.value,
            reason=reason,
            causes=causes_to_json(causes),
        )
        return AttemptResult(failed=True, reason=reason)
