"""Actions that did not begin: a skill may ask for another one instead, as it knows another way."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Final

from aeros.runtime.execution.step import ActiveStep
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.in_process_run import SkillRunResult
from aeros.spec.model.cause import Cause

MAX_DENIALS: Final = 50
"""Denials for good in one step, after which it ends: no time passes between them, and each takes a decision
and perhaps a search for a way round."""


def offer_denial(step: ActiveStep, ending: SkillRunResult) -> SkillRunResult | None:
    """Leave an action that did not begin to the skill that asked for it, unless waiting may help.

    Args:
        step: the step; it receives the ending in `denials`, and no longer goes round an obstacle.
        ending: how it ends if its skill does not ask for another action: denied, or stopped by the plant.

    Returns:
        The ending; None if the skill may ask for another action in its next turn, as it has been denied less
        than `MAX_DENIALS` times.
    """
    if ending.status is StepStatus.DENIED and step.is_transient:
        return ending
    step.denials.append(ending)
    step.pending_legs.clear()
    if len(step.denials) >= MAX_DENIALS:
        return denied_ending(step, MAX_DENIALS, f"; {MAX_DENIALS} denials, the most in one step")
    step.is_denial_open = step.is_held_back = True
    return None


def denial_words(step: ActiveStep) -> str:
    """Return what a skill may know of its last denial.

    Measured values are left out: the rules may read what the module may not sense.

    Args:
        step: the step; it has been denied.

    Returns:
        Codes and rules, or the first words of the plant; never empty.
    """
    last = step.denials[-1]
    return " and ".join(f"{cause.code} {cause.rule}" for cause in last.causes) or _short_reason(last)


def denied_ending(step: ActiveStep, number: int, complaint: str = "") -> SkillRunResult:
    """Make the ending of a step whose skill knows no other way.

    Args:
        step: the step.
        number: how many of its last denials no other way made up for, as the skill says.
        complaint: text to add to the reason.

    Returns:
        The last denial of the gate, or if there is none what the plant could not do; with the causes of all
        of these denials, so that a planner knows every way that was tried.
    """
    if not step.denials:
        return SkillRunResult(StepStatus.RAISED, "the skill raised `ActionDenied`, but nothing was denied")
    number = max(1, min(number, len(step.denials)))
    *earlier, last = sorted(step.denials[-number:], key=lambda one: one.status is StepStatus.DENIED)
    counts = Counter(_short_reason(one) for one in earlier)
    others = ", ".join(f"{count} by {name}" for name, count in counts.items())
    reason = f"{last.reason}; in other ways before: {others}" if earlier else last.reason
    causes = _causes_of((last, *earlier))
    return last._replace(reason=reason + complaint, causes=causes, denials=number)


def finished_ending(step: ActiveStep, ending: SkillRunResult) -> SkillRunResult:
    """Add to the ending of a skill that ran to its end the causes of its denials, which it caught.

    A failure that they led to is then no bad luck of the skill.

    Args:
        step: the step.
        ending: how it ends.

    Returns:
        The ending, with these causes if the skill finished.
    """
    if ending.status is not StepStatus.FINISHED or not step.denials:
        return ending
    return ending._replace(causes=_causes_of(step.denials))


def _causes_of(denials: Iterable[SkillRunResult]) -> tuple[Cause, ...]:
    """Return the causes of denials, each once."""
    causes: list[Cause] = []
    for cause in (cause for one in denials for cause in one.causes):
        if cause not in causes:
            causes.append(cause)
    return tuple(causes)


def _short_reason(ending: SkillRunResult) -> str:
    """Return the rules of a denial, or the first words of another reason."""
    return " and ".join(cause.rule for cause in ending.causes) or ending.reason.partition(":")[0] or "denied"
