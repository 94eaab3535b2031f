"""Probabilities of declared outcomes, and variants of modules with other probabilities or retries.

The variants answer “what if” questions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction

from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.ecm import Ecm, Outcome, Skill, Task


def outcome_probabilities(outcomes: Iterable[Outcome]) -> list[tuple[Outcome, Fraction]]:
    """Compute the probability of each outcome; those that declare none share equally what the others leave.

    Args:
        outcomes: the outcomes of one skill.

    Returns:
        Each outcome with its probability, in the order given.

    Raises:
        MisuseError: the declared probabilities are not a distribution.
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
    """Change the probabilities of some outcomes of a skill.

    The other outcomes share the rest in the proportions that they have, or equally where none of them can
    happen.

    Args:
        skill: the skill to change.
        probabilities: new probabilities (0 to 1) by outcome.

    Returns:
        A copy of the skill with these probabilities.

    Raises:
        MisuseError: an outcome is not declared, or the result is not a distribution.
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
    """Change the probabilities of outcomes of a module's skills, each as `with_probabilities` does.

    Args:
        ecm: the module to change.
        probabilities: new probabilities (0 to 1) by skill and outcome.

    Returns:
        A copy of the module with these probabilities.

    Raises:
        MisuseError: a skill or outcome is not declared, or a result is not a distribution.
    """
    unknown = probabilities.keys() - ecm.skills.keys()
    if unknown:
        raise MisuseError(f"`{ecm.id}` has no skill `{min(unknown)}`")
    changed = {
        name: with_probabilities(ecm.skills[name], outcomes) for name, outcomes in probabilities.items()
    }
    return replace(ecm, skills={**ecm.skills, **changed})


def with_retries(task: Task, retries: Mapping[str, int]) -> Task:
    """Change the retry budgets of a task's steps.

    Args:
        task: the task to change.
        retries: new number of retries, by the skill or capability that a rule names.

    Returns:
        A copy of the task with these budgets.

    Raises:
        MisuseError: no rule of the task names one of the skills.
    """
    unknown = retries.keys() - {rule.skill for rule in task.rules}
    if unknown:
        raise MisuseError(f"no rule of `{task.id}` runs `{min(unknown)}`")
    rules = tuple(replace(rule, retry=retries.get(rule.skill, rule.retry)) for rule in task.rules)
    return replace(task, rules=rules)
