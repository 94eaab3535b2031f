"""How likely each declared outcome is, and modules with other probabilities and retries, to ask “what if”."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.model import Ecm, Outcome, Skill, Task


def outcome_probabilities(outcomes: Iterable[Outcome]) -> list[tuple[Outcome, Fraction]]:
    """Each outcome and its probability; those that declare none share equally what the others leave.

    Raises MisuseError where that is no distribution.
    """
    every = list(outcomes)
    declared = [outcome.probability for outcome in every if outcome.probability is not None]
    rest = 1 - sum(declared, Fraction(0))
    silent = len(every) - len(declared)
    if rest < 0 or any(share < 0 for share in declared) or (rest > 0 and not silent):
        raise MisuseError("the probabilities of a skill's outcomes are not a distribution")
    return [
        (outcome, rest / silent if outcome.probability is None else outcome.probability) for outcome in every
    ]


def with_probabilities(skill: Skill, probabilities: Mapping[str, Fraction]) -> Skill:
    """`skill` where the outcomes named have the probabilities `given`; the others share what is left.

    They share it in the proportions that they have, or equally where none of them can happen.
    Raises MisuseError where an outcome is not declared, or no distribution results.
    """
    unknown = probabilities.keys() - skill.outcomes.keys()
    if unknown:
        raise MisuseError(f"`{skill.id}` has no outcome `{min(unknown)}`")
    others = {outcome.id: share for outcome, share in outcome_probabilities(skill.outcomes.values())}
    others = {name: share for name, share in others.items() if name not in probabilities}
    rest, whole = 1 - sum(probabilities.values(), Fraction(0)), sum(others.values(), Fraction(0))
    scaled = {
        name: rest * share / whole if whole else rest / len(others) for name, share in others.items()
    } | dict(probabilities)
    outcomes = {name: replace(one, probability=scaled[name]) for name, one in skill.outcomes.items()}
    outcome_probabilities(outcomes.values())
    return replace(skill, outcomes=outcomes)


def with_skill_probabilities(ecm: Ecm, probabilities: Mapping[str, Mapping[str, Fraction]]) -> Ecm:
    """`ecm` with the probabilities `given`, by skill and outcome; see `with_probabilities`."""
    unknown = probabilities.keys() - ecm.skills.keys()
    if unknown:
        raise MisuseError(f"`{ecm.id}` has no skill `{min(unknown)}`")
    changed = {
        name: with_probabilities(ecm.skills[name], outcomes) for name, outcomes in probabilities.items()
    }
    return replace(ecm, skills={**ecm.skills, **changed})


def with_retries(task: Task, retries: Mapping[str, int]) -> Task:
    """`task` where the steps that run the skills named have the retry budgets `given`."""
    unknown = retries.keys() - {rule.skill for rule in task.rules}
    if unknown:
        raise MisuseError(f"no rule of `{task.id}` runs `{min(unknown)}`")
    rules = tuple(replace(rule, retry=retries.get(rule.skill, rule.retry)) for rule in task.rules)
    return replace(task, rules=rules)
