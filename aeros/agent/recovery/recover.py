"""Recovery of the steps that were running when the agent ended, from the audit record and measurements.

For each step that a checkpoint says was started:

- the runtime's record has no start of it: it never started, and is started as if for the first time;
- the record has its end: it is assessed like any step that has ended, in the world measured now;
- the record has only its start: it was interrupted. If an outcome is measured that was not measured before,
  that outcome happened. Otherwise, if the measurements exclude each success, or the skill is idempotent, the
  attempt is repeated if its precondition is still measured as true. If neither can be decided, the plan goes
  no further, and the step is barred (`uncertain_steps.py`).

A step in the record that the checkpoint does not know is later than the checkpoint. Then the plan is not
continued and the agent plans anew. That step is barred too, unless it measurably failed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from aeros.agent.execution.attempt import RAN_STATUSES, AttemptResult
from aeros.agent.execution.journal import Journal
from aeros.agent.execution.progress import PlanProgress, UnfinishedAttempt
from aeros.agent.execution.supervisor import assess_step
from aeros.agent.execution.uncertain_steps import UncertainSteps, possible_success
from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import AuditEvent, StepResult, StepStatus
from aeros.spec.expr.effects import Increment
from aeros.spec.model.ecm import Ecm, Skill, owner_of

_INTERRUPTED_STATUSES: Final = (StepStatus.HALTED, StepStatus.CANCELLED)
"""Endings that were not its own: as for one that never ended."""


@dataclass
class RecordedStep:
    """A step in the runtime's audit record.

    Attributes:
        sequence: number of the record of its start.
        module: id of the module.
        skill: id of the skill.
        inputs: inputs by name (SI).
        result: its result; None if the record has no end of it.
    """

    sequence: int
    module: str
    skill: str
    inputs: Mapping[str, Any]
    result: StepResult | None = None


@dataclass
class ProgressRecovery:
    """Recovery of a plan's progress.

    Attributes:
        modules: active modules by id.
        world: the world as measured after the restart.
        bars: steps that must not run again, as their effects are unknown; extended by `recover`.
        journal: receives a note about each step that is accounted for.
        is_position_known: False once it is unknown where in the plan the run was.
    """

    modules: Mapping[str, Ecm]
    world: WorldModel
    bars: UncertainSteps
    journal: Journal
    is_position_known: bool = field(default=True, init=False)

    def recover(
        self, progress: PlanProgress, events: Iterable[AuditEvent], records_at_checkpoint: int
    ) -> None:
        """Account for every step that was started according to `progress` or the record.

        Args:
            progress: progress of the plan, which is updated.
            events: events of the runtime since the earliest unfinished attempt.
            records_at_checkpoint: number of audit records when the checkpoint was made.
        """
        recorded = recorded_steps(events)
        for at, unfinished in progress.unfinished_attempts():
            one = next((one for one in recorded if self._matches(unfinished, one)), None)
            if one is None:
                progress.drop_attempt(at)
                self._record(f"{unfinished.module}.{unfinished.skill}", "it never began")
                continue
            recorded.remove(one)
            attempt = self._resolve_step(one, unfinished.before)
            if attempt is None:
                progress.drop_attempt(at)
            else:
                progress.finish_attempt(at, attempt)
        for one in recorded:
            if one.sequence >= records_at_checkpoint:
                self.is_position_known = False
                self._resolve_step(one, {})

    def _matches(self, unfinished: UnfinishedAttempt, step: RecordedStep) -> bool:
        module = self.modules.get(unfinished.module)
        return (
            module is not None
            and step.sequence >= unfinished.head.records
            and (step.module, step.skill)
            in {owner_of(name, module.id) for name in module.providers(unfinished.skill)}
        )

    def _resolve_step(self, step: RecordedStep, before: Mapping[str, Any]) -> AttemptResult | None:
        """Return the result of the step, None if it had none; bar it unless it is known to have succeeded."""
        name = f"{step.module}.{step.skill}"
        module = self.modules.get(step.module)
        skill = None if module is None else module.skills.get(step.skill)
        if skill is None:
            self._record(name, "it is no longer active")
            return AttemptResult(failed=True, reason=f"interrupted, and `{name}` is no longer active")
        attempt, how = self._classify(skill, step, before)
        if (attempt is None or attempt.failed) and not skill.idempotent:
            self.bars.add(step.module, step.skill, step.inputs)
        self._record(name, how)
        return attempt

    def _classify(
        self, skill: Skill, step: RecordedStep, before: Mapping[str, Any]
    ) -> tuple[AttemptResult | None, str]:
        if step.result is not None and step.result.status not in _INTERRUPTED_STATUSES:
            judgement = assess_step(step.module, skill, step.result, self.world, before)
            how = judgement.reason or f"outcome `{judgement.outcome}`"
            is_known = not (judgement.is_undeclared or judgement.is_unknown)
            repeatable = judgement.failed and step.result.status in RAN_STATUSES and is_known
            attempt = AttemptResult(
                judgement.failed, judgement.reason, repeatable, outputs=step.result.outputs
            )
            return attempt, f"it had ended: {how}"
        done = assess_step(step.module, skill, StepResult(StepStatus.FINISHED, ""), self.world, before)
        if done.outcome is not None and self._has_new_effect(skill, done.outcome, before):
            how = f"it was interrupted, and `{done.outcome}` is measured"
            return AttemptResult(done.failed, how if done.failed else "", is_retryable=done.failed), how
        if skill.idempotent:
            return None, "it was interrupted, and may be repeated"
        possible = possible_success(skill, self.world, before)
        if possible is None:
            return None, "it was interrupted, and the measurements exclude its successes"
        why = f"it was interrupted, and the measurements do not show if `{possible}` happened"
        return AttemptResult(failed=True, reason=why), why

    def _has_new_effect(self, skill: Skill, outcome: str, before: Mapping[str, Any]) -> bool:
        """Return True if an effect of that outcome was measured otherwise before the step."""
        effects = skill.outcomes[outcome].effects
        return any(
            isinstance(effect, Increment) or before.get(name) not in (None, to_json_value(effect))
            for name, effect in effects.items()
        )

    def _record(self, name: str, how: str) -> None:
        self.journal.record("interrupted-step-resolved", f"{name} was under way: {how}", skill=name, how=how)


def recorded_steps(events: Iterable[AuditEvent]) -> list[RecordedStep]:
    """Read the steps that were started from events of the runtime.

    Args:
        events: events in the order of the record.

    Returns:
        The steps in the order of their starts, each with its result if the record has its end.
    """
    steps: list[RecordedStep] = []
    for one in events:
        details = one.details
        match one.event:
            case "step-began":
                steps.append(
                    RecordedStep(one.sequence, details["module"], details["skill"], details["inputs"])
                )
            case "step-ended":
                open_one = _find_open_step(steps, details)
                if open_one is not None:
                    outputs = details.get("outputs", {})
                    status = StepStatus(details["status"])
                    open_one.result = StepResult(status, details["reason"], outputs=outputs)
    return steps


def _find_open_step(steps: Iterable[RecordedStep], details: Mapping[str, Any]) -> RecordedStep | None:
    """Find the step that an end belongs to."""
    of = (details["module"], details["skill"])
    return next((one for one in steps if one.result is None and (one.module, one.skill) == of), None)
