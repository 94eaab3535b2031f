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
from aeros.agent.execution.progress import Begun, Progress
from aeros.agent.execution.step_attempt import TRIED, Attempt
from aeros.agent.execution.supervisor import judge
from aeros.agent.execution.uncertain_steps import Bars, not_excluded
from aeros.agent.world.values import plain
from aeros.agent.world.world import World
from aeros.runtime.ports import Said, StepResult, StepStatus
from aeros.spec.model.model import Ecm, Skill

_INTERRUPTED: Final = (StepStatus.HALTED, StepStatus.CANCELLED)
"""Endings that were not its own: as for one that never ended."""


@dataclass
class Told:
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
class Recovery:
    """Brings the progress of a plan up to date; `is_known`: whether it is known where the plan was."""

    modules: Mapping[str, Ecm]
    world: World
    bars: Bars
    journal: Journal
    is_known: bool = field(default=True, init=False)

    def recover(self, progress: Progress, said: Iterable[Said], known: int) -> None:
        """Account for every step that `progress` or the record says was begun.

        known: how many records there were when `progress` was kept.
        """
        told = steps_told(said)
        for at, begun in progress.under_way():
            one = next((one for one in told if self._is_of(begun, one)), None)
            if one is None:
                progress.withdraw(at)
                self._tell(f"{begun.module}.{begun.skill}", "it never began")
                continue
            told.remove(one)
            attempt = self._account(one, begun.before)
            if attempt is None:
                progress.withdraw(at)
            else:
                progress.conclude(at, attempt)
        for one in told:
            if one.sequence >= known:
                self.is_known = False
                self._account(one, {})

    def _is_of(self, begun: Begun, told: Told) -> bool:
        module = self.modules.get(begun.module)
        return (
            module is not None
            and told.sequence >= begun.head.records
            and told.module == begun.module
            and told.skill in module.providers_of(begun.skill)
        )

    def _account(self, told: Told, before: Mapping[str, Any]) -> Attempt | None:
        """What came of it, None where nothing did; barred where it is not known to have succeeded."""
        name = f"{told.module}.{told.skill}"
        module = self.modules.get(told.module)
        skill = None if module is None else module.skills.get(told.skill)
        if skill is None:
            self._tell(name, "it is not active any more")
            return Attempt(failed=True, reason=f"interrupted, and `{name}` is not active any more")
        attempt, how = self._judged(skill, told, before)
        if (attempt is None or attempt.failed) and not skill.idempotent:
            self.bars.bar(told.module, told.skill, told.inputs)
        self._tell(name, how)
        return attempt

    def _judged(self, skill: Skill, told: Told, before: Mapping[str, Any]) -> tuple[Attempt | None, str]:
        if told.result is not None and told.result.status not in _INTERRUPTED:
            judgement = judge(told.module, skill, told.result, self.world, before)
            how = judgement.reason or f"outcome `{judgement.outcome}`"
            is_known = not (judgement.undeclared or judgement.unknown)
            repeatable = judgement.failed and told.result.status in TRIED and is_known
            attempt = Attempt(judgement.failed, judgement.reason, repeatable, outputs=told.result.outputs)
            return attempt, f"it had ended: {how}"
        done = judge(told.module, skill, StepResult(StepStatus.FINISHED, ""), self.world)
        if done.outcome is not None and self._is_news(skill, done.outcome, before):
            how = f"it was interrupted, and `{done.outcome}` is measured"
            return Attempt(done.failed, how if done.failed else "", repeatable=done.failed), how
        if skill.idempotent:
            return None, "it was interrupted, and may be run twice"
        possible = not_excluded(skill, self.world)
        if possible is None:
            return None, "it was interrupted, and no success of it is measured"
        why = f"it was interrupted, and what is measured does not tell whether `{possible}` happened"
        return Attempt(failed=True, reason=why), why

    def _is_news(self, skill: Skill, outcome: str, before: Mapping[str, Any]) -> bool:
        """Whether anything of that outcome was measured otherwise before."""
        effects = skill.outcomes[outcome].effects
        return any(before.get(name) not in (None, plain(value)) for name, value in effects.items())

    def _tell(self, name: str, how: str) -> None:
        self.journal.tell("step-accounted", f"{name} was under way: {how}", skill=name, how=how)


def steps_told(said: Iterable[Said]) -> list[Told]:
    """The steps that began, in order, each with its end where the record has one."""
    told: list[Told] = []
    for one in said:
        details = one.details
        match one.event:
            case "step-began":
                told.append(Told(one.sequence, details["module"], details["skill"], details["inputs"]))
            case "step-ended":
                open_one = _open(told, details)
                if open_one is not None:
                    outputs = details.get("outputs", {})
                    status = StepStatus(details["status"])
                    open_one.result = StepResult(status, details["reason"], outputs=outputs)
    return told


def _open(told: Iterable[Told], details: Mapping[str, Any]) -> Told | None:
    """The step that an end is of."""
    of = (details["module"], details["skill"])
    return next((one for one in told if one.result is None and (one.module, one.skill) == of), None)
