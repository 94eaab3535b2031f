"""Choice among the alternatives that provide a capability: the least expected time until one succeeds.

The expected time (`expected_time.py`) is that of tries of t seconds that succeed with probability p.
p is drawn from each posterior (`posterior.py`), so an alternative with few recent tries is chosen at times
(Thompson sampling). Such a choice against the expected values is an exploration. A run makes at most
`MAX_EXPLORATIONS` of each capability; then the expected values alone decide. t is the usual duration of a
success, and the wear of a try, which is declared as a time. Where the duration is not known it counts as the
mean of the others, so it decides nothing.

The choice only orders alternatives that the proof of the planning rules covers one by one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from random import Random
from statistics import fmean
from typing import Final

from aeros.agent.memory.posterior import NO_RESULTS, RecentRecord, SuccessRecord
from aeros.spec.model.expected_time import expected_time

MAX_EXPLORATIONS: Final = 3
"""Choices against the expected values that one run makes of each capability."""


@dataclass(frozen=True, slots=True)
class ProviderOption:
    """A provider as the choice saw it.

    Attributes:
        skill: id of the skill, or name of the composition; `MODULE.NAME` for one of another module.
        record: successes and failures in the context of the choice; of a composition, those of the skill that
            succeeded least.
        recent: the same, each try weighed by its age.
        seconds: usual duration of a success, s; None if it is not known.
        unavailable_reason: why it could not be chosen; empty if it could.
        sampled_success: chance of success drawn for it, in [0, 1]; None if it was not available.
        expected_s: expected time until success by the mean of the posterior, s; None if it was not available.
        wear_s: declared wear of one try, s.
    """

    skill: str
    record: SuccessRecord
    recent: RecentRecord = NO_RESULTS
    seconds: float | None = None
    unavailable_reason: str = ""
    sampled_success: float | None = None
    expected_s: float | None = None
    wear_s: float = 0.0

    def __str__(self) -> str:
        if self.record.successes + self.record.failures:
            text = f"`{self.skill}` {self.record} succeeded (by age {self.recent})"
        else:
            text = f"`{self.skill}` has no result yet"
        if self.seconds is not None:
            text += f", takes {self.seconds:.1f} s"
        if self.wear_s:
            text += f", wear {self.wear_s:g} s"
        return (
            f"{text}, not now: {self.unavailable_reason}"
            if self.sampled_success is None
            else f"{text}, drew {self.sampled_success:.3f}"
        )


@dataclass(frozen=True, slots=True)
class ProviderChoice:
    """A choice with what it was made of.

    Attributes:
        options: the alternatives, the chosen one included.
        chosen: position of the chosen one; None if none is available.
        reason: why it was chosen, in words.
        is_exploration: another one has the better expected value.
    """

    options: tuple[ProviderOption, ...]
    chosen: int | None
    reason: str
    is_exploration: bool = False


def choose_provider(options: Sequence[ProviderOption], random: Random, explorations: int) -> ProviderChoice:
    """Choose among alternatives.

    Args:
        options: the alternatives; those with an `unavailable_reason` are not chosen.
        random: source of the draws; a draw is made for each alternative.
        explorations: number of explorations of this capability in this run so far.

    Returns:
        The choice.
    """
    known = [one.seconds for one in options if one.seconds is not None]
    usual = fmean(known) if known else 0.0
    drawn_s: dict[int, float] = {}
    seen = []
    for place, one in enumerate(options):
        # Drawn for each, so that a draw does not depend on which of the others may start.
        drawn = one.recent.sample(random)
        if one.unavailable_reason:
            seen.append(one)
            continue
        seconds = (usual if one.seconds is None else one.seconds) + one.wear_s
        drawn_s[place] = expected_time(seconds, drawn)
        mean_s = expected_time(seconds, one.recent.mean)
        seen.append(replace(one, sampled_success=drawn, expected_s=mean_s))
    if not drawn_s:
        return ProviderChoice(tuple(seen), None, "none can start")
    by_draw = min(drawn_s, key=drawn_s.__getitem__)
    best = min(seen[place].expected_s or 0.0 for place in drawn_s)
    equal = [place for place in drawn_s if (seen[place].expected_s or 0.0) <= best]
    explores = by_draw not in equal
    if len(drawn_s) == 1:
        return ProviderChoice(tuple(seen), by_draw, "only this one can start now")
    if not explores or explorations < MAX_EXPLORATIONS:
        reason = (
            f"explores, {explorations + 1} of at most {MAX_EXPLORATIONS} in this run"
            if explores
            else "least expected time until success"
        )
        return ProviderChoice(tuple(seen), by_draw, reason, explores)
    by_mean = min(equal, key=drawn_s.__getitem__)
    reason = f"least expected time until success; this run has explored {MAX_EXPLORATIONS} times"
    return ProviderChoice(tuple(seen), by_mean, reason)
