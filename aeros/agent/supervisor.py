"""Task-level checks on the measured world: before a step its precondition, after it its outcome.

It complements the gate, which decides actions: the supervisor decides whether the step makes sense
now and whether what was proved of the skill is what happened.  Both functions are pure.
"""

from __future__ import annotations

from dataclasses import dataclass

from aeros.agent.world import World
from aeros.runtime.ports import StepResult, StepStatus
from aeros.spec.expr.semantics import Environment
from aeros.spec.model import Outcome, Skill


@dataclass(frozen=True, slots=True)
class Judgement:
    """What a step came to.

    outcome: the declared outcome that was measured, or None.
    failed: whether the step counts as failed.
    undeclared: no declared outcome was measured, so an assumption of the install-time proof is broken.
    reason: why it failed; empty when it did not.
    """

    outcome: str | None
    failed: bool
    undeclared: bool
    reason: str


def precondition_problem(skill: Skill, world: World, inputs: Environment) -> str | None:
    """Why `skill` must not start in `world`; None iff its precondition is measured as true."""
    if skill.precondition is None:
        return None
    condition = skill.precondition.term
    if world.evaluate(condition, inputs) is True:
        return None
    return f"its precondition `{skill.precondition.text}` is not measured: {world.why_not(condition, inputs)}"


def judge(skill: Skill, result: StepResult, after: World) -> Judgement:
    """Which declared outcome `after` shows, and whether the step failed.

    A step that did not run to its end has failed whatever is measured.  One that ended in a state
    no outcome declares has failed too; one that never started ends in no outcome at all.  A success is
    none while a failure that says more may be what happened, for all that is known.
    """
    halted = f"{result.status.value}: {result.reason}" if result.status is not StepStatus.FINISHED else ""
    if result.status is StepStatus.REFUSED:
        return Judgement(None, failed=True, undeclared=False, reason=halted)
    outcome = _measured_outcome(skill, after)
    doubt = None if outcome is None else _doubt(skill, outcome, after)
    if doubt is not None:
        reasons = filter(None, (halted, doubt))
        return Judgement(None, failed=True, undeclared=False, reason="; ".join(reasons))
    if outcome is None:
        reasons = filter(None, (halted, "what is measured is no declared outcome"))
        return Judgement(None, failed=True, undeclared=True, reason="; ".join(reasons))
    failed = halted != "" or outcome.failure
    reason = halted or f"outcome `{outcome.id}`"
    return Judgement(outcome.id, failed, undeclared=False, reason=reason if failed else "")


def _measured_outcome(skill: Skill, world: World) -> Outcome | None:
    """The outcome all of whose effects are measured: the one that says most, then success over failure.

    So an outcome without effects, “nothing changed”, is what remains when no other is measured.
    """
    matching = [one for one in skill.outcomes.values() if _is_measured(one, world)]
    return max(matching, key=lambda one: (len(one.effects), not one.failure), default=None)


def _doubt(skill: Skill, outcome: Outcome, world: World) -> str | None:
    """Why it is not known that `outcome`, a success, is what happened; None where it is, or is a failure."""
    if outcome.failure:
        return None
    for other in skill.outcomes.values():
        unknown = [name for name in other.effects if name not in world.known]
        excluded = any(world.known.get(name, value) != value for name, value in other.effects.items())
        if other.failure and unknown and not excluded and len(other.effects) > len(outcome.effects):
            why = world.unknown.get(unknown[0], "has no value")
            return f"outcome `{other.id}` is not excluded: `{unknown[0]}` {why}"
    return None


def _is_measured(outcome: Outcome, world: World) -> bool:
    return all(name in world.known and world.known[name] == value for name, value in outcome.effects.items())
