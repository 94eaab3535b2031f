"""Rules on what follows a failed attempt: a retry, a wait, a pause, another provider, or the end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.agent.execution.attempt import RAN_STATUSES, AttemptResult, PendingAttempt
from aeros.agent.execution.dispatcher import Dispatch, Dispatcher
from aeros.agent.execution.failure_streak import FailureStreak, quantities_of
from aeros.agent.execution.repeats import (
    LOOK_AGAIN_PAUSE_S,
    MOST_OF_A_KIND,
    SECOND_LOOK_PAUSE_S,
    FinishedPlans,
    RepeatedFailures,
    is_explained_by_chance,
)
from aeros.agent.execution.report import StepRecord
from aeros.agent.execution.supervisor import StepAssessment, is_measured
from aeros.agent.execution.waiting import wait_after_denial, wait_for_condition
from aeros.agent.memory.experience import expected_skill
from aeros.agent.memory.store import Memory
from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import Runtime, StepResult, StepStatus
from aeros.spec.closed_loop.giving_up import MOST_NOT_STARTED, failure_probability, success_probability
from aeros.spec.model.cause import Cause


class FailureRules:
    """The rules of one run, with the failures that they remember.

    Args:
        runtime: has the site.
        memory: has the record of each skill.
        dispatcher: prefers other providers than those that it is told to avoid.

    Attributes:
        repeats: failures of this run that chance does not explain, other than declared ones.
        streak: declared failures since the skills last succeeded.
        finished_plans: plans that were carried out without reaching the goal.
    """

    def __init__(self, runtime: Runtime, memory: Memory, dispatcher: Dispatcher) -> None:
        self._runtime = runtime
        self._memory = memory
        self._dispatcher = dispatcher
        self.repeats = RepeatedFailures()
        self.streak = FailureStreak()
        self.finished_plans = FinishedPlans()
        self._verdicts: set[tuple[str, str, str | None]] = set()
        # Records are those of earlier runs; what fails in this one, `repeats` and `streak` judge.
        self._last_episode = memory.latest_episode()

    def after_step(
        self,
        pending: PendingAttempt,
        record: StepRecord,
        result: StepResult,
        judgement: StepAssessment,
        after: WorldModel,
        *,
        stops: bool,
    ) -> AttemptResult:
        """Make the result of an attempt that ended.

        Args:
            pending: the attempt.
            record: record of the invocation.
            result: result that the runtime gave.
            judgement: its assessment.
            after: the world as measured after it.
            stops: its outcome already ends the run.

        Returns:
            The result of the attempt.
        """
        dispatch = pending.dispatch
        is_known = not (judgement.is_undeclared or judgement.is_unknown)
        raised = result.status is StepStatus.RAISED
        useless = self._streak_reason(pending, result, judgement, after)
        times = self._count_failures(pending, result, judgement, after)
        is_repeated = times >= MOST_OF_A_KIND
        repeatable = record.failed and record.status in RAN_STATUSES and is_known and not raised
        repeatable = repeatable and not judgement.is_verdict
        hopeless = self._no_retry_reason(dispatch) if repeatable else ""
        if times > 1:
            hopeless = f"it failed {times} times in the same way"
        is_repeated = is_repeated or bool(useless)
        hopeless = useless or hopeless
        is_final = judgement.is_verdict and self._is_confirmed(pending, judgement)
        is_hopeless = raised or is_repeated or is_final
        if is_hopeless or (result.status is StepStatus.DENIED and not result.is_transient):
            self._dispatcher.avoid(dispatch.request.module, dispatch.request.skill)
        # What chance does not explain is not tried again: another provider may be, the same may not.
        stops = stops or (is_hopeless and not self._dispatcher.has_another(dispatch))
        if useless:
            self.streak.reset()
        pause_s = SECOND_LOOK_PAUSE_S if judgement.is_verdict else self._streak_pause_s(pending)
        return AttemptResult(
            record.failed,
            f"{record.reason}; {useless}" if useless else record.reason,
            repeatable,
            record,
            result.outputs,
            hopeless,
            stops,
            is_repeated=is_repeated,
            is_verdict=is_final,
            pause_s=LOOK_AGAIN_PAUSE_S if times > 1 else pause_s,
            wait=wait_after_denial(result.causes, self._runtime.site) if result.is_transient else None,
            is_stop=result.status is StepStatus.CANCELLED and is_known,
            is_exhausted=result.denials >= MOST_OF_A_KIND,
        )

    def after_no_start(
        self,
        step: tuple[str, str, Mapping[str, Any]],
        reason: str,
        causes: tuple[Cause, ...],
        planned_state: Mapping[str, Any] | None,
    ) -> AttemptResult:
        """Make the result of an attempt that could not start.

        Args:
            step: module, skill and inputs (SI).
            reason: why it could not start.
            causes: the same as data.
            planned_state: predicates as measured now, if the plan that begins with the step was made in this
                very state; else None.

        Returns:
            The result of the attempt.
        """
        wait = wait_for_condition(causes, self._runtime.site)
        if wait is not None:
            return AttemptResult(failed=True, reason=reason, wait=wait)
        if planned_state is None:
            return AttemptResult(failed=True, reason=reason)
        named = (step[0], step[1], {name: to_json_value(value) for name, value in step[2].items()})
        again = self.repeats.count(named, None, causes, planned_state) >= MOST_NOT_STARTED
        return AttemptResult(failed=True, reason=reason, ends_run=again, is_repeated=again)

    def forget(self) -> None:
        """Begin anew, as somebody has changed something: what failed before may succeed now."""
        self.repeats = RepeatedFailures()
        self.streak.reset()
        self.finished_plans.forget()
        self._verdicts.clear()
        self._dispatcher.denied.clear()

    def _is_confirmed(self, pending: PendingAttempt, judgement: StepAssessment) -> bool:
        """Note a verdict; return True for the second one: what was seen first may have been on the move."""
        request = pending.dispatch.request
        verdict = (request.module, request.skill, judgement.outcome)
        is_confirmed = verdict in self._verdicts
        self._verdicts.add(verdict)
        return is_confirmed

    def _count_failures(
        self, pending: PendingAttempt, result: StepResult, judgement: StepAssessment, after: WorldModel
    ) -> int:
        """Note a failure that chance does not explain; return how often it happened, 0 for any other end.

        An end that no outcome declares, or that is unknown, is not declared to be chance.
        """
        causes, site = judgement.causes, self._runtime.site
        is_declared = judgement.outcome is not None or result.status is not StepStatus.FINISHED
        if not judgement.failed or (is_declared and is_explained_by_chance(result.status, causes, site)):
            return 0
        request, beginning = pending.dispatch.request, pending.episode_start
        step = (request.module, request.skill, beginning.inputs)
        joints: Any = None
        if result.status is StepStatus.STOPPED and site.motion is not None:
            joints = after.known.get(site.motion.start_variable)
        place = [] if joints is None else [round(float(one), 3) for one in joints]
        return self.repeats.count(step, result.status, causes, beginning.before, place)

    def _streak_reason(
        self, pending: PendingAttempt, result: StepResult, judgement: StepAssessment, after: WorldModel
    ) -> str:
        """Note how a step ended; return why another try is no use, empty if it may be of use."""
        dispatch, beginning = pending.dispatch, pending.episode_start
        skill = (dispatch.request.module, dispatch.request.skill)
        if result.status is not StepStatus.FINISHED or judgement.outcome is None:
            return ""
        ends = self._memory.experience(*skill, dispatch.code, self._last_episode)
        expected = expected_skill(dispatch.skill, ends)
        if not judgement.failed:
            self.streak.succeeded(skill)
            likely = success_probability(expected, lambda one: is_measured(one, after, beginning.before))
            self.finished_plans.note_success(likely)
            return ""
        quantities = quantities_of(after.known, self._runtime.active_modules()[skill[0]].state)
        state, started = beginning.before, beginning.started
        self.streak.add(skill, failure_probability(expected), state, started, quantities)
        return self.streak.reason_to_stop(skill, state, self._runtime.now())

    def _streak_pause_s(self, pending: PendingAttempt) -> float:
        request = pending.dispatch.request
        before = pending.episode_start.before
        return self.streak.pause((request.module, request.skill), before, self._runtime.now())

    def _no_retry_reason(self, dispatch: Dispatch) -> str:
        """Return why memory makes another attempt in this context hopeless; empty if it does not."""
        request = dispatch.request
        records = {option.skill: option.record for option in dispatch.choice.options}
        record = self._memory.success_record(
            request.module, request.skill, dispatch.context, self._last_episode
        )
        records |= {request.skill: record}
        if not all(record.is_hopeless for record in records.values()):
            return ""
        counts = ", ".join(f"`{skill}` {record}" for skill, record in records.items())
        return f"succeeded before in this context: {counts}"
