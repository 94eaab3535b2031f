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
"""Limit on the actions of one step; without it a zero-time action could repeat for ever."""


class StepControl:
    """Control of one step at a time: its skill acts once, unless operator or configuration forbid it."""

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
        """Return True if no action may begin: the operator paused, or a new configuration is pending."""
        paused = self._governor.command is OperatorCommand.PAUSE
        if paused is not self._is_paused:
            self._is_paused = paused
            self._audit.append("paused" if paused else "resumed", {"time": self._plant.now()})
        return paused or not self._followed.is_latest()

    def run_skill(self, step: ActiveStep) -> SkillRunResult | None:
        """Let the skill ask for an action, decide it and begin it.

        Args:
            step: a step that is due.

        Returns:
            How the step ends; None if its action has begun or still waits to be decided.
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
            return SkillRunResult(
                StepStatus.STOPPED, f"revoked: `{step.ecm.id}` is no longer active, or was changed"
            )
        in_force = self._followed.hold()
        try:
            action = step.requested_action
            if not in_force or action is None:
                return None
            step.requested_action = None
            # Again, because the skill took time to compute.
            return self._check_hold_condition(step) or self._decide_and_begin(step, action)
        finally:
            self._followed.release()

    def _resume_skill(self, step: ActiveStep) -> SkillRunResult | None:
        """Store the skill's next action in `step.requested_action`; or return how the step ends."""
        if step.request_count == MAX_ACTIONS:
            return SkillRunResult(StepStatus.RAISED, f"the skill asked for more than {MAX_ACTIONS} actions")
        step.request_count += 1
        site = self._followed.configuration.site
        if step.observation_filter is None or step.observation_filter.site is not site:
            step.observation_filter = ObservationFilter(step.ecm, site)
        observation = step.observation_filter.observe(self._plant.observe(), self._plant.now())
        response = step.run.resume(observation, step.deadline - self._plant.now())
        if isinstance(response, SkillRunResult) and response.status is StepStatus.RAISED:
            return response
        if self._plant.now() > step.deadline:
            return SkillRunResult(StepStatus.TIMED_OUT, "the skill's timeout has passed")
        if isinstance(response, SkillRunResult):
            return check_result_outputs(step.skill, response)
        step.requested_action = response
        return None

    def _check_hold_condition(self, step: ActiveStep) -> SkillRunResult | None:
        """Return how the step ends if its hold-condition is not measured as true now."""
        if step.hold_condition is None:
            return None
        # Readings before the clock, so that no reading is younger than `now`.
        readings = self._plant.observe()
        return ending_unheld(step.hold_condition.violation(readings, self._plant.now()))

    def _decide_and_begin(self, step: ActiveStep, action: Action) -> SkillRunResult | None:
        """Decide, record and begin an action; return how the step ends, or None if the action has begun."""
        decided = self._pipeline.decide(step.caller, action, self._table.active_motions())
        step.decision_counts = step.decision_counts.with_decision(decided.decision.kind)
        active_action, plan = decided.active_action, decided.plan
        if active_action is None:
            site = self._followed.configuration.site
            step.is_transient = is_transient_denial(decided.decision.reasons, action.kind, site)
            why = format_reasons(decided.decision.reasons)
            return SkillRunResult(StepStatus.DENIED, why, causes=decided.causes)
        if decided.is_protective_stop:
            self._clean_up.stop_all(f"stopped for `{step.name}`, which asked for a protective stop")
        self._pipeline.count_execution(active_action)
        # A completion means that the plant cannot do it; nothing moves then.
        motion = plan if isinstance(plan, MotionCompletion) else self._plant.begin(active_action.action, plan)
        if isinstance(motion, MotionCompletion):
            return ending_stopped(motion)
        step.active_motion = ActiveMotion(motion, active_action, plan)
        self._pipeline.monitors.add(active_action)
        return None
