"""Scheduler: gives skills their turns, and advances time for all motions (rules 1, 2 and 4 of `executor`).

In its turn a skill yields one action, which is decided and begun (`StepControl`).
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from math import inf
from typing import Any, Final

from aeros.runtime.execution.clean_up import CleanUp, ExecutionContext
from aeros.runtime.execution.denials import denial_words, denied_ending, finished_ending, offer_denial
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.execution.prepare import check_result_outputs
from aeros.runtime.execution.step import (
    HALTED,
    ActiveMotion,
    ActiveStep,
    ObservationFilter,
    end_motions,
    ending_stopped,
    ending_unheld,
    required_resources,
)
from aeros.runtime.gate.causes import stop_cause
from aeros.runtime.gate.transient import is_transient_denial
from aeros.runtime.monitor.late_ticks import LATE_TICKS, LateTickCounter
from aeros.runtime.motion.trajectory import OBSTRUCTED
from aeros.runtime.ports import MotionCompletion, MotionHandle, Plant, StepHandle, StepStatus
from aeros.runtime.records.records import caller_details, format_reasons
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.skill import Action
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site

MAX_ACTIONS: Final = 100
"""Actions that any step may ask for; without a limit, actions that take no time would fill the disk."""

MAX_ACTIONS_PER_S: Final = 20
"""Further actions that a step may ask for, for each second of its skill's timeout."""

MIN_ANSWER_BUDGET_S: Final = 10.0
"""Minimum real time, s, that a skill has for all its answers together, for the sake of busy machines.

Otherwise it has as long as its timeout.  A simulator's clock stands still while a skill computes, so that
the timeout alone would not end a skill that is slow each time.
"""

_HELD_BACK_S: Final = 0.02
"""Time for which motions of others go on before a skill that was denied acts again, plant seconds.

Otherwise they would go on unmonitored for as long as its denials take to decide.
"""

_POLL_INTERVAL_S: Final = 0.01
"""Poll interval while the operator pauses, s."""

_STOP: Final = OperatorCommand.STOP


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
        """Check if no action may begin.

        Returns:
            True if the operator paused, or a new configuration is pending.
        """
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
        if not self._followed.is_active(step.ecm):
            return _revoked(step)  # before its code sees a world that lacks what its module measured
        if step.requested_action is None and step.pending_legs:
            step.requested_action = step.pending_legs.popleft()
            if self.actions_are_paused():
                return None
        if step.requested_action is None:
            ending = self._resume_skill(step)
            if ending is not None or self.actions_are_paused():
                return ending
        if self._governor.command is OperatorCommand.STOP:
            return HALTED
        if not self._followed.is_active(step.ecm):
            return _revoked(step)
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
        timeout = float(step.skill.timeout)
        most = MAX_ACTIONS + int(MAX_ACTIONS_PER_S * timeout)
        if step.request_count == most:
            return SkillRunResult(
                StepStatus.RAISED,
                f"the skill asked for more than {most} actions, the most in its timeout of {timeout:g} s",
            )
        step.request_count += 1
        site = self._followed.configuration.site
        if step.observation_filter is None or step.observation_filter.site is not site:
            step.observation_filter = ObservationFilter(step.ecm, site)
        observation = step.observation_filter.observe(self._plant.observe(), self._plant.now())
        budget = max(timeout, MIN_ANSWER_BUDGET_S)
        began = time.monotonic()
        denial, step.is_denial_open = denial_words(step) if step.is_denial_open else "", False
        response = step.run.resume(
            observation, min(step.deadline - self._plant.now(), budget - step.answer_time), denial
        )
        step.answer_time += time.monotonic() - began
        if isinstance(response, SkillRunResult) and response.status is StepStatus.RAISED:
            if not denial:
                return response
            raised = f"; and then its code raised {response.reason}"
            return denied_ending(step, len(step.denials), raised)
        if self._plant.now() > step.deadline:
            return SkillRunResult(StepStatus.TIMED_OUT, "the skill's timeout has passed")
        if step.answer_time > budget:
            return SkillRunResult(
                StepStatus.TIMED_OUT,
                f"the skill took {step.answer_time:.1f} s of real time for its answers; it has {budget:g} s",
            )
        if isinstance(response, SkillRunResult) and response.status is StepStatus.DENIED:
            return denied_ending(step, response.denials)
        if isinstance(response, SkillRunResult):
            return finished_ending(step, check_result_outputs(step.skill, response))
        step.requested_action = self._with_site_names(step.ecm, response)
        return None

    def _with_site_names(self, ecm: Ecm, action: Action) -> Action:
        """Give an action the site's names for what its module needs; the gate decides only these."""
        if not ecm.names.kinds and not ecm.names.cameras:
            return action
        kind = ecm.names.kinds.get(action.kind, action.kind)
        declared = self._followed.configuration.site.kinds.get(kind)
        parameters = action.parameters
        if declared is not None:
            parameters = ecm.names.site_values(parameters, declared.parameters)
        return Action(kind, parameters)

    def _check_hold_condition(self, step: ActiveStep) -> SkillRunResult | None:
        """Return how the step ends if a hold-condition of it is not measured as true now."""
        if not step.hold_conditions:
            return None
        # Readings before the clock, so that no reading is younger than `now`.
        readings = self._plant.observe()
        now = self._plant.now()
        return ending_unheld(step.hold_conditions, lambda hold: hold.violation(readings, now))

    def _decide_and_begin(self, step: ActiveStep, action: Action) -> SkillRunResult | None:
        """Decide, record and begin an action; return how the step ends, or None if it goes on."""
        others = self._table.active_motions()
        decided = self._pipeline.decide(step.caller, action, others)
        step.decision_counts[decided.decision.kind] += 1
        active_action, plan = decided.active_action, decided.plan
        if active_action is None:
            detour = None
            if not others and not step.pending_legs:
                detour = self._pipeline.find_detour(step.caller, decided.decision, action)
            if detour is not None:
                step.pending_legs.extend(detour)
                return None
            site = self._followed.configuration.site
            step.is_transient = is_transient_denial(decided.decision.reasons, action.kind, site)
            why = format_reasons(decided.decision.reasons, decided.causes)
            if any(reason.code == OBSTRUCTED for reason in decided.decision.reasons):
                why = f"{why}; no way round was found"
            return offer_denial(step, SkillRunResult(StepStatus.DENIED, why, causes=decided.causes))
        if decided.is_protective_stop:
            self._clean_up.stop_all(f"stopped for `{step.name}`, which asked for a protective stop")
        self._pipeline.count_execution(active_action)
        # A completion means that the plant cannot do it; nothing moves then.
        motion = plan if isinstance(plan, MotionCompletion) else self._plant.begin(active_action.action, plan)
        if isinstance(motion, MotionCompletion):
            return offer_denial(step, ending_stopped(motion))
        step.active_motion = ActiveMotion(motion, active_action, plan)
        self._pipeline.monitors.add(active_action, plan)
        return None


