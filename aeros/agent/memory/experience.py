"""Probabilities and durations of outcomes as they were experienced, in place of the declared ones.

Planners and predictions read probabilities and durations from the modules. Here a module gets those of the
agent's memory: with declared probability P and n weighed results, k of them this outcome,

    p = (k + PRIOR_TRIES * P) / (n + PRIOR_TRIES)

and the median of its latest durations, which are weighed, too. So few results change little. A result weighs
FORGETTING^m after m later tries of the same skill (`posterior.py`). A failure that no outcome declares counts
for the declared failures, in their proportions. Only results on the same plant and of the same code count.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import groupby
from typing import Final, NamedTuple

from aeros.agent.memory.posterior import FORGETTING, recent_median
from aeros.spec.closed_loop.giving_up import (
    PRIOR_TRIES,
    AgentBeliefs,
    failure_probability,
    is_beyond_chance,
)
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.model.ecm import Ecm, Skill, owner_of

MAX_EXPERIENCED_TRIES: Final = 100
"""Number of the latest results of each skill that count; an earlier one would weigh less than 1e-5."""

_PARTS: Final = 1000
"""Probabilities are multiples of one part in so many: exact predictions compute with them as fractions."""


class ExperiencedEnd(NamedTuple):
    """End of an episode that is evidence.

    Attributes:
        outcome: declared outcome that was measured; None if none was.
        failed: True if the step failed.
        seconds: time that it took, plant seconds.
    """

    outcome: str | None
    failed: bool
    seconds: float


ExperienceSource = Callable[[str, str, str], Sequence[ExperiencedEnd]]
"""Reader of a skill's ends, newest first, by module, skill, and digest of the code and parameters."""


class ExperiencedModules(Mapping[str, Ecm]):
    """Modules by id, each with what memory knows of its skills; read when a module is asked for.

    Args:
        modules: the active modules by id.
        source: reads the ends of a skill.
    """

    def __init__(self, modules: Mapping[str, Ecm], source: ExperienceSource) -> None:
        self._modules = modules
        self._source = source
        self._read: dict[str, Ecm] = {}

    def __getitem__(self, name: str) -> Ecm:
        if name not in self._read:
            self._read[name] = with_experience(self._modules[name], self._source)
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._modules)

    def __len__(self) -> int:
        return len(self._modules)


def with_experience(ecm: Ecm, source: ExperienceSource) -> Ecm:
    """Give the skills of a module the probabilities and durations that were experienced.

    Args:
        ecm: the module.
        source: reads the ends of a skill.

    Returns:
        A copy, in which also the skills that it may call of other modules are changed; the module itself if
        nothing is known of any.
    """
    changed = {name: _experienced(skill, ends) for name, skill, ends in _ends_of_skills(ecm, source) if ends}
    if not changed:
        return ecm
    foreign = {name: changed.get(name, skill) for name, skill in ecm.foreign.skills.items()}
    return replace(
        ecm,
        skills={name: changed.get(name, skill) for name, skill in ecm.skills.items()},
        foreign=replace(ecm.foreign, skills=foreign),
    )


def _ends_of_skills(
    ecm: Ecm, source: ExperienceSource
) -> Iterator[tuple[str, Skill, Sequence[ExperiencedEnd]]]:
    owners = {ecm.id: ecm, **ecm.foreign.owners}
    for name, skill in ecm.callable_skills.items():
        owner, own_name = owner_of(name, ecm.id)
        yield name, skill, source(owner, own_name, owners[owner].behaviour_digest)


def experienced_beliefs(ecm: Ecm, source: ExperienceSource) -> AgentBeliefs:
    """Make the beliefs of an agent with a memory about the skills that a module may call.

    Args:
        ecm: the module as declared.
        source: reads the ends of a skill.

    Returns:
        The outcomes that it expects.
    """
    ends_of = _ends_of_skills(ecm, source)
    return AgentBeliefs({name: expected_skill(skill, ends) for name, skill, ends in ends_of})


def expected_skill(skill: Skill, ends: Sequence[ExperiencedEnd]) -> Skill:
    """Give a skill the probabilities that an agent expects when it judges whether to give up.

    Failures in a row that chance does not explain may have had a cause, as may those since the last success.
    They are left out: a run that meets the same cause again is not to try longer for that.

    Args:
        skill: its declaration.
        ends: its ends, newest first.

    Returns:
        A copy with the experienced probabilities, with the declared ones as prior.
    """
    declared = failure_probability(skill)
    kept: list[ExperiencedEnd] = []
    for failed, group in groupby(ends, key=lambda end: end.failed):
        several = list(group)
        if not failed or (kept and not is_beyond_chance(len(several), [(declared, len(several))])):
            kept += several
    return _experienced(skill, kept) if kept else skill


def _experienced(skill: Skill, ends: Sequence[ExperiencedEnd]) -> Skill:
    shares = {one.id: float(share) for one, share in outcome_probabilities(skill.outcomes.values())}
    failures = {one.id: shares[one.id] for one in skill.outcomes.values() if one.failure}
    weights = {name: PRIOR_TRIES * share for name, share in shares.items()}
    weight = 1.0
    for end in ends:
        if end.outcome in weights:
            weights[end.outcome] += weight
        elif end.failed and failures:
            whole = sum(failures.values())
            for name, share in failures.items():
                weights[name] += weight * (share / whole if whole else 1 / len(failures))
        weight *= FORGETTING
    probabilities = _rounded(weights)
    aged = list(enumerate(ends))
    took = {name: [(age, end.seconds) for age, end in aged if end.outcome == name] for name in weights}
    outcomes = {
        name: replace(
            one,
            probability=probabilities[name],
            duration=Fraction(round(recent_median(took[name]) * 100), 100) if took[name] else one.duration,
        )
        for name, one in skill.outcomes.items()
    }
    return replace(skill, outcomes=outcomes)


def _rounded(weights: Mapping[str, float]) -> dict[str, Fraction]:
    """Return a distribution in proportion to `weights`; a positive weight stays positive."""
    whole = sum(weights.values())
    parts = {name: max(round(_PARTS * one / whole), int(one > 0)) for name, one in weights.items()}
    largest = max(parts, key=parts.__getitem__)
    parts[largest] += _PARTS - sum(parts.values())
    return {name: Fraction(one, _PARTS) for name, one in parts.items()}
