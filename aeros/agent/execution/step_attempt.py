"""One skill invocation: precondition, request, submission, new measurement, assessment and memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from aeros.agent.execution.attempt_journal import (
    record_broken_assumption,
    record_end,
    record_not_started,
    record_provider_choice,
    record_start,
)
from aeros.agent.execution.dispatcher import ChosenComposition, Dispatch, Dispatcher, DispatchError
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.repeats import (
    LOOK_AGAIN_PAUSE_S,
    MOST_NOT_STARTED,
    MOST_OF_A_KIND,
    RepeatedFailures,
    is_explained_by_chance,
)
from aeros.agent.execution.report import StepRecord, StepRole
from aeros.agent.execution.supervisor import StepAssessment, assess_step
from aeros.agent.execution.uncertain_steps import UncertainSteps
from aeros.agent.execution.waiting import MAX_WAIT_S, wait_after_denial, wait_for_condition
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, Memory
from aeros.agent.world.values import CachingConverter, to_json_value
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import EndedStep, LogHead, Runtime, StepHandle, StepResult, StepStatus
from aeros.spec.model.cause import Cause, causes_to_json
from aeros.spec.model.ecm import Ecm

RAN_STATUSES: Final = frozenset(
    {
        StepStatus.FINISHED,
        StepStatus.STOPPED,
        StepStatus.TIMED_OUT,
        StepStatus.RAISED,
        StepStatus.HOLD_LOST,
    }
)
"""Endings of a skill that did run; only after these is a step tried again."""


def _counts_toward_record(result: StepResult) -> bool:
    """Return True if the result is evidence of how good the skill is.

    An end that others caused is none. A denial because of measured values alone is none either: the skill
    waits and tries again, so one person who stands nearby would count sixty times. Any other denial counts,
    because the skill requests what it may not do, and will do so again.
    """
    return result.status in RAN_STATUSES or (result.status is StepStatus.DENIED and not result.is_transient)


@dataclass(frozen=True, slots=True)
class AttemptResult:
    """The result of an attempt to run a skill.

    Attributes:
        failed: True also if the skill did not start.
        reason: why it failed.
        is_retryable: it ran and failed as declared, which is what retries are for. After a denial, a refusal,
            an unmet precondition, an undeclared or unknown outcome, an assumption of the plan is wrong
            instead.
        record: record of the invocation; None if it was not submitted.
        outputs: outputs of the skill by name (SI).
        is_transient: it was denied, or could not start, and may be allowed later.
        no_retry_reason: why another attempt at once is hopeless, by memory or as it failed so before; empty
            if it is not.
        ends_run: it ended in an undeclared outcome, and the site stops the run then; or its code raised or it
            failed as before, and nothing else provides the same.
        is_composed: it was a run of a composition, whose steps have records of their own.
        is_repeated: it failed as it did before in the same state, which chance does not explain, and is not
            tried again.
        pause_s: time that is to pass before another plan, plant seconds.
        wait_subject: what a transient failure waits for, in words.
        wait_limit_s: longest wait for that, plant seconds.
    """

    failed: bool
    reason: str
    is_retryable: bool = False
    record: StepRecord | None = None
    outputs: Mapping[str, Any] = field(default_factory=dict)
    is_transient: bool = False
    no_retry_reason: str = ""
    ends_run: bool = False
    is_composed: bool = False
    is_repeated: bool = False
    pause_s: float = 0.0
    wait_subject: str = ""
    wait_limit_s: float = MAX_WAIT_S

    @property
    def final_words(self) -> str:
        """Words for an attempt that ends the run."""
        if self.is_repeated:
            return "failed again as before in the same state, and nothing else is known to try"
        raised = self.record is not None and self.record.status is StepStatus.RAISED
        return "failed, and its code is not run again" if raised else "ended with an undeclared outcome"

    @property
    def is_denied(self) -> bool:
        """True if the gate denied an action of it."""
        return self.record is not None and self.record.status is StepStatus.DENIED

    @property
    def is_halted(self) -> bool:
        """True if the operator stopped everything, so that nothing more starts."""
        return self.record is not None and self.record.status is StepStatus.HALTED


@dataclass(frozen=True, slots=True)
class PendingAttempt:
    """A request that was made, with the state in which it was made.

    Attributes:
        role: reason for the invocation: first try, retry or recovery.
        dispatch: the request and the providers that were considered.
        episode_start: the part of its episode in memory that is known before the step starts.
        episode_id: number of the attempt's episode in memory.
    """

    role: StepRole
    dispatch: Dispatch
    episode_start: EpisodeStart
    episode_id: int


@dataclass(frozen=True, slots=True)
class RunningAttempt:
    """An attempt that is running.

    Attributes:
        handle: the runtime's handle of the step.
        pending: the request that it came from.
    """

    handle: StepHandle
    pending: PendingAttempt


class StepRunner:
    """Runner of skills through the runtime, which also keeps the world as last measured."""

    def __init__(self, runtime: Runtime, memory: Memory, journal: Journal, task: str, seed: int = 0) -> None:
        self._runtime = runtime
        self._memory = memory
        self._journal = journal
        self.dispatcher = Dispatcher(runtime, memory, task, seed)
        self._task = task
        self._exactly = CachingConverter()
        self.planned_in: list[Mapping[str, Any]] = []
        self._failures: list[Cause] = []
        self.records: list[StepRecord] = []
        self.bars = UncertainSteps()
        self.repeats = RepeatedFailures()
        self._planned_state: Mapping[str, Any] | None = None
        self._world = self.observe()

    def restore(
        self,
        steps: Iterable[StepRecord],
        planned_in: Iterable[Mapping[str, Any]],
        avoided_skills: Iterable[tuple[str, str]],
    ) -> None:
        """Restore the state of an earlier session of the same run.

        Args:
            steps: invocations so far.
            planned_in: predicates as measured where plans were made.
            avoided_skills: pairs of module and skill that the gate denied for good.
        """
        self.records.extend(steps)
        self.planned_in.extend(planned_in)
        self.dispatcher.denied.update(avoided_skills)

    @property
    def audit_head(self) -> LogHead:
        """Current end of the audit record."""
        return self._runtime.log_head()

    @property
    def world(self) -> WorldModel:
        """World as last measured, without the values that are too old by now."""
        return self._world.at_time(self._runtime.now())

    def observe(self) -> WorldModel:
        """Measure the world again.

        Returns:
            The new world.
        """
        # In this order: a reading is never younger than the time it is judged at.
        readings, now = self._runtime.observe(), self._runtime.now()
        self._world = world_from_readings(self._runtime.site.state, readings, now, self._exactly)
        return self._world

    def planning_world(self) -> WorldModel:
        """Return the world for a planner and remember that a plan is made in it.

        Returns:
            The world as last measured, with the causes of step failures since the previous plan.
        """
        world = replace(self.world, failures=tuple(self._failures))
        self._failures.clear()
        self._planned_state = world.predicates
        if world.predicates not in self.planned_in:
            self.planned_in.append(world.predicates)
        return world

    def has_planned_in_current_state(self) -> bool:
        """Compare the measured predicates with those in which earlier plans of this run were made.

        Returns:
            True if some plan was made with the same ones.
        """
        return self.world.predicates in self.planned_in

    def wait(self, until: float) -> EndedStep | None:
        """Wait for the next step to end; see `ports.Runtime`.

        Args:
            until: plant time (s) at which the wait ends.

        Returns:
            The step that ended, or None if none did before `until`.
        """
        return self._runtime.wait(until)

    def idle_until(self, until: float) -> None:
        """Let plant time pass while no step runs, then measure the world.

        Args:
            until: plant time (s).
        """
        self._runtime.wait(until)
        self.observe()

    def cancel(self, handle: StepHandle, reason: str) -> None:
        """Halt a running step.

        Args:
            handle: the runtime's handle of the step.
            reason: reason for the audit record.
        """
        self._runtime.cancel(handle, reason)

    def start(
        self, role: StepRole, module: str, skill: str, inputs: Mapping[str, Any]
    ) -> RunningAttempt | AttemptResult | ChosenComposition:
        """Start a skill if it is active and its precondition is measured as true now.

        Args:
            role: reason for the invocation.
            module: id of the module.
            skill: skill or capability of the module.
            inputs: inputs by name (SI).

        Returns:
            The running attempt, its result if it did not start or ended at once, or the composition that was
            chosen and is to be run instead.
        """
        try:
            dispatch = self.dispatcher.dispatch(module, skill, inputs, self.world)
        except DispatchError as error:
            return self._not_started(role, (module, skill, inputs), str(error), error.causes)
        record_provider_choice(self._journal, module, skill, dispatch)
        if isinstance(dispatch, ChosenComposition):
            return dispatch
        request = dispatch.request
        barred = self.bars.reason_not_to_start(request.module, dispatch.skill, request.inputs, self.world)
        if barred is not None:
            cause = Cause("interrupted", f"{request.module}.{request.skill}", barred)
            step = (request.module, request.skill, request.inputs)
            return self._not_started(role, step, barred, (cause,))
        given = {key: to_json_value(value) for key, value in dispatch.request.inputs.items()}
        time, before = self._runtime.now(), self.world.predicates
        chosen = dispatch.request.skill
        beginning = EpisodeStart(
            self._task, request.module, chosen, role.value, given, time, before, dispatch.context
        )
        episode = self._memory.start_episode(beginning)
        record_start(self._journal, role, dispatch, given)
        handle = self._runtime.start(dispatch.request)
        made = PendingAttempt(role, dispatch, beginning, episode)
        return self.finish(made, handle) if isinstance(handle, StepResult) else RunningAttempt(handle, made)

    def active_modules(self) -> Mapping[str, Ecm]:
        """Return the modules whose skills may run.

        Returns:
            Modules by id.
        """
        return self._runtime.active_modules()

    def finish(self, pending: PendingAttempt, result: StepResult) -> AttemptResult:
        """Assess a step that has ended by the world measured now, and record it in memory and audit record.

        Args:
            pending: the attempt.
            result: result that the runtime gives.

        Returns:
            The result of the attempt.
        """
        dispatch, role = pending.dispatch, pending.role
        request = dispatch.request
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
        record_end(self._journal, role, dispatch, result, judgement)
        stops = judgement.is_undeclared and self._ends_run(result)
        if judgement.is_undeclared:
            record_broken_assumption(
                *(self._journal, self._runtime, dispatch, result, judgement),
                before=pending.episode_start.before,
                after=after,
                ends_run=stops,
            )
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
        raised = result.status is StepStatus.RAISED
        times = self._count_failures(pending, result, judgement)
        is_repeated = times >= MOST_OF_A_KIND
        repeatable = record.failed and record.status in RAN_STATUSES and is_known and not raised
        hopeless = self._no_retry_reason(dispatch) if repeatable else ""
        if times > 1:
            hopeless = f"it failed {times} times in the same way"
        if raised or is_repeated or (result.status is StepStatus.DENIED and not result.is_transient):
            self.dispatcher.avoid(request.module, request.skill)
        # What chance does not explain is not tried again: another provider may be, the same may not.
        stops = stops or ((raised or is_repeated) and not self.dispatcher.has_another(dispatch))
        wait = wait_after_denial(judgement.causes, self._runtime.site) if result.is_transient else None
        return AttemptResult(
            record.failed,
            record.reason,
            repeatable,
            record,
            result.outputs,
            result.is_transient,
            hopeless,
            stops,
            is_repeated=is_repeated,
            pause_s=LOOK_AGAIN_PAUSE_S if times > 1 else 0.0,
            wait_subject="" if wait is None else wait.subject,
            wait_limit_s=MAX_WAIT_S if wait is None else wait.limit_s,
        )

    def _count_failures(self, pending: PendingAttempt, result: StepResult, judgement: StepAssessment) -> int:
        """Note a failure that chance does not explain; return how often it happened, 0 for any other end."""
        causes, site = judgement.causes, self._runtime.site
        if not judgement.failed or is_explained_by_chance(result.status, causes, site):
            return 0
        request, beginning = pending.dispatch.request, pending.episode_start
        step = (request.module, request.skill, beginning.inputs)
        joints: Any = None
        if result.status is StepStatus.STOPPED and site.motion is not None:
            joints = self.world.known.get(site.motion.start_variable)
        place = [] if joints is None else [round(float(one), 3) for one in joints]
        return self.repeats.count(step, result.status, causes, beginning.before, place)

    def _ends_run(self, result: StepResult) -> bool:
        """Return True if this undeclared outcome ends the run.

        A halt in a state that no outcome declares is no such outcome: the skill had not ended by itself.
        """
        return result.status is StepStatus.FINISHED and self._runtime.site.stops_on_undeclared_outcome

    def _no_retry_reason(self, dispatch: Dispatch) -> str:
        """Return why memory makes another attempt in this context hopeless; empty if it does not."""
        request = dispatch.request
        records = {option.skill: option.record for option in dispatch.options}
        records |= {
            request.skill: self._memory.success_record(request.module, request.skill, dispatch.context)
        }
        if not all(record.is_hopeless for record in records.values()):
            return ""
        counts = ", ".join(f"`{skill}` {record}" for skill, record in records.items())
        return f"succeeded before in this context: {counts}"

    def _not_started(
        self,
        role: StepRole,
        step: tuple[str, str, Mapping[str, Any]],
        reason: str,
        causes: tuple[Cause, ...],
    ) -> AttemptResult:
        self._failures += causes
        record_not_started(self._journal, role, f"{step[0]}.{step[1]}", reason, causes)
        wait = wait_for_condition(causes, self._runtime.site)
        if wait is not None:
            return AttemptResult(
                True, reason, is_transient=True, wait_subject=wait.subject, wait_limit_s=wait.limit_s
            )
        given = {name: to_json_value(value) for name, value in step[2].items()}
        state = self.world.predicates
        # Where other steps came between plan and step, their chance decides what the next plan comes to.
        is_planned = role is StepRole.STEP and state == self._planned_state
        named = (step[0], step[1], given)
        again = is_planned and self.repeats.count(named, None, causes, state) >= MOST_NOT_STARTED
        return AttemptResult(failed=True, reason=reason, ends_run=again, is_repeated=again)