def _revoked(step: ActiveStep) -> SkillRunResult:
    return SkillRunResult(StepStatus.STOPPED, f"revoked: `{step.ecm.id}` is no longer active, or was changed")


class TickMonitor:
    """The monitor of the active motions, as the plant calls it (`ports.Monitor`).

    It halts steps that are revoked or lost their condition, and stops everything for the operator.
    """

    def __init__(self, context: ExecutionContext, clean_up: CleanUp) -> None:
        self._table = context.table
        self._steps = context.table.steps
        self._hold_conditions = context.table.hold_conditions
        self._plant = context.plant
        self._late_ticks = _late_tick_counter(context.plant, context.followed.configuration.site)
        self._pipeline = context.pipeline
        self._governor = context.governor
        self._followed = context.followed
        self._clean_up = clean_up

    def __call__(self, now: float, measured: Mapping[str, Any]) -> str | None:
        """Monitor the active motions at a control tick.

        Args:
            now: plant seconds.
            measured: values measured at this tick, as `ports.Monitor` defines them.

        Returns:
            The violated rule, upon which the plant makes a protective stop; None if no rule is violated.
        """
        monitors = self._pipeline.monitors
        if self._late_ticks is not None and self._is_too_late() and monitors.stops.stop is None:
            monitors.begin_stop(LATE_TICKS, now)
            monitors.stops.add(measured)
            return LATE_TICKS
        if self._governor.command is _STOP:
            if monitors.stops.stop is None:
                monitors.begin_stop(HALTED.reason, now)
            monitors.stops.add(measured)
            return HALTED.reason
        if monitors.stops.stop is not None:
            return monitors(now, measured)  # every motion ends already
        if self._governor.generation != self._followed.generation:
            for handle, step in self._steps.items():
                objection = self._revocation_reason(step)
                if objection is not None:
                    self._clean_up.halt_step(
                        handle, SkillRunResult(StepStatus.STOPPED, f"revoked: {objection}")
                    )
        observe = self._plant.observe
        for handle, holds in self._hold_conditions.items():
            step = self._steps[handle]
            if step.active_motion is not None and step.result is None:
                ending = ending_unheld(holds, lambda hold: hold.violation_at_tick(measured, now, observe))
                if ending is not None:
                    self._clean_up.halt_step(handle, ending)
        return monitors(now, measured)

    def restart_if_idle(self) -> None:
        """Let the time between ticks count from the next motion on, if nothing moves now."""
        if self._late_ticks is not None and not self._table.is_moving():
            self._late_ticks.restart()

    def _is_too_late(self) -> bool:
        """Note a tick; return True if it came later than the site allows."""
        assert self._late_ticks is not None  # noqa: S101  for the type checker
        if not self._table.is_moving():
            self._late_ticks.restart()
            return False
        is_too_late = self._late_ticks.tick()
        self._pipeline.monitors.stops.late_ticks = self._late_ticks.count
        return is_too_late

    def begin_stop(self, reason: str, now: float) -> None:
        """Record that the plant begins to stop the robot by itself; see `ports.announce_stop`.

        Args:
            reason: the plant's reason.
            now: plant seconds.
        """
        monitors = self._pipeline.monitors
        if monitors.stops.stop is None:
            monitors.begin_stop(reason, now)
            monitors.stops.add(self._plant.observe())

    def _revocation_reason(self, step: ActiveStep) -> str | None:
        """Return why the step's active motion may not go on, or None."""
        if step.active_motion is None:
            return None
        caller, kind = step.caller, step.active_motion.active_action.action.kind
        return self._governor.revocation_reason(caller.module, caller.skill, kind)


