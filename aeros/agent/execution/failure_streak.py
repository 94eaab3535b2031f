"""Evidence that declared failures are no chance: nothing has succeeded since, and chance does not explain it.

A *streak* is the declared failures since the last success of any step, all in the same measured state. If
skill k failed n_k times in it, and had s_k successes and f_k failures in this context before, the probability
of the streak by chance is

    L = prod over k of prod for i < n_k of (f_k + b_k + i) / (s_k + f_k + a_k + b_k + i)

(Beta-binomial). Where one skill alone failed, its prior is uniform, a = b = 1: a new skill may fail often,
and nobody knows. Where several did, such as a look and the search that is to help, each declared probability
of failure q counts as `PRIOR_TRIES` results: a = 4 (1 - q), b = 4 q.

With L below `LEAST_CHANCE`, after `LEAST_FAILURES` of the same step and `LEAST_SECONDS`, trying again is of
no use: another provider may be, or the run ends. Chance does this to at most one streak of a thousand, and
`aeros predict` leaves it out. A resumed run begins a new streak.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from aeros.agent.memory.evidence import SkillId
from aeros.agent.memory.experience import PRIOR_TRIES
from aeros.agent.memory.posterior import SuccessRecord
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.model.ecm import Skill

LEAST_CHANCE: Final = 1e-3
"""Probability by chance below which a streak has another cause."""

LEAST_FAILURES: Final = 3
"""Failures of the step in the streak before it can be given up: twice may be a bad look."""

LEAST_SECONDS: Final = 15.0
"""Plant time that a streak lasts before it can be given up, s: until then little is lost by trying."""


@dataclass(slots=True)
class _FailedSkill:
    """A skill in a streak, with its record before the streak and its declared chance of failure."""

    record: SuccessRecord
    declared_failure: float
    times: int = 0


@dataclass(slots=True)
class FailureStreak:
    """Declared failures since the last success, in one measured state.

    Attributes:
        state: predicates as measured before the first of them.
        began: plant time at which the first of them started, s.
    """

    state: Mapping[str, Any] | None = None
    began: float = 0.0
    _failed: dict[SkillId, _FailedSkill] = field(default_factory=dict)

    def reset(self) -> None:
        """Begin a new streak, as a step has succeeded or another provider is tried."""
        self.state = None
        self._failed.clear()

    def add(
        self, skill_id: SkillId, skill: Skill, state: Mapping[str, Any], started: float, now: SuccessRecord
    ) -> None:
        """Note a declared failure.

        Args:
            skill_id: module and id of the skill.
            skill: its declaration.
            state: predicates as measured before the step.
            started: plant time at which the step started, s.
            now: its successes and failures in this context, this failure included.
        """
        if self.state != state:
            self.reset()
            self.state, self.began = dict(state), started
        if skill_id not in self._failed:
            before = SuccessRecord(now.successes, max(0, now.failures - 1))
            self._failed[skill_id] = _FailedSkill(before, _declared_failure(skill))
        self._failed[skill_id].times += 1

    def probability_by_chance(self) -> float:
        """Compute L.

        Returns:
            A probability in [0, 1]; 1 of an empty streak.
        """
        probability = 1.0
        is_alone = len(self._failed) == 1
        for one in self._failed.values():
            failure = 0.5 if is_alone else one.declared_failure
            weight = 2.0 if is_alone else float(PRIOR_TRIES)
            failures = one.record.failures + weight * failure
            tries = one.record.successes + one.record.failures + weight
            for further in range(one.times):
                probability *= (failures + further) / (tries + further)
        return probability

    def reason_to_stop(self, skill_id: SkillId, now: float) -> str:
        """Say why another try of a skill is no use.

        Args:
            skill_id: module and id of the skill that has just failed.
            now: plant time, s.

        Returns:
            The reason in words; empty if it may be worth another try.
        """
        one = self._failed.get(skill_id)
        if one is None or one.times < LEAST_FAILURES or now - self.began < LEAST_SECONDS:
            return ""
        if self.probability_by_chance() >= LEAST_CHANCE:
            return ""
        others = ", ".join(
            f"`{module}.{skill}` {other.times} times"
            for (module, skill), other in self._failed.items()
            if (module, skill) != skill_id
        )
        before = f", where it had succeeded in {one.record} tries before" if one.record.successes else ""
        rest = f"; {others} did not help" if others else ""
        times = f"{one.times} times in the same measured state in {now - self.began:.0f} s"
        return f"it failed {times}{before}{rest}"


def _declared_failure(skill: Skill) -> float:
    shares = outcome_probabilities(skill.outcomes.values())
    return float(sum(share for outcome, share in shares if outcome.failure))
