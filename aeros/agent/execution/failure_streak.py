"""Evidence that declared failures are no chance: nothing has changed since, and chance does not explain it.

A *streak* is the declared failures of skills in one measured state, since each of them last succeeded. The
rule that ends it is `aeros.spec.closed_loop.giving_up`, which predictions follow, too: it needs the numbers
of failures, and the failures that were expected.

Failures after which no quantity of the module had changed, each within its uncertainty, are the same attempt
at the same thing, and count for all skills together. Of other failures in the state those of one skill count,
as some may have brought the task on, such as one of many pieces put away.

Time decides nothing but when the next plan is made: not before the streak has lasted `LEAST_SECONDS`, so that
what passes by itself, such as somebody's hand before a camera, has passed at the last try. A resumed run
begins a new streak.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Final

from aeros.agent.memory.evidence import SkillId
from aeros.spec.closed_loop.giving_up import is_beyond_chance
from aeros.spec.model.variables import Declared

LEAST_SECONDS: Final = 15.0
"""Plant time that a streak lasts before a plan in which it may end, s: until then waiting costs little."""

_LAST_TRIES: Final = 3
"""Further failures within which a streak may end in the next plan: that of a try and two retries."""

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
    """A skill in a streak, and the failures that were expected of it, as a probability.

    `still` counts its failures since a quantity last changed.
    """

    expected: Fraction
    times: int = 0
    still: int = 0


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

    def is_beyond_chance(self, skill_id: SkillId, *, still: bool, more: int = 0) -> bool:
        """Tell if chance does not explain the failures, with some more of the skill."""
        one = self.failed[skill_id]
        if still:
            others = [(each.expected, each.still) for each in self.failed.values() if each is not one]
            return is_beyond_chance(one.still + more, [(one.expected, one.still + more), *others])
        return is_beyond_chance(one.times + more, [(one.expected, one.times + more)])


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
        expected: Fraction,
        state: Mapping[str, Any],
        started: float,
        quantities: Quantities,
    ) -> None:
        """Note a declared failure.

        Args:
            skill_id: module and id of the skill.
            expected: probability of a failure that was expected, in [0, 1].
            state: predicates as measured before the step.
            started: plant time at which the step started, s.
            quantities: as measured after the step.
        """
        streak = self._streaks.setdefault(_key(state), _Streak(started, started, quantities))
        streak.note_quantities(quantities, started)
        one = streak.failed.setdefault(skill_id, _FailedSkill(expected))
        one.times += 1
        one.still += 1

    def pause(self, skill_id: SkillId, state: Mapping[str, Any], now: float) -> float:
        """Say how long to wait before another plan.

        Args:
            skill_id: module and id of the skill that has just failed.
            state: predicates as measured before it.
            now: plant time, s.

        Returns:
            Time, s; 0 if the next plan can be made at once.
        """
        streak = self._streaks.get(_key(state))
        one = None if streak is None else streak.failed.get(skill_id)
        if (
            streak is None
            or one is None
            or not streak.is_beyond_chance(skill_id, still=True, more=_LAST_TRIES)
        ):
            return 0.0
        return max(0.0, streak.began + LEAST_SECONDS - now)

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
            if not streak.is_beyond_chance(skill_id, still=still):
                continue
            others = ", ".join(
                f"`{module}.{skill}` {other.still} times"
                for (module, skill), other in streak.failed.items()
                if (module, skill) != skill_id and still and other.still
            )
            rest = f"; {others} did not help" if others else ""
            change = ", and no measured quantity changed" if still and streak.quantities else ""
            count = f"{times} times in the same measured state in {now - began:.0f} s"
            return f"it failed {count}{change}, where {float(one.expected):.1%} of tries are to fail{rest}"
        return ""


def _key(state: Mapping[str, Any]) -> str:
    return json.dumps(dict(state), sort_keys=True)
