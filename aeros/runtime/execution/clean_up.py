"""Clean-up of a step: runs exactly once, however the step ends (rules 3 and 5 of `executor`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack, suppress
from math import inf
from typing import NamedTuple

from aeros.descriptions import describe_exception
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.runtime.execution.decision_pipeline import DecisionPipeline
from aeros.runtime.execution.governor import FollowedConfiguration, Governor
from aeros.runtime.execution.resources import ResourceQueue
from aeros.runtime.execution.step import ActiveStep, StepTable, end_motions
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.ports import Plant, StepHandle, StepResult, StepStatus
from aeros.runtime.records.records import caller_details
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.spec.model.cause import causes_to_json


class ExecutionContext(NamedTuple):
    """The parts of an executor that its scheduler, step control and clean-up share.

    Attributes:
        table: the steps that are active.
        plant: the plant that executes actions.
        audit: the log that decisions and ends of steps are written to.
        resources: the queue of steps for the site's resources.
        pipeline: the way of an action through the gate to the plant.
        governor: source of the configuration in force.
        followed: the configuration that the executor follows; it changes only while no motion is active.
    """

    table: StepTable
    plant: Plant
    audit: AuditLog
    resources: ResourceQueue
    pipeline: DecisionPipeline
    governor: Governor
    followed: FollowedConfiguration


class CleanUp:
    """Clean-up of steps: brings their motions to rest, closes their skills and records how they ended.

    Attributes:
        on_error: context manager that cleans up every step if its block raises.
    """

    def __init__(self, context: ExecutionContext) -> None:
        self._table = context.table
        self._plant = context.plant
        self._audit = context.audit
        self._resources = context.resources
        self._pipeline = context.pipeline
        self._followed = context.followed
        self.on_error = _CleanUpOnError(self.clean_up_all)

    def halt_step(self, handle: StepHandle, ending: SkillRunResult) -> None:
        """End a step: now if it has no active motion, else once its motion has come to rest.

        Args:
            handle: the step; must not have ended.
            ending: status and reason to record. Ignored if the step is ending already.
        """
        step = self._table.steps[handle]
        if step.active_motion is None:
            step.result = ending
            self._finish_step(handle)
        elif step.result is None:
            step.result = ending
            motion = step.active_motion
            step.active_motion = motion._replace(is_halting=True)
            record_number = motion.active_action.record_number
            monitors = self._pipeline.monitors
            monitors.stops.begin_halt(record_number, ending.reason, self._plant.now())
            monitors.tracker.halt(record_number)
            self._plant.halt(step.active_motion.handle)

    def stop_all(self, reason: str) -> None:
        """Make a protective stop and end every step that has an active motion; do nothing if none has.

        Args:
            reason: recorded as the reason of each step that was not ending already.
        """
        moving = [handle for handle, step in self._table.steps.items() if step.active_motion is not None]
        if not moving:
            return
        monitors = self._pipeline.monitors
        monitors.begin_stop(reason, self._plant.now())
        self._plant.advance(monitors, inf)  # which stops at once, and is measured at every tick
        self.record_stop()
        self._end_motions(moving)
        for handle in moving:
            step = self._table.steps[handle]
            self.halt_step(handle, step.result or SkillRunResult(StepStatus.STOPPED, reason))

    def record_stop(self) -> None:
        """Record how the robot came to rest, if it was stopped; to be called before its steps end."""
        details = self._pipeline.monitors.stops.end_stop(self._plant.now())
        if details is not None:
            self._audit.append("stopped", details)

    def record_halts(self, handles: Iterable[StepHandle]) -> None:
        """Record how the motions of these steps came to rest, as far as they were halted.

        Args:
            handles: steps whose motions have ended.
        """
        for handle in handles:
            step = self._table.steps[handle]
            if step.active_motion is not None:
                details = self._pipeline.monitors.stops.end_halt(
                    step.active_motion.active_action.record_number, self._plant.now()
                )
                if details is not None:
                    self._audit.append("stopped", {**details, **caller_details(step.caller)})

    def clean_up_all(self, failure: BaseException) -> None:
        """Clean up every step that has not ended, newest first, and record each as broken by `failure`.

        Stops the plant first. Every part of the clean-up runs even if another raises.

        Args:
            failure: the exception that ended the executor's work; its description goes into the record.
        """
        steps = dict(self._table.steps)
        with ExitStack() as stack:
            for handle, step in reversed(steps.items()):
                stack.callback(self._record_failure, step, failure)
                stack.callback(self._clean_up_step, handle, step)
            stack.callback(self._table.hold_conditions.clear)
            stack.callback(self._table.steps.clear)
            stack.callback(self._end_motions, steps)
            if any(step.active_motion is not None for step in steps.values()):
                stack.callback(self._stop_and_record, describe_exception(failure))
            elif any(step.is_running for step in steps.values()):
                stack.callback(self._plant.stop)

    def _end_motions(self, handles: Iterable[StepHandle]) -> None:
        end_motions(self._table, handles, self._pipeline.monitors, self._followed)

    def _finish_step(self, handle: StepHandle) -> None:
        """Clean up a step without active motion, record its end and keep its result."""
        step = self._table.steps.pop(handle)
        self._table.hold_conditions.pop(handle, None)
        try:
            with ExitStack() as stack:
                # Callbacks run from last to first, each even if another raises: the plant stops first.
                stack.callback(self._clean_up_step, handle, step)
                if step.is_running and not step.is_finished and not self._table.is_moving():
                    stack.callback(self._plant.stop)
        except BaseException as failure:
            self._record_failure(step, failure)
            raise
        assert step.result is not None  # noqa: S101  `halt_step` has set it
        status, words, outputs, causes, lost_hold, denials = step.result
        # A skill's reason may contain surrogates, which files, databases and terminals reject.
        reason = words.encode(errors="backslashreplace").decode()
        outcome = {"time": self._plant.now(), "status": status.value, "reason": reason}
        if self._pipeline.monitors.stops.late_ticks:
            outcome["late_ticks"] = self._pipeline.monitors.stops.late_ticks
        event = "step-ended" if step.is_running else "step-refused"
        output_details = {} if outputs is None else {"outputs": dict(outputs)}
        # Of a skill that finished, the causes are of denials, which have records of their own.
        has_causes = bool(causes) and status is not StepStatus.FINISHED
        cause_details = {"causes": causes_to_json(causes)} if has_causes else {}
        self._audit.append(
            event, {**outcome, **cause_details, **caller_details(step.caller), **output_details}
        )
        counts = step.decision_counts
        self._table.results[handle] = StepResult(
            status,
            reason,
            counts[DecisionKind.ALLOW],
            counts[DecisionKind.ATTENUATE],
            counts[DecisionKind.DENY],
            dict(outputs or {}),
            step.is_transient and status is StepStatus.DENIED,
            causes,
            lost_hold,
            denials,
        )

    def _clean_up_step(self, handle: StepHandle, step: ActiveStep) -> None:
        """Close the skill, notify the plant, release the resources; each runs even if another raises."""
        with ExitStack() as stack:
            stack.callback(self._resources.release, handle)
            if step.is_running:
                stack.callback(lambda: self._plant.skill_ended(step.name, finished=step.is_finished))
            stack.callback(step.close_skill)

    def _stop_and_record(self, reason: str) -> None:
        """Stop the plant, and record the stop as far as plant and log still work."""
        stops = self._pipeline.monitors.stops
        with ExitStack() as stack:
            stack.callback(self._record_broken_stop)
            stack.callback(self._plant.stop)
            with suppress(Exception):
                stops.begin_stop(reason, self._plant.now())
                stops.add(self._plant.observe())

    def _record_broken_stop(self) -> None:
        """Record a stop of a plant or log that may not work; failures are reported by others."""
        with suppress(Exception):
            self._pipeline.monitors.stops.add(self._plant.observe())
        with suppress(Exception):
            self.record_stop()

    def _record_failure(self, step: ActiveStep, failure: BaseException) -> None:
        """Record that the step broke off.

        If the log cannot be written, a note is added to `failure`, which is being raised already.
        """
        try:
            self._audit.append(
                "step-broken", {"reason": describe_exception(failure), **caller_details(step.caller)}
            )
        except AuditError as unwritten:
            failure.add_note(f"the end of the step is not in the record: {unwritten}")


class _CleanUpOnError:
    """Context manager that cleans up every step if its block raises."""

    def __init__(self, clean_up_all: Callable[[BaseException], None]) -> None:
        self._clean_up_all = clean_up_all

    def __enter__(self) -> None:
        """Do nothing: there is nothing to clean up yet."""

    def __exit__(self, _: object, failure: BaseException | None, __: object) -> None:
        """Clean up if the block raised; the exception propagates."""
        if failure is not None:
            self._clean_up_all(failure)
