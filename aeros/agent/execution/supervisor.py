"""Checks of a task's steps on the measured world: conditions before a step, the outcome after it.

They complement the gate, which decides actions. The supervisor decides if the step can start now, and if the
skill did what was assumed in its proofs. All functions are pure.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import StepResult, StepStatus
from aeros.spec.expr import terms as t
from aeros.spec.expr.effects import Increment, state_after
from aeros.spec.expr.semantics import Environment
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.expr.unparse import unparse
from aeros.spec.model.cause import Cause, file_and_line
from aeros.spec.model.composition import Composition
from aeros.spec.model.ecm import VERDICT_VALUE, ActionCondition, Outcome, Skill


@dataclass(frozen=True, slots=True)
class StepAssessment:
    """The assessment of a step that has ended.

    Attributes:
        outcome: declared outcome that was measured, or None.
        failed: True if the step counts as failed.
        is_undeclared: the measured values exclude every declared outcome, so an assumption of the
            install-time proof is broken.
        reason: reason of the failure; empty if it did not fail.
        causes: the same as data.
        is_unknown: no declared outcome was measured, and not all are excluded, because a sensor is silent.
        is_verdict: the skill ended by itself in an outcome that says that no other try can succeed.
    """

    outcome: str | None
    failed: bool
    is_undeclared: bool
    reason: str
    causes: tuple[Cause, ...] = ()
    is_unknown: bool = False
    is_verdict: bool = False


def start_obstacle(module: str, skill: Skill, world: WorldModel, inputs: Environment) -> Cause | None:
    """Return the condition that keeps `skill` from starting in `world`.

    Args:
        module: id of the module.
        skill: skill to start.
        world: current state.
        inputs: exact inputs (SI) by `inputs.NAME`.

    Returns:
        The unmet condition as a cause; None iff precondition and hold-condition are both measured as true.
    """
    name = f"{module}.{skill.id}"
    conditions = (("precondition", skill.precondition), ("hold", skill.hold_condition))
    for kind, clause in conditions:
        if clause is not None and world.evaluate(clause.term, inputs) is not True:
            return _unmet_cause(kind, name, clause, world, inputs)
    return None


def composition_obstacle(name: str, composition: Composition, world: WorldModel) -> Cause | None:
    """Return the condition that keeps a composition from starting in `world`.

    Args:
        name: name of the composition for messages.
        composition: the composition.
        world: current state.

    Returns:
        Its unmet precondition as a cause; None iff it is measured as true.
    """
    term, span = composition.precondition, composition.precondition_span
    if world.evaluate(term) is True:
        return None
    text = unparse(term) if span is None else span.text
    place = "" if span is None else file_and_line(span)
    return Cause("precondition", name, text, location=place, shortfalls=world.unmet_parts(term, {}))


def _unmet_cause(
    kind: str, name: str, clause: ActionCondition, world: WorldModel, inputs: Environment
) -> Cause:
    parts = world.unmet_parts(clause.term, inputs)
    return Cause(kind, name, clause.text, location=file_and_line(clause.span), shortfalls=parts)


def assess_step(
    module: str,
    skill: Skill,
    result: StepResult,
    after: WorldModel,
    before: Mapping[str, Any] | None = None,
    held: Sequence[ActionCondition] = (),
) -> StepAssessment:
    """Find the declared outcome that `after` shows, and decide if the step failed.

    A step that did not run to its end has failed, whatever is measured. A step that ended in a state which no
    outcome declares has failed too. A step that never started has no outcome. A success does not count while
    unknown values leave a failure with more effects possible.

    Args:
        module: id of the module.
        skill: skill that was run.
        result: result that the runtime gives.
        after: world measured after the step.
        before: predicates measured when it started, as JSON values; None if unknown.
        held: conditions of the parts of a plan around the step.

    Returns:
        The assessment, with the causes of a failure.
    """
    halted = f"{result.status.value}: {result.reason}" if result.status is not StepStatus.FINISHED else ""
    name = f"{module}.{skill.id}"
    causes = result.causes
    if halted and not causes:
        causes = (Cause(result.status.value, name, result.reason),)
    if result.status is StepStatus.REFUSED:
        return StepAssessment(None, True, False, halted, causes)
    outcome = _measured_outcome(skill, after, before)
    doubt = _undetermined_outcome(skill, outcome, after, before)
    if doubt is not None:
        reason = "; ".join(filter(None, (halted, str(doubt))))
        part = UnmetBound(doubt.name, None, "known", True, reason=doubt.why)
        cause = Cause("unknown-outcome", name, str(doubt), shortfalls=(part,))
        return StepAssessment(None, True, False, reason, (*causes, cause), is_unknown=outcome is None)
    if outcome is None:
        if (
            result.status in (StepStatus.HOLD_LOST, StepStatus.CANCELLED)
            and before is not None
            and _is_expected_after_halt(skill, before, after, held)
        ):
            return StepAssessment(None, True, False, halted, causes)
        reason = "; ".join(filter(None, (halted, "the measured state matches no declared outcome")))
        parts = tuple(_effect_mismatches(skill, after, before))
        cause = Cause(
            "undeclared-outcome", name, "the measured state matches no declared outcome", shortfalls=parts
        )
        return StepAssessment(None, True, True, reason, (*causes, cause))
    failed = halted != "" or outcome.failure
    if not failed:
        return StepAssessment(outcome.id, False, False, "")
    is_verdict = not halted and outcome.verdict != ""
    reason = halted or (_filled_in(outcome.verdict, after) if is_verdict else f"outcome `{outcome.id}`")
    # A skill that caught denials and then failed as declared had a reason besides bad luck.
    causes = causes if halted else (Cause("outcome", name, reason), *causes)
    return StepAssessment(outcome.id, True, False, reason, causes, is_verdict=is_verdict)


def _filled_in(verdict: str, world: WorldModel) -> str:
    """Put measured values into a verdict, in SI units; one that is unknown has no unit."""

    def fill(field: re.Match[str]) -> str:
        name, _, unit = field[1].partition(" ")
        text = _short_text(to_json_value(world.known.get(name)))
        return f"{text} {unit}" if unit and name in world.known else text

    return VERDICT_VALUE.sub(fill, verdict)


def _short_text(value: Any) -> str:
    if isinstance(value, list):
        return f"({', '.join(map(_short_text, value))})"
    if isinstance(value, float):
        return f"{value:.0f}" if value.is_integer() else f"{value:.2f}"
    return "unknown" if value is None else str(value).lower()


def _measured_outcome(skill: Skill, world: WorldModel, before: Mapping[str, Any] | None) -> Outcome | None:
    """Return the measured outcome with the most effects; of equals, a success before a failure.

    So an outcome without effects (nothing changed) is returned only if no other is measured.
    """
    matching = [one for one in skill.outcomes.values() if is_measured(one, world, before)]
    return max(matching, key=lambda one: (one.effect_count, not one.failure), default=None)


@dataclass(frozen=True, slots=True)
class _UndeterminedOutcome:
    """An outcome that is not excluded, and the variable that would decide it; `why` completes “`NAME` …”."""

    outcome: str
    name: str
    why: str

    def __str__(self) -> str:
        return f"outcome `{self.outcome}` cannot be excluded: `{self.name}` {self.why}"


def _undetermined_outcome(
    skill: Skill, outcome: Outcome | None, world: WorldModel, before: Mapping[str, Any] | None
) -> _UndeterminedOutcome | None:
    """Return an outcome that unknown values leave possible and that would change the assessment.

    After a success that is a failure with more effects; if no outcome is measured, it is any outcome.
    """
    if outcome is not None and outcome.failure:
        return None
    others = skill.outcomes.values() if outcome is None else skill.failures_with_more_effects(outcome)
    for other in others:
        if is_excluded(other, world, before):
            continue
        changed = (*other.effects, *(one.variable for one in other.ranges))
        unknown = next((name for name in changed if name not in world.known), None)
        if unknown is not None:
            return _UndeterminedOutcome(other.id, unknown, world.unknown.get(unknown, "has no value"))
        uncounted = next((name for name in changed if not _is_count_known(other, name, before)), None)
        if uncounted is not None:
            return _UndeterminedOutcome(other.id, uncounted, "was not known before")
    return None


def _is_expected_after_halt(
    skill: Skill, before: Mapping[str, Any], after: WorldModel, held: Sequence[ActionCondition]
) -> bool:
    """Return True if the state after a halt is one that the proofs cover (`spec.model.hold_conditions`).

    That is the state before, or one with the effects of an outcome; what a condition reads that was held is
    free.
    """
    conditions = [one for one in (skill.hold_condition, *held) if one is not None]
    read = {name: one for clause in conditions for name, one in t.variables_of(clause.term).items()}
    outcomes: list[Mapping[str, Any]] = [{}]
    outcomes += [state_after(one.effects, before) for one in skill.outcomes.values() if one.probability != 0]
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


def _effect_mismatches(skill: Skill, world: WorldModel, before: Mapping[str, Any] | None) -> list[UnmetBound]:
    """Return, for each declared outcome, the first effect that is measured otherwise."""
    found: dict[UnmetBound, None] = {}
    for outcome in skill.outcomes.values():
        declares = f"`{outcome.id}` declares"
        for name, value in state_after(outcome.effects, before or {}).items():
            if value is not None and name in world.known and world.known[name] != value:
                found[UnmetBound(name, to_json_value(world.known[name]), declares, to_json_value(value))] = (
                    None
                )
                break
        else:
            for one in outcome.ranges:
                if one.variable in world.known and not one.contains(world.known[one.variable]):
                    value = to_json_value(one.number_of(world.known[one.variable]))
                    found[UnmetBound(one.name, value, declares, str(one))] = None
                    break
    return list(found)


def is_excluded(outcome: Outcome, world: WorldModel, before: Mapping[str, Any] | None) -> bool:
    """Say if the measurements exclude an outcome.

    Args:
        outcome: the outcome.
        world: world measured after the step.
        before: predicates measured when it started, as JSON values; None if unknown.

    Returns:
        True if one of its effects or ranges is known to be missing.
    """
    after = state_after(outcome.effects, before or {})
    return any(
        value is not None and world.known.get(name, value) != value for name, value in after.items()
    ) or any(
        one.variable in world.known and not one.contains(world.known[one.variable]) for one in outcome.ranges
    )


def _is_count_known(outcome: Outcome, name: str, before: Mapping[str, Any] | None) -> bool:
    is_increment = isinstance(outcome.effects.get(name), Increment)
    return not is_increment or (before or {}).get(name) is not None


def is_measured(outcome: Outcome, world: WorldModel, before: Mapping[str, Any] | None) -> bool:
    """Say if all effects and ranges of an outcome are measured.

    Args:
        outcome: the outcome.
        world: world measured after the step.
        before: predicates measured when it started, as JSON values; None if unknown.

    Returns:
        False also if one of them is unknown.
    """
    after = state_after(outcome.effects, before or {})
    return all(
        value is not None and name in world.known and world.known[name] == value
        for name, value in after.items()
    ) and all(
        one.variable in world.known and one.contains(world.known[one.variable]) for one in outcome.ranges
    )
