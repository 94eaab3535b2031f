"""Task-level checks on the measured world: before a step its conditions, after it its outcome.

It complements the gate, which decides actions: the supervisor decides whether the step makes sense
now and whether what was proved of the skill is what happened.  All functions are pure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import StepResult, StepStatus
from aeros.spec.expr import terms as t
from aeros.spec.expr.semantics import Environment
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause, file_and_line
from aeros.spec.model.model import ActionCondition, Outcome, Skill


@dataclass(frozen=True, slots=True)
class StepAssessment:
    """What a step came to.

    outcome: the declared outcome that was measured, or None.
    failed: whether the step counts as failed.
    undeclared: what was measured excludes every declared outcome, so an assumption of the install-time
        proof is broken.
    reason: why it failed; empty when it did not.
    causes: the same as data.
    unknown: no declared outcome was measured, and not each is excluded: a sensor is silent.
    """

    outcome: str | None
    failed: bool
    is_undeclared: bool
    reason: str
    causes: tuple[Cause, ...] = ()
    is_unknown: bool = False


def start_obstacle(module: str, skill: Skill, world: WorldModel, inputs: Environment) -> Cause | None:
    """Why `skill` must not start in `world`; None iff precondition and hold-condition are both measured."""
    name = f"{module}.{skill.id}"
    conditions = (("precondition", skill.precondition), ("hold", skill.hold_condition))
    for kind, clause in conditions:
        if clause is not None and world.evaluate(clause.term, inputs) is not True:
            return _unmet_cause(kind, name, clause, world, inputs)
    return None


def _unmet_cause(
    kind: str, name: str, clause: ActionCondition, world: WorldModel, inputs: Environment
) -> Cause:
    parts = world.unmet_parts(clause.term, inputs)
    return Cause(kind, name, clause.text, location=file_and_line(clause.span), shortfalls=parts)


def assess_step(
    module: str, skill: Skill, result: StepResult, after: WorldModel, before: Mapping[str, Any] | None = None
) -> StepAssessment:
    """Which declared outcome `after` shows, and whether the step failed.

    A step that did not run to its end has failed whatever is measured.  One that ended in a state
    no outcome declares has failed too; one that never started ends in no outcome at all.  A success is
    none while a failure that says more may be what happened, for all that is known.

    before: the predicates that were measured when it began, as JSON values.
    """
    halted = f"{result.status.value}: {result.reason}" if result.status is not StepStatus.FINISHED else ""
    name = f"{module}.{skill.id}"
    causes = result.causes
    if halted and not causes:
        causes = (Cause(result.status.value, name, result.reason),)
    if result.status is StepStatus.REFUSED:
        return StepAssessment(None, True, False, halted, causes)
    outcome = _measured_outcome(skill, after)
    doubt = _undetermined_outcome(skill, outcome, after)
    if doubt is not None:
        reason = "; ".join(filter(None, (halted, str(doubt))))
        part = UnmetBound(doubt.name, None, "known", True, reason=doubt.why)
        cause = Cause("unknown-outcome", name, str(doubt), shortfalls=(part,))
        return StepAssessment(None, True, False, reason, (*causes, cause), is_unknown=outcome is None)
    if outcome is None:
        if (
            result.status is StepStatus.HOLD_LOST
            and before is not None
            and _is_expected_after_hold_failure(skill, before, after)
        ):
            return StepAssessment(None, True, False, halted, causes)
        reason = "; ".join(filter(None, (halted, "what is measured is no declared outcome")))
        parts = tuple(_effect_mismatches(skill, after))
        cause = Cause("undeclared-outcome", name, "what is measured is no declared outcome", shortfalls=parts)
        return StepAssessment(None, True, True, reason, (*causes, cause))
    failed = halted != "" or outcome.failure
    if not failed:
        return StepAssessment(outcome.id, False, False, "")
    reason = halted or f"outcome `{outcome.id}`"
    return StepAssessment(outcome.id, True, False, reason, causes or (Cause("outcome", name, reason),))


def _measured_outcome(skill: Skill, world: WorldModel) -> Outcome | None:
    """The outcome all of whose effects are measured: the one that says most, then success over failure.

    So an outcome without effects, “nothing changed”, is what remains when no other is measured.
    """
    matching = [one for one in skill.outcomes.values() if _is_measured(one, world)]
    return max(matching, key=lambda one: (len(one.effects), not one.failure), default=None)


@dataclass(frozen=True, slots=True)
class _UndeterminedOutcome:
    """An outcome that may be what happened, and the quantity that would tell; `why` completes “`NAME` …”."""

    outcome: str
    name: str
    why: str

    def __str__(self) -> str:
        return f"outcome `{self.outcome}` is not excluded: `{self.name}` {self.why}"


def _undetermined_outcome(
    skill: Skill, outcome: Outcome | None, world: WorldModel
) -> _UndeterminedOutcome | None:
    """Why it is not known what happened: of a success, that a failure says more; of nothing, any outcome."""
    if outcome is not None and outcome.failure:
        return None
    for other in skill.outcomes.values():
        unknown = [name for name in other.effects if name not in world.known]
        excluded = any(world.known.get(name, value) != value for name, value in other.effects.items())
        matters = outcome is None or (other.failure and len(other.effects) > len(outcome.effects))
        if unknown and not excluded and matters:
            return _UndeterminedOutcome(other.id, unknown[0], world.unknown.get(unknown[0], "has no value"))
    return None


def _is_expected_after_hold_failure(skill: Skill, before: Mapping[str, Any], after: WorldModel) -> bool:
    """Whether what is measured after a broken hold-condition is what proofs provide for (`spec.holds`).

    That is: as before, or with the effects of an outcome, whatever the condition itself reads.
    """
    read = t.variables_of(skill.hold_condition.term) if skill.hold_condition is not None else {}
    outcomes = [{}, *(one.effects for one in skill.outcomes.values() if one.probability != 0)]
    names = {name for effects in outcomes for name in effects} - read.keys()
    return any(
        all(
            name not in after.known
            or to_json_value(after.known[name])
            == (to_json_value(effects[name]) if name in effects else before.get(name))
            for name in names
        )
        for effects in outcomes
    )


def _effect_mismatches(skill: Skill, world: WorldModel) -> list[UnmetBound]:
    """Of each declared outcome, the first effect that is measured otherwise."""
    found: dict[UnmetBound, None] = {}
    for outcome in skill.outcomes.values():
        for name, value in outcome.effects.items():
            if name in world.known and world.known[name] != value:
                found[
                    UnmetBound(
                        name,
                        to_json_value(world.known[name]),
                        f"`{outcome.id}` declares",
                        to_json_value(value),
                    )
                ] = None
                break
    return list(found)


def _is_measured(outcome: Outcome, world: WorldModel) -> bool:
    return all(name in world.known and world.known[name] == value for name, value in outcome.effects.items())
