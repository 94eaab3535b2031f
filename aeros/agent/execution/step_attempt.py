"""One skill invocation: precondition, request, submission, new measurement, assessment and memory."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from aeros.agent.execution.after_failure import FailureRules
from aeros.agent.execution.attempt import (
    AttemptResult,
    PendingAttempt,
    RunningAttempt,
    counts_toward_record,
)
from aeros.agent.execution.attempt_journal import (
    OverdueSteps,
    record_broken_assumption,
    record_end,
    record_not_started,
    record_provider_choice,
    record_start,
)
from aeros.agent.execution.cancellable_wait import CancellableWait
from aeros.agent.execution.dispatcher import ChosenComposition, Dispatcher, DispatchError
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.planning_memory import PlanningMemory
from aeros.agent.execution.report import StepRecord, StepRole
from aeros.agent.execution.supervisor import StepAssessment, assess_step
from aeros.agent.execution.uncertain_steps import UncertainSteps
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, Memory
from aeros.agent.world.definitions import definition_causes
from aeros.agent.world.values import CachingConverter, to_json_value
from aeros.agent.world.world import WorldModel, world_from_readings
from aeros.runtime.ports import EndedStep, LogHead, Runtime, StepHandle, StepResult, StepStatus
from aeros.spec.model.cause import Cause, causes_to_json
from aeros.spec.model.ecm import ActionCondition, Ecm


class StepRunner:
    """Runner of skills through the runtime, which also keeps the world as last measured."""

    def __init__(self, runtime: Runtime, memory: Memory, journal: Journal, task: str, seed: int = 0) -> None:
        self._runtime = runtime
        self._memory = memory
        self._journal = journal
        self.dispatcher = Dispatcher(runtime, memory, task, seed)
        self._task = task
        self._exactly = CachingConverter()
        self.waiting = CancellableWait(runtime)
        self._overdue = OverdueSteps(journal)
        self.planned_in: list[Mapping[str, Any]] = []
        self._failures: list[Cause] = []
        self.records: list[StepRecord] = []
        self.planning_memory = PlanningMemory(runtime, memory)
        self.bars = UncertainSteps()
        self.failure_rules = FailureRules(runtime, memory, self.dispatcher)
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
            The world as last measured, with the causes of step failures since the previous plan, and the
            last values seen of what is not measured now.
        """
        world = self.planning_memory.view(self.world, self._failures)
        self._failures.clear()
        self.failure_rules.finished_plans.begin()
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
        """Wait for the next step to end, and record what is overdue meanwhile; see `ports.Runtime`.

        Args:
            until: plant time (s) at which the wait ends.

        Returns:
            The step that ended, or None if none did before `until`, or the run is cancelled meanwhile.
        """
        return self._overdue.wait(self.waiting, until)

    def idle_until(self, until: float) -> None:
        """Let plant time pass while no step runs, then measure the world.

        Args:
            until: plant time (s).
        """
        self.waiting.until(until)
        self.observe()

    def cancel(self, handle: StepHandle, reason: str) -> None:
        """Halt a running step.

        Args:
            handle: the runtime's handle of the step.
            reason: reason for the audit record.
        """
        self._runtime.cancel(handle, reason)

    def start(
        self,
        role: StepRole,
        module: str,
        skill: str,
        inputs: Mapping[str, Any],
        held: tuple[ActionCondition, ...] = (),
    ) -> RunningAttempt | AttemptResult | ChosenComposition:
        """Start a skill if it is active and its precondition is measured as true now.

        Args:
            role: reason for the invocation.
            module: id of the module.
            skill: skill or capability of the module.
            inputs: inputs by name (SI).
            held: conditions of the parts of the plan around it, which the runtime holds while it runs.

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
        if held:
            dispatch = replace(dispatch, request=replace(dispatch.request, held=held))
        request = dispatch.request
        barred = self.bars.reason_not_to_start(request.module, dispatch.skill, request.inputs, self.world)
        if barred is not None:
            cause = Cause("interrupted", f"{request.module}.{request.skill}", barred)
            step = (request.module, request.skill, request.inputs)
            return self._not_started(role, step, barred, (cause,))
        given = {key: to_json_value(value) for key, value in dispatch.request.inputs.items()}
        beginning = EpisodeStart(
            task=self._task,
            module=request.module,
            skill=request.skill,
            role=role.value,
            inputs=given,
            started=self._runtime.now(),
            before=self.world.predicates,
            context=dispatch.context,
            code=dispatch.code,
        )
        episode = self._memory.start_episode(beginning)
        record_start(self._journal, role, dispatch, given)
        handle = self._runtime.start(dispatch.request)
        made = PendingAttempt(role, dispatch, beginning, episode)
        if not isinstance(handle, StepResult):
            self._overdue.begin(made)
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
        dispatch, role, request = pending.dispatch, pending.role, pending.dispatch.request
        self._overdue.end(pending)
        ended = self._runtime.now()
        after = self.observe()
        before = pending.episode_start.before
        judgement = assess_step(request.module, dispatch.skill, result, after, before, request.held)
        self.planning_memory.note(after)
        causes = causes_to_json(judgement.causes)
        self._failures += judgement.causes
        ending = EpisodeEnd(
            result.status.value,
            judgement.outcome,
            judgement.failed,
            judgement.reason,
            ended,
            after.predicates,
            counts_toward_record(result),
            causes,
        )
        self._memory.end_episode(pending.episode_id, ending)
        record_end(self._journal, role, dispatch, result, judgement)
        stops = judgement.is_undeclared and self._ends_run(result)
        if judgement.is_undeclared:
            record_broken_assumption(
                *(self._journal, self._runtime, dispatch, result, judgement),
                before=before,
                after=after,
                ends_run=stops,
            )
        record = _record_of(pending, result, judgement, ended)
        self.records.append(record)
        return self.failure_rules.after_step(pending, record, result, judgement, self.world, stops=stops)

    def _ends_run(self, result: StepResult) -> bool:
        """Return True if this undeclared outcome ends the run.

        A halt in a state that no outcome declares is no such outcome: the skill had not ended by itself.
        """
        return result.status is StepStatus.FINISHED and self._runtime.site.stops_on_undeclared_outcome

    def _not_started(
        self,
        role: StepRole,
        step: tuple[str, str, Mapping[str, Any]],
        reason: str,
        causes: tuple[Cause, ...],
    ) -> AttemptResult:
        self._failures += causes
        parts = [part for cause in causes for part in cause.shortfalls]
        behind = definition_causes(self.world, parts, self._runtime.active_modules())
        record_not_started(self._journal, role, f"{step[0]}.{step[1]}", reason, (*causes, *behind))
        # Where other steps came between plan and step, their chance decides what the next plan comes to.
        state = self.world.predicates
        is_planned = role is StepRole.STEP and state == self._planned_state
        return self.failure_rules.after_no_start(step, reason, causes, state if is_planned else None)


def _record_of(
    pending: PendingAttempt, result: StepResult, judgement: StepAssessment, ended: float
) -> StepRecord:
    return StepRecord(
        role=pending.role,
        module=pending.dispatch.request.module,
        skill=pending.dispatch.request.skill,
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
