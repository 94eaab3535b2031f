"""Outcomes of skills, drawn by their declared probabilities; a seed always gives the same outcomes."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

from aeros.sim.gilbert_elliott import GilbertElliottProcess, GilbertElliottSampler
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.expr.effects import Increment
from aeros.spec.model.ecm import Ecm, Outcome

OutcomeProbabilities = Sequence[tuple[Outcome, Fraction]]
"""Outcomes with their probabilities, which sum up to 1."""


@dataclass(frozen=True, slots=True)
class DrawEquivalence:
    """Parameters of a skill's distribution that would have drawn the same outcomes.

    Attributes:
        skill: as `module.skill`.
        equivalent_interval: from a seed and a number of runs to the open interval of rates, or of mean
            burst lengths, that give the same outcomes.
    """

    skill: str
    equivalent_interval: Callable[[int, int], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class BurstOutcomes:
    """Outcome probabilities of a skill in either state of a Gilbert-Elliott chain, one step per run.

    Attributes:
        process: the chain, which makes one step at each run of the skill.
        good: outcome probabilities in the good state.
        bad: outcome probabilities in the bad state.
    """

    process: GilbertElliottProcess
    good: OutcomeProbabilities
    bad: OutcomeProbabilities


def outcome_probabilities_by_skill(modules: Iterable[Ecm]) -> dict[str, OutcomeProbabilities]:
    """Collect the outcome probabilities of all skills.

    Args:
        modules: modules whose skills count.

    Returns:
        Outcomes with their probabilities, by `module.skill`.

    Raises:
        MisuseError: the declared probabilities of a skill are not a distribution.
    """
    return {
        f"{ecm.id}.{skill.id}": outcome_probabilities(skill.outcomes.values())
        for ecm in modules
        for skill in ecm.skills.values()
    }


class DrawnOutcome(NamedTuple):
    """An outcome that was drawn.

    Attributes:
        skill: as `module.skill`.
        run: number of the skill's run, from 0.
        outcome: its id.
    """

    skill: str
    run: int
    outcome: str


class OutcomeSampler:
    """Sampler of the outcome of each run of each skill; outcomes do not depend on the order of calls.

    Args:
        shares: outcome probabilities by `module.skill`.
        bursts: distributions of the skills whose outcomes come in bursts, by `module.skill`.
        seed: the same seed gives the same outcomes.
    """

    def __init__(
        self, shares: Mapping[str, OutcomeProbabilities], bursts: Mapping[str, BurstOutcomes], seed: int
    ) -> None:
        self._shares = shares
        self._bursts = bursts
        self._seed = seed
        self._chains = {skill: GilbertElliottSampler(burst.process) for skill, burst in bursts.items()}
        self._outcomes: dict[str, list[Outcome]] = {}

    def outcome(self, skill: str, run: int) -> Outcome:
        """Return the outcome of a run.

        Args:
            skill: as `module.skill`.
            run: number of the skill's run, from 0.

        Returns:
            The outcome.

        Raises:
            MisuseError: the skill's outcomes are not a distribution.
        """
        known = self._outcomes.setdefault(skill, [])
        while len(known) <= run:
            known.append(
                draw_outcome(self._probabilities_at(skill, len(known)), self._seed, skill, len(known))
            )
        return known[run]

    def _probabilities_at(self, skill: str, run: int) -> OutcomeProbabilities:
        """Return the outcome probabilities at a run; for bursts, call it once for each run, in order."""
        if skill not in self._bursts:
            return self._shares[skill]
        is_bad = self._chains[skill].is_bad(uniform_burst_draw(self._seed, skill, run))
        return self._bursts[skill].bad if is_bad else self._bursts[skill].good


def uniform_burst_draw(seed: int, skill: str, invocation: int) -> float:
    """Draw the number that decides the burst state at a run.

    Args:
        seed: of the trial.
        skill: as `module.skill`.
        invocation: number of the skill's run, from 0.

    Returns:
        A number in [0, 1).
    """
    return float(uniform_draw(seed, f"{skill}/burst", invocation))


def draw_outcome(
    shares: Iterable[tuple[Outcome, Fraction]], seed: int, skill: str, invocation: int
) -> Outcome:
    """Draw the outcome of a run, independently of all other draws.

    Counter-based: SHA-256 of the key gives 64 uniform bits, so each probability is met to 2⁻⁶⁴.

    Args:
        shares: outcomes with their probabilities.
        seed: of the trial.
        skill: as `module.skill`.
        invocation: number of the skill's run, from 0.

    Returns:
        The outcome.

    Raises:
        MisuseError: the probabilities sum to less than the number drawn.
    """
    point = uniform_draw(seed, skill, invocation)
    upper = Fraction(0)
    for outcome, share in shares:
        upper += share
        if point < upper:
            return outcome
    raise MisuseError(f"the outcomes of `{skill}` are not a distribution")


def uniform_draw(seed: int, skill: str, invocation: int) -> Fraction:
    """Draw the number that decides the outcome of a run.

    Args:
        seed: of the trial.
        skill: as `module.skill`, or another key.
        invocation: number of the skill's run, from 0.

    Returns:
        A multiple of 2⁻⁶⁴ in [0, 1).
    """
    key = f"aeros/outcome/1\n{seed}\n{skill}\n{invocation}".encode()
    return Fraction(int.from_bytes(hashlib.sha256(key).digest()[:8], "big"), 2**64)


def quantities_after(outcome: Outcome, before: Mapping[str, Any]) -> dict[str, Any]:
    """Compute counts, which depend on the values before, and quantities in the middle of their ranges.

    Args:
        outcome: the outcome that was drawn.
        before: value of each state variable before it, SI.

    Returns:
        Value afterwards of each variable that it counts or leaves in a range.
    """
    after: dict[str, Any] = {
        name: before[name] + int(effect.amount)
        for name, effect in outcome.effects.items()
        if isinstance(effect, Increment)
    }
    for one in outcome.ranges:
        after[one.variable] = one.middle_of(after.get(one.variable, before[one.variable]))
    return after
