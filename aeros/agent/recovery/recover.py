"""What became of the steps that were under way when the agent ended, decided by record and measurement.

Of each step that a checkpoint says was begun:

- the runtime's record does not say so: it never began, and is begun as if for the first time;
- the record says how it ended: it is judged like any step that has ended, in the world measured now;
- the record has its beginning alone: it was interrupted.  Where an outcome is measured that was not before,
  that has happened.  Else, where what is measured excludes each success, or the skill is idempotent, the
  try is made again, if its precondition is still measured.  Where neither can be told, the plan goes no
  further, and the step is barred (`bars.py`).

A step in the record of which the checkpoint knows nothing is later than the checkpoint: then the plan is
not gone on with, the agent plans anew, and that step is barred too where it did not measurably fail.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from aeros.agent.execution.journal import Journal
from aeros.agent.execution.progress import PlanProgress, UnfinishedAttempt
from aeros.agent.execution.step_attempt import RAN_STATUSES, AttemptResult
from aeros.agent.execution.supervisor import assess_step
from aeros.agent.execution.uncertain_steps import UncertainSteps, possible_success
from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import AuditEvent, StepResult, StepStatus
from aeros.spec.model.model import Ecm, Skill

_INTERRUPTED_STATUSES: Final = (StepStatus.HALTED, StepStatus.CANCELLED)
"""Endings that were not its own: as for one that never ended."""


@dataclass
class RecordedStep:
    """A step as the runtime's record tells of it.

    sequence: the record of its beginning.
    result: None where the record has no end of it.
    """

    sequence: int
    module: str
    skill: str
    inputs: Mapping[str, Any]
    result: StepResult | None = None


@dataclass
class ProgressRecovery:
    """Brings the progress of a plan up to date; `is_known`: whether it is known where the plan was."""

    modules: Mapping[str, Ecm]
    world: WorldModel
    bars: UncertainSteps
    journal: Journal
    is_position_known: bool = field(default=True, init=False)

    def recover(
        self, progress: PlanProgress, events: Iterable[AuditEvent], records_at_checkpoint: int
    ) -> None:
        """Account for every step that `progress` or the record says was begun.

        known: how many records there were when `progress` was kept.
        """
        told = recorded_steps(events)
        for at, begun in progress.unfinished_attempts():
            one = next((one for one in told if self._matches(begun, one)), None)
            if one is None:
                progress.drop_attempt(at)
                self._record(f"{begun.module}.{begun.skill}", "it never began")
                continue
            told.remove(one)
            attempt = self._resolve_step(one, begun.before)
            if attempt is None:
                progress.drop_attempt(at)
            else:
                progress.finish_attempt(at, attempt)
        for one in told:
            if one.sequence >= records_at_checkpoint:
                self.is_position_known = False
                self._resolve_step(one, {})

    def _matches(self, begun: UnfinishedAttempt, told: RecordedStep) -> bool:
        module = self.modules.get(begun.module)
        return (
            module is not None
            and told.sequence >= begun.head.records
            and told.module == begun.module
            and told.skill in module.providers(begun.skill)
        )

    def _resolve_step(self, told: RecordedStep, before: Mapping[str, Any]) -> AttemptResult | None:
        """What came of it, None where nothing did; barred where it is not known to have succeeded."""
        name = f"{told.module}.{told.skill}"
        module = self.modules.get(told.module)
        skill = None if module is None else module.skills.get(told.skill)
        if skill is None:
            self._record(name, "it is not active any more")
            return AttemptResult(failed=True, reason=f"interrupted, and `{name}` is not active any more")
        attempt, how = self._classify(skill, told, before)
        if (attempt is None or attempt.failed) and not skill.idempotent:
            self.bars.add(told.module, told.skill, told.inputs)
        self._record(name, how)
        return attempt

    def _classify(
        self, skill: Skill, told: RecordedStep, before: Mapping[str, Any]
    ) -> tuple[AttemptResult | None, str]:
        if told.result is not None and told.result.status not in _INTERRUPTED_STATUSES:
            judgement = assess_step(told.module, skill, told.result, self.world, before)
            how = judgement.reason or f"outcome `{judgement.outcome}`"
            is_known = not (judgement.is_undeclared or judgement.is_unknown)
            repeatable = judgement.failed and told.result.status in RAN_STATUSES and is_known
            attempt = AttemptResult(
                judgement.failed, judgement.reason, repeatable, outputs=told.result.outputs
            )
            return attempt, f"it had ended: {how}"
        done = assess_step(told.module, skill, StepResult(StepStatus.FINISHED, ""), self.world)
        if done.outcome is not None and self._has_new_effect(skill, done.outcome, before):
            how = f"it was interrupted, and `{done.outcome}` is measured"
            return AttemptResult(done.failed, how if done.failed else "", is_retryable=done.failed), how
        if skill.idempotent:
            return None, "it was interrupted, and may be run twice"
        possible = possible_success(skill, self.world)
        if possible is None:
            return None, "it was interrupted, and no success of it is measured"
        why = f"it was interrupted, and what is measured does not tell whether `{possible}` happened"
        return AttemptResult(failed=True, reason=why), why

    def _has_new_effect(self, skill: Skill, outcome: str, before: Mapping[str, Any]) -> bool:
        """Whether anything of that outcome was measured otherwise before."""
        effects = skill.outcomes[outcome].effects
        return any(before.get(name) not in (None, to_json_value(value)) for name, value in effects.items())

    def _record(self, name: str, how: str) -> None:
        self.journal.record("step-accounted", f"{name} was under way: {how}", skill=name, how=how)


def recorded_steps(said: Iterable[AuditEvent]) -> list[RecordedStep]:
    """The steps that began, in order, each with its end where the record has one."""
    told: list[RecordedStep] = []
    for one in said:
        details = one.details
        match one.event:
            case "step-began":
                told.append(
                    RecordedStep(one.sequence, details["module"], details["skill"], details["inputs"])
                )
            case "step-ended":
                open_one = _find_open_step(told, details)
                if open_one is not None:
                    outputs = details.get("outputs", {})
                    status = StepStatus(details["status"])
                    open_one.result = StepResult(status, details["reason"], outputs=outputs)
    return told


def _find_open_step(told: Iterable[RecordedStep], details: Mapping[str, Any]) -> RecordedStep | None:
    """The step that an end is of."""
    of = (details["module"], details["skill"])
    return next((one for one in told if one.result is None and (one.module, one.skill) == of), None)
