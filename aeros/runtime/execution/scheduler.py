"""Scheduler: gives skills their turns and advances time for all motions (rules 2 and 4 of `executor`)."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, Final

from aeros.runtime.execution.clean_up import CleanUp, ExecutionContext
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.execution.step import HALTED, ActiveStep, ending_stopped, ending_unheld, required_resources
from aeros.runtime.execution.step_control import StepControl
from aeros.runtime.gate.causes import stop_cause
from aeros.runtime.ports import MotionCompletion, StepHandle, StepStatus
from aeros.runtime.records.records import caller_details
from aeros.runtime.skills.in_process_run import SkillRunResult

_POLL_INTERVAL_S: Final = 0.01
"""Poll interval while the operator pauses, s."""

_STOP: Final = OperatorCommand.STOP


class Scheduler:
    """Scheduler of steps: begins them, lets due skills act, and advances time while any motion is active."""

    def __init__(self, context: ExecutionContext, clean_up: CleanUp, control: StepControl) -> None:
        self._table = context.table
        self._steps = context.table.steps
        self._hold_conditions = context.table.hold_conditions
        self._plant = context.plant
        self._audit = context.audit
        self._resources = context.resources
        self._pipeline = context.pipeline
        self._governor = context.governor
        self._followed = context.followed
        self._clean_up = clean_up
        self._control = control

    def enqueue(self, step: ActiveStep) -> StepHandle:
        """Start a step; it begins once the resources it needs are free.

        Args:
            step: prepared step.

        Returns:
            The handle of the step.
        """
        handle = self._table.add(step)
        self._resources.enqueue(handle, required_resources(step.skill))
        return handle

    def run_until(self, until: float) -> bool:
        """Let a due skill act; if none is due, advance time.

        Args:
            until: plant seconds.

        Returns:
            True if `until` was reached before anything else happened.
        """
        with self._clean_up.on_error:
            self._begin_ready_steps()
            due = next((handle for handle, step in self._steps.items() if step.is_due), None)
            if due is not None and not self._control.actions_are_paused():
                ending = self._control.run_skill(self._steps[due])
                if ending is not None:
                    self._clean_up.halt_step(due, ending)
            elif self._table.is_moving():
                return self._advance_plant(until)
            elif due is not None:
                time.sleep(_POLL_INTERVAL_S)
        return False

    def monitor_tick(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """Monitor the active motions at a control tick; halt steps that are revoked or lost their condition.

        Args:
            now: plant seconds.
            measured: values measured at this tick, as `ports.Monitor` defines them.

        Returns:
            The violated rule, upon which the plant makes a protective stop; None if no rule is violated.
        """
        if self._governor.command is _STOP:
            return HALTED.reason
        if self._governor.generation != self._followed.generation:
            for handle, step in self._steps.items():
                objection = self._revocation_reason(step)
                if objection is not None:
                    self._clean_up.halt_step(
                        handle, SkillRunResult(StepStatus.STOPPED, f"revoked: {objection}")
                    )
        for handle, hold in self._hold_conditions.items():
            step = self._steps[handle]
            if step.active_motion is not None and step.result is None:
                ending = ending_unheld(hold.violation_at_tick(measured, now, self._plant.observe))
                if ending is not None:
                    self._clean_up.halt_step(handle, ending)
        return self._pipeline.monitors(now, measured)

    def _begin_ready_steps(self) -> None:
        """Begin the steps whose turn it is; their timeouts run from now on."""
        if not self._resources.waiting:
            return
        for number in self._resources.grant_ready():
            step = self._steps[StepHandle(number)]
            step.deadline = self._plant.now() + float(step.skill.timeout)
            began = {"time": self._plant.now(), "deadline": step.deadline}
            self._audit.append("step-began", {**began, **caller_details(step.caller)})
            step.is_running = True
            self._plant.skill_began(step.name)
        for handle, step in list(self._steps.items()):
            lacking = (
                None if step.is_running else self._resources.never_available(required_resources(step.skill))
            )
            if lacking is not None:
                reason = f"this site no longer has `{lacking}`"
                self._clean_up.halt_step(handle, SkillRunResult(StepStatus.STOPPED, reason))

    def _advance_plant(self, until: float) -> bool:
        """Advance time until a motion ends or a timeout has passed.

        Returns:
            True if `until` was reached before either.
        """
        moving = {handle: step for handle, step in self._steps.items() if step.active_motion is not None}
        latest = min([until, *(step.deadline for step in moving.values() if step.result is None)])
        ended = self._plant.advance(self.monitor_tick, latest)
        landed = {
            handle: ended[motion.handle]
            for handle, step in moving.items()
            if (motion := step.active_motion) and motion.handle in ended
        }
        self._clean_up.motions_ended(landed)
        for handle, completion in landed.items():
            step = moving[handle]
            ending = step.result or (None if completion.completed else self._ending_broken(completion))
            if ending is not None:
                self._clean_up.halt_step(handle, ending)
        if ended:
            return False
        for handle, step in moving.items():
            if step.deadline <= latest:
                reason = "the skill's timeout passed during a motion"
                self._clean_up.halt_step(handle, SkillRunResult(StepStatus.TIMED_OUT, reason))
        return latest == until

    def _ending_broken(self, completion: MotionCompletion) -> SkillRunResult:
        """Return how a step ends whose motion broke off; for a violated rule, with the measured values."""
        if self._governor.command is _STOP:
            return HALTED
        ending, violation = ending_stopped(completion), self._pipeline.monitors.violation
        by, _, rule = ending.reason.partition("monitor:")
        if by or not rule:
            return ending
        site = self._followed.configuration.site
        ending = ending._replace(causes=(stop_cause(site, rule, violation),))
        if violation is None or violation.rule != rule:
            return ending
        return ending._replace(reason=f"{ending.reason}: {violation}")

    def _revocation_reason(self, step: ActiveStep) -> str | None:
        """Return why the step's active motion may not go on, or None."""
        if step.active_motion is None:
            return None
        caller, kind = step.caller, step.active_motion.active_action.action.kind
        return self._governor.revocation_reason(caller.module, caller.skill, kind)
