"""Actions that did not begin: a skill may ask for another one instead, as it knows another way."""

from __future__ import annotations

from collections import Counter

from aeros.runtime.execution.step import ActiveStep
from aeros.runtime.ports import StepStatus
from aeros.runtime.skills.in_process_run import SkillRunResult


def offer_denial(step: ActiveStep, ending: SkillRunResult) -> SkillRunResult | None:
    """Leave an action that did not begin to the skill that asked for it, unless waiting may help.

    Args:
        step: the step; it receives the ending in `denials`, and no longer goes round an obstacle.
        ending: how it ends if its skill does not ask for another action: denied, or stopped by the plant.

    Returns:
        The ending; None if the skill may ask for another action in its next turn.
    """
    if ending.status is StepStatus.DENIED and step.is_transient:
        return ending
    step.denials.append(ending)
    step.pending_legs.clear()
    step.is_denial_open = True
    return None


def denied_ending(step: ActiveStep, complaint: str = "") -> SkillRunResult:
    """Make the ending of a step whose skill knows no other way.

    Args:
        step: the step.
        complaint: text to add to the reason.

    Returns:
        The last denial of the gate, or if there is none what the plant could not do; with the causes of all
        denials, so that a planner knows every way that was tried.
    """
    if not step.denials:
        return SkillRunResult(StepStatus.RAISED, "the skill raised `ActionDenied`, but nothing was denied")
    *earlier, last = sorted(step.denials, key=lambda one: one.status is StepStatus.DENIED)
    causes = [cause for one in (last, *earlier) for cause in one.causes]
    causes = [cause for place, cause in enumerate(causes) if cause not in causes[:place]]
    counts = Counter(_short_reason(one) for one in earlier)
    others = ", ".join(f"{count} by {name}" for name, count in counts.items())
    reason = f"{last.reason}; in other ways before: {others}" if earlier else last.reason
    return last._replace(reason=reason + complaint, causes=tuple(causes))


def _short_reason(ending: SkillRunResult) -> str:
    """Return the rules of a denial, or the first words of another reason."""
    return " and ".join(cause.rule for cause in ending.causes) or ending.reason.partition(":")[0]
