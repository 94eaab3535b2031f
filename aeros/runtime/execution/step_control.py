"""Control of one step: its skill yields an action, which is decided and begun (rule 1 of `executor`)."""

from __future__ import annotations

from typing import Final

from aeros.runtime.execution.clean_up import CleanUp, ExecutionContext
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.execution.prepare import check_result_outputs
from aeros.runtime.execution.step import (
    HALTED,
    ActiveMotion,
    ActiveStep,
    ObservationFilter,
    ending_stopped,
    ending_unheld,
)
from aeros.runtime.gate.transient import is_transient_denial
from aeros.runtime.ports import MotionCompletion, StepStatus
from aeros.runtime.records.records import format_reasons
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.skill import Action

MAX_ACTIONS: Final = 10_000
"""Actions of one step beyond which a skill floods; a zero-time action could otherwise repeat for ever."""


class StepControl:
    """Lets the skill of a step act once, where nobody objects."""

    def __init__(self, context: ExecutionContext, clean_up: CleanUp) -> None:
        self._table = context.table
        self._plant = context.plant
        self._audit = context.audit
        self._pipeline = context.pipeline
        self._governor = context.governor
        self._followed = context.followed
        self._clean_up = clean_up
        self._is_paused = False

    def actions_are_paused(self) -> bool:
        """Say whether no action may begin: the operator pauses, or one of an older configuration moves."""
        paused = self._governor.command is OperatorCommand.PAUSE
        if paused is not self._is_paused:
            self._is_paused = paused
            self._audit.append("paused" if paused else "resumed", {"time": self._plant.now()})
        return paused or not self._followed.is_latest()

    def run_skill(self, step: ActiveStep) -> SkillRunResult | None:
        """Let the skill ask for an action and begin it.

        Returns:
            How the step ends; None where its action has begun, or waits to be decided.
        """
        lost = self._check_hold_condition(step)
        if lost is not None:
            return lost
        if step.requested_action is None:
            ending = self._resume_skill(step)
            if ending is not None or self.actions_are_paused():
                return ending
        if self._governor.command is OperatorCommand.STOP:
            return HALTED
        if not self._followed.is_active(step.ecm):
            return SkillRunResult(StepStatus.STOPPED, f"revoked: `{step.ecm.id}` is not active as it was")
        in_force = self._followed.hold()
        try:
            asked = step.requested_action
            if not in_force or asked is None:
                return None
            step.requested_action = None
            # Once more: meanwhile the skill has computed.
            return self._check_hold_condition(step) or self._decide_and_begin(step, asked)
        finally:
            self._followed.release()

    def _resume_skill(self, step: ActiveStep) -> SkillRunResult | None:
        """Let the skill ask for its next action, into `step.asked`; or return how the step ends."""
        if step.request_count == MAX_ACTIONS:
            return SkillRunResult(StepStatus.RAISED, f"the skill floods: more than {MAX_ACTIONS} actions")
        step.request_count += 1
        site = self._followed.configuration.site
        if step.observation_filter is None or step.observation_filter.site is not site:
            step.observation_filter = ObservationFilter(step.ecm, site)
        observation = step.observation_filter.observe(self._plant.observe(), self._plant.now())
        asked = step.run.resume(observation, step.deadline - self._plant.now())
        if isinstance(asked, SkillRunResult) and asked.status is StepStatus.RAISED:
            return asked
        if self._plant.now() > step.deadline:
            return SkillRunResult(StepStatus.TIMED_OUT, "the skill's time-out has passed")
        if isinstance(asked, SkillRunResult):
            return check_result_outputs(step.skill, asked)
        step.requested_action = asked
        return None

    def _check_hold_condition(self, step: ActiveStep) -> SkillRunResult | None:
        """Return how the step ends if its hold-condition is not measured now."""
        if step.hold_condition is None:
            return None
        # In this order: a reading is never younger than the time it is judged at.
        readings = self._plant.observe()
        return ending_unheld(step.hold_condition.violation(readings, self._plant.now()))

    def _decide_and_begin(self, step: ActiveStep, asked: Action) -> SkillRunResult | None:
        """Have an action decided and recorded, and begin it; None when it has begun."""
        decided = self._pipeline.decide(step.caller, asked, self._table.active_motions())
        step.decision_counts = step.decision_counts.with_decision(decided.decision.kind)
        begun, plan = decided.active_action, decided.plan
        if begun is None:
            site = self._followed.configuration.site
            step.is_transient = is_transient_denial(decided.decision.reasons, asked.kind, site)
            why = format_reasons(decided.decision.reasons)
            return SkillRunResult(StepStatus.DENIED, why, causes=decided.causes)
        if decided.is_protective_stop:
            self._clean_up.stop_all(f"stopped for `{step.name}`, which asks for a protective stop")
        self._pipeline.count_execution(begun)
        # A completion: the plant cannot do it, and nothing moves.
        motion = plan if isinstance(plan, MotionCompletion) else self._plant.begin(begun.action, plan)
        if isinstance(motion, MotionCompletion):
            return ending_stopped(motion)
        step.active_motion = ActiveMotion(motion, begun, plan)
        self._pipeline.monitors.add(begun)
        return None