def _late_tick_counter(plant: Plant, site: Site) -> LateTickCounter | None:
    """Make the counter for a plant that runs in real time; None for any other.

    Raises:
        MisuseError: the site has no limits for it.
    """
    if not getattr(plant, "runs_in_real_time", False):
        return None
    if site.motion is None or site.motion.late_ticks is None:
        raise MisuseError(
            f"the plant runs in real time, and the site `{site.id}` does not bound late ticks: "
            "add `motion.late_ticks`"
        )
    return LateTickCounter(site.motion.late_ticks)


class Scheduler:
    """Scheduler of steps: begins them, lets due skills act, and advances time while any motion is active."""

    def __init__(self, context: ExecutionContext, clean_up: CleanUp, control: StepControl) -> None:
        self._table = context.table
        self._steps = context.table.steps
        self._plant = context.plant
        self._audit = context.audit
        self._resources = context.resources
        self._pipeline = context.pipeline
        self._governor = context.governor
        self._followed = context.followed
        self._clean_up = clean_up
        self._control = control
        self.tick_monitor = TickMonitor(context, clean_up)

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
            return self._run_once(until)

    def run_to_end(self, step: StepHandle) -> None:
        """Run all steps until one has ended.

        Args:
            step: handle of that step.
        """
        with self._clean_up.on_error:
            while step not in self._table.results:
                self._run_once(inf)

    def run_until_one_ends(self, until: float) -> bool:
        """Run all steps until any has ended.

        Args:
            until: latest time, plant seconds.

        Returns:
            False if `until` was reached before.
        """
        with self._clean_up.on_error:
            while not self._table.results:
                if self._plant.now() >= until or self._run_once(until):
                    return False
        return True

    def _run_once(self, until: float) -> bool:
        """Do what `run_until` does, without clean-up on errors."""
        self.tick_monitor.restart_if_idle()
        self._begin_ready_steps()
        due = next((handle for handle, step in self._steps.items() if step.is_due), None)
        if due is not None and not self._control.actions_are_paused():
            step = self._steps[due]
            is_held_back, step.is_held_back = step.is_held_back, False
            if is_held_back and self._table.is_moving():
                self._advance_plant(min(until, self._plant.now() + _HELD_BACK_S))
                return False
            ending = self._control.run_skill(step)
            if ending is not None:
                self._clean_up.halt_step(due, ending)
        elif self._table.is_moving():
            return self._advance_plant(until)
        elif due is not None:
            time.sleep(_POLL_INTERVAL_S)
        return False

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
        ended = self._plant.advance(self.tick_monitor, latest)
        self._note_unannounced_stop(moving, ended)
        is_stopped = self._pipeline.monitors.stops.are_open
        if is_stopped:
            self._clean_up.record_stop()
        landed = {
            handle: ended[motion.handle]
            for handle, step in moving.items()
            if (motion := step.active_motion) and motion.handle in ended
        }
        if is_stopped:
            self._clean_up.record_halts(landed)
        end_motions(self._table, landed, self._pipeline.monitors, self._followed)
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

    def _note_unannounced_stop(
        self, moving: Mapping[StepHandle, ActiveStep], ended: Mapping[MotionHandle, MotionCompletion]
    ) -> None:
        """Begin the record of a stop that the plant made without a word; it is over, so it has one tick."""
        for step in moving.values():
            motion = step.active_motion
            completion = None if motion is None or motion.is_halting else ended.get(motion.handle)
            if completion is not None and not completion.completed:
                self.tick_monitor.begin_stop(completion.reason or "", self._plant.now())

    def _ending_broken(self, completion: MotionCompletion) -> SkillRunResult:
        """Return how a step ends whose motion broke off; for a violated rule, with the measured values."""
        if self._governor.command is _STOP:
            return HALTED
        ending, violation = ending_stopped(completion), self._pipeline.monitors.violation
        by, _, rule = ending.reason.partition("monitor:")
        if by or not rule:
            return ending
        cause = stop_cause(self._followed.configuration.site, rule, violation)
        values = ", ".join(map(str, cause.shortfalls))
        reason = f"{ending.reason}: {values}" if values else ending.reason
        return ending._replace(reason=reason, causes=(cause,))
