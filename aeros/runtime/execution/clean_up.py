"""Clean-up: a step that ends, however it does, is cleaned up after once (rules 3 and 5 of `executor`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from typing import NamedTuple

from aeros.descriptions import describe_exception
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.runtime.execution.decision_pipeline import DecisionPipeline
from aeros.runtime.execution.governor import FollowedConfiguration, Governor
from aeros.runtime.execution.resources import ResourceQueue
from aeros.runtime.execution.step import ActiveStep, StepTable
from aeros.runtime.ports import Plant, StepHandle, StepResult, StepStatus
from aeros.runtime.records.records import caller_details
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.spec.model.cause import causes_to_json as told_causes


class ExecutionContext(NamedTuple):
    """The parts of an executor that its scheduler, step control and clean-up share."""

    table: StepTable
    plant: Plant
    audit: AuditLog
    resources: ResourceQueue
    pipeline: DecisionPipeline
    governor: Governor
    followed: FollowedConfiguration


class CleanUp:
    """Ends steps: brings what they move to rest, closes their skills, and records how they ended."""

    def __init__(self, context: ExecutionContext) -> None:
        self._table = context.table
        self._plant = context.plant
        self._audit = context.audit
        self._resources = context.resources
        self._pipeline = context.pipeline
        self._followed = context.followed
        self.on_error = _CleanUpOnError(self.clean_up_all)
        """A context manager that cleans up after every step where its block raises."""

    def halt_step(self, handle: StepHandle, ending: SkillRunResult) -> None:
        """End a step: now if it moves nothing, else once that has come to rest."""
        step = self._table.steps[handle]
        if step.active_motion is None:
            step.result = ending
            self._finish_step(handle)
        elif step.result is None:
            step.result = ending
            step.active_motion = step.active_motion._replace(is_halting=True)
            self._plant.halt(step.active_motion.handle)

    def stop_all(self, reason: str) -> None:
        """Make a protective stop, which ends every step that moves something."""
        moving = [handle for handle, step in self._table.steps.items() if step.active_motion is not None]
        if not moving:
            return
        self._plant.stop()
        self.motions_ended(moving)
        for handle in moving:
            step = self._table.steps[handle]
            self.halt_step(handle, step.result or SkillRunResult(StepStatus.STOPPED, reason))

    def motions_ended(self, handles: Iterable[StepHandle]) -> None:
        """Take the motions of these steps for over: nothing of them is under way any more."""
        for handle in handles:
            step = self._table.steps[handle]
            if step.active_motion is not None:
                self._pipeline.monitors.remove(step.active_motion.active_action)
                step.active_motion = None
        self._followed.release()

    def clean_up_all(self, failure: BaseException) -> None:
        """Clean up after every step that has not ended, and record each as broken by `failure`."""
        steps = dict(self._table.steps)
        with ExitStack() as leaving:
            for handle, step in reversed(steps.items()):
                leaving.callback(self._record_failure, step, failure)
                leaving.callback(self._clean_up_step, handle, step)
            leaving.callback(self._table.hold_conditions.clear)
            leaving.callback(self._table.steps.clear)
            leaving.callback(self.motions_ended, steps)
            if any(step.has_begun for step in steps.values()):
                leaving.callback(self._plant.stop)

    def _finish_step(self, handle: StepHandle) -> None:
        """Clean up after a step that moves nothing, record its end, and keep its result."""
        step = self._table.steps.pop(handle)
        self._table.hold_conditions.pop(handle, None)
        try:
            with ExitStack() as leaving:
                # Run from the last to the first, each even if another raises: what moves is stopped first.
                leaving.callback(self._clean_up_step, handle, step)
                if step.has_begun and not step.is_finished and not self._table.is_moving():
                    leaving.callback(self._plant.stop)
        except BaseException as failure:
            self._record_failure(step, failure)
            raise
        status, words, outputs, causes = step.result or SkillRunResult(StepStatus.STOPPED, "")
        # A skill's own words may hold what no file, database or terminal takes.
        reason = words.encode("utf-8", "backslashreplace").decode()
        outcome = {"time": self._plant.now(), "status": status.value, "reason": reason}
        event = "step-ended" if step.has_begun else "step-refused"
        gave = {} if outputs is None else {"outputs": dict(outputs)}
        why = {"causes": told_causes(causes)} if causes else {}
        self._audit.append(event, {**outcome, **why, **caller_details(step.caller), **gave})
        counts = step.decision_counts
        self._table.results[handle] = StepResult(
            status,
            reason,
            counts.allowed,
            counts.attenuated,
            counts.denied,
            dict(outputs or {}),
            step.is_transient and status is StepStatus.DENIED,
            causes,
        )

    def _clean_up_step(self, handle: StepHandle, step: ActiveStep) -> None:
        """Close the skill, tell the plant, release what the step holds: each even if another raises."""
        with ExitStack() as leaving:
            leaving.callback(self._resources.release, handle)
            if step.has_begun:
                leaving.callback(lambda: self._plant.skill_ended(step.name, finished=step.is_finished))
            leaving.callback(step.close_skill)

    def _record_failure(self, step: ActiveStep, failure: BaseException) -> None:
        """Record that the step broke off; a log that cannot be written is what is being raised already."""
        try:
            self._audit.append(
                "step-broken", {"reason": describe_exception(failure), **caller_details(step.caller)}
            )
        except AuditError as unwritten:
            failure.add_note(f"the end of the step is not in the record: {unwritten}")


class _CleanUpOnError:
    """A context manager that cleans up after every step where its block raises."""

    def __init__(self, clean_up_all: Callable[[BaseException], None]) -> None:
        self._clean_up_all = clean_up_all

    def __enter__(self) -> None:
        """Nothing is to be cleaned up yet."""

    def __exit__(self, _: object, failure: BaseException | None, __: object) -> None:
        """Clean up; what was raised goes on."""
        if failure is not None:
            self._clean_up_all(failure)
