"""Evidence that declared failures are no chance: nothing has changed since, and chance does not explain it.

A *streak* is the declared failures of skills in one measured state, since each of them last succeeded. If
skill k failed n_k times in it, and had s_k successes and f_k failures in this context before, the probability
of the streak by chance is

    L = prod over k of prod for i < n_k of (f_k + b_k + i) / (s_k + f_k + a_k + b_k + i)

(Beta-binomial). The declared probability q of failure counts as `PRIOR_TRIES` results: a = 4 (1 - q) and
b = 4 q. Failures after which no quantity of the module had changed, each within its uncertainty, are the same
attempt at the same thing, and count for all skills together. Of other failures in the state those of one
skill count, as some may have brought the task on, such as one of many pieces put away.

With either L below `LEAST_CHANCE`, after `LEAST_FAILURES` of the same step and `LEAST_SECONDS`, trying again
is of no use: another provider may be, or the run ends. As far as record and declarations are right, chance
does this to about one streak of a thousand at most. `aeros predict` leaves it out. A resumed run begins a
new streak.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import prod
from typing import Any, Final

from aeros.agent.memory.evidence import SkillId
from aeros.agent.memory.experience import PRIOR_TRIES
from aeros.agent.memory.posterior import SuccessRecord
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.model.ecm import Skill
from aeros.spec.model.variables import Declared

LEAST_CHANCE: Final = 1e-3
"""Probability by chance below which a streak has another cause."""

LEAST_FAILURES: Final = 3
"""Failures of the step in the streak before it can be given up: twice may be a bad look."""

LEAST_SECONDS: Final = 15.0
"""Plant time that a streak lasts before it can be given up, s: until then little is lost by trying."""

Quantities = Mapping[str, tuple[float, ...]]
"""Measured numbers by the name of their variable, each in units of its uncertainty."""


def quantities_of(known: Mapping[str, Any], declared: Mapping[str, Declared]) -> Quantities:
    """Collect the quantities that show if a step has changed anything.

    Args:
        known: measured values by name, SI.
        declared: variables by name.

    Returns:
        Those with a declared uncertainty, in units of it.
    """
    found: dict[str, tuple[float, ...]] = {}
    for name, variable in declared.items():
        if variable.uncertainty and name in known:
            value = known[name]
            parts = value if isinstance(value, tuple) else (value,)
            found[name] = tuple(float(part) / float(variable.uncertainty) for part in parts)
    return found


@dataclass(slots=True)
class _FailedSkill:
    """A skill in a streak, with its record before the streak and its declared chance of failure.

    `still` counts its failures since a quantity last changed.
    """

    record: SuccessRecord
    declared_failure: float
    times: int = 0
    still: int = 0

    def probability(self, times: int) -> float:
        failures = self.record.failures + PRIOR_TRIES * self.declared_failure
        tries = self.record.successes + self.record.failures + PRIOR_TRIES
        return prod((failures + further) / (tries + further) for further in range(times))


@dataclass(slots=True)
class _Streak:
    """The failures in one state: when they began, and since when no quantity has changed, plant time, s."""

    began: float
    still_since: float
    quantities: Quantities
    failed: dict[SkillId, _FailedSkill] = field(default_factory=dict)

    def note_quantities(self, quantities: Quantities, started: float) -> None:
        if any(
            max(abs(a - b) for a, b in zip(one, self.quantities[name], strict=True)) > 1.0
            for name, one in quantities.items()
            if name in self.quantities
        ):
            self.still_since = started
            for skill in self.failed.values():
                skill.still = 0
        self.quantities = quantities

    def probability(self, skill_id: SkillId, *, still: bool) -> float:
        if still:
            return prod(one.probability(one.still) for one in self.failed.values())
        return self.failed[skill_id].probability(self.failed[skill_id].times)


class FailureStreak:
    """Declared failures of each skill since it last succeeded, by the measured state before them."""

    def __init__(self) -> None:
        self._streaks: dict[str, _Streak] = {}

    def reset(self) -> None:
        """Begin anew, as another provider is tried or somebody has helped."""
        self._streaks.clear()

    def succeeded(self, skill_id: SkillId) -> None:
        """Forget the failures of a skill, as it has succeeded.

        Args:
            skill_id: module and id of the skill.
        """
        for streak in self._streaks.values():
            streak.failed.pop(skill_id, None)
        self._streaks = {state: one for state, one in self._streaks.items() if one.failed}

    def add(
        self,
        skill_id: SkillId,
        skill: Skill,
        state: Mapping[str, Any],
        started: float,
        now: SuccessRecord,
        quantities: Quantities,
    ) -> None:
        """Note a declared failure.

        Args:
            skill_id: module and id of the skill.
            skill: its declaration.
            state: predicates as measured before the step.
            started: plant time at which the step started, s.
            now: its successes and failures in this context, this failure included.
            quantities: as measured after the step.
        """
        streak = self._streaks.setdefault(_key(state), _Streak(started, started, quantities))
        streak.note_quantities(quantities, started)
        if skill_id not in streak.failed:
            before = SuccessRecord(now.successes, max(0, now.failures - 1))
            streak.failed[skill_id] = _FailedSkill(before, _declared_failure(skill))
        streak.failed[skill_id].times += 1
        streak.failed[skill_id].still += 1

    def probability_by_chance(
        self, skill_id: SkillId, state: Mapping[str, Any], *, still: bool = True
    ) -> float:
        """Compute L.

        Args:
            skill_id: module and id of the skill.
            state: predicates.
            still: of the failures of all skills since a quantity changed; else of all those of the skill.

        Returns:
            A probability in [0, 1]; 1 if the skill did not fail in the state.
        """
        streak = self._streaks.get(_key(state))
        return (
            1.0
            if streak is None or skill_id not in streak.failed
            else streak.probability(skill_id, still=still)
        )

    def reason_to_stop(self, skill_id: SkillId, state: Mapping[str, Any], now: float) -> str:
        """Say why another try of a skill is no use.

        Args:
            skill_id: module and id of the skill that has just failed.
            state: predicates as measured before it.
            now: plant time, s.

        Returns:
            The reason in words; empty if it may be worth another try.
        """
        streak = self._streaks.get(_key(state))
        one = None if streak is None else streak.failed.get(skill_id)
        if streak is None or one is None:
            return ""
        for still, times, began in (
            (True, one.still, streak.still_since),
            (False, one.times, streak.began),
        ):
            is_long = times >= LEAST_FAILURES and now - began >= LEAST_SECONDS
            if not is_long or streak.probability(skill_id, still=still) >= LEAST_CHANCE:
                continue
            others = ", ".join(
                f"`{module}.{skill}` {other.still} times"
                for (module, skill), other in streak.failed.items()
                if (module, skill) != skill_id and still and other.still
            )
            before = f", where it had succeeded in {one.record} tries before" if one.record.successes else ""
            rest = f"; {others} did not help" if others else ""
            change = ", and no measured quantity changed" if still and streak.quantities else ""
            count = f"{times} times in the same measured state in {now - began:.0f} s"
            return f"it failed {count}{change}{before}{rest}"
        return ""


def _key(state: Mapping[str, Any]) -> str:
    return json.dumps(dict(state), sort_keys=True)


def _declared_failure(skill: Skill) -> float:
    shares = outcome_probabilities(skill.outcomes.values())
    return float(sum(share for outcome, share in shares if outcome.failure))
