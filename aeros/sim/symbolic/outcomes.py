"""Which declared outcome a skill has: drawn by its declared probabilities, the same for a seed for ever."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from aeros.sim.gilbert_elliott import GilbertElliottProcess, GilbertElliottSampler
from aeros.spec.closed_loop.outcome_probabilities import outcome_probabilities
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.model.model import Ecm, Outcome

OutcomeProbabilities = Sequence[tuple[Outcome, Fraction]]
"""Outcomes with their probabilities, which sum up to 1."""


@dataclass(frozen=True, slots=True)
class DrawEquivalence:
    """What outcomes are drawn of, and what else would have drawn the same.

    skill: by `module.skill`.
    alike: for a seed, after so many outcomes, rates or mean lengths of bursts, exclusive.
    """

    skill: str
    equivalent_interval: Callable[[int, int], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class BurstOutcomes:
    """How the outcomes of a skill are distributed in either state of a chain, one step a run."""

    process: GilbertElliottProcess
    good: OutcomeProbabilities
    bad: OutcomeProbabilities


def outcome_probabilities_by_skill(modules: Iterable[Ecm]) -> dict[str, OutcomeProbabilities]:
    """Of every skill, by `module.skill`; raises `MisuseError` where outcomes are no distribution."""
    return {
        f"{ecm.id}.{skill.id}": outcome_probabilities(skill.outcomes.values())
        for ecm in modules
        for skill in ecm.skills.values()
    }


class DrawnOutcome(NamedTuple):
    """That the so manyth run of a skill, by `module.skill`, had that outcome."""

    skill: str
    run: int
    outcome: str


class OutcomeSampler:
    """The outcome that each run of each skill has with a seed, in whichever order they are asked for.

    shares: of skills, by `module.skill`.
    bursts: skills whose outcomes are not independent of each other.
    """

    def __init__(
        self, shares: Mapping[str, OutcomeProbabilities], bursts: Mapping[str, BurstOutcomes], seed: int
    ) -> None:
        self._shares = shares
        self._bursts = bursts
        self._seed = seed
        self._chains = {skill: GilbertElliottSampler(one.process) for skill, one in bursts.items()}
        self._outcomes: dict[str, list[Outcome]] = {}

    def outcome(self, skill: str, run: int) -> Outcome:
        """Of its `run`-th run, from 0 on.  Raises `MisuseError` where its outcomes are no distribution."""
        known = self._outcomes.setdefault(skill, [])
        while len(known) <= run:
            known.append(
                draw_outcome(self._probabilities_at(skill, len(known)), self._seed, skill, len(known))
            )
        return known[run]

    def _probabilities_at(self, skill: str, run: int) -> OutcomeProbabilities:
        """How likely each is at that run; asked for each run of a skill in bursts once, from the first on."""
        if skill not in self._bursts:
            return self._shares[skill]
        is_bad = self._chains[skill].is_bad(uniform_burst_draw(self._seed, skill, run))
        return self._bursts[skill].bad if is_bad else self._bursts[skill].good


def uniform_burst_draw(seed: int, skill: str, invocation: int) -> float:
    """Where in [0, 1) the draw falls that decides the state at the `invocation`-th run of `skill`."""
    return float(uniform_draw(seed, f"{skill}/burst", invocation))


def draw_outcome(
    shares: Iterable[tuple[Outcome, Fraction]], seed: int, skill: str, invocation: int
) -> Outcome:
    """The outcome of the `invocation`-th run of `skill`, whatever was drawn before it.

    Counter-based: SHA-256 of the key gives 64 uniform bits, so each probability is met to 2⁻⁶⁴.
    """
    point = uniform_draw(seed, skill, invocation)
    upper = Fraction(0)
    for outcome, share in shares:
        upper += share
        if point < upper:
            return outcome
    raise MisuseError(f"the outcomes of `{skill}` are not a distribution")


def uniform_draw(seed: int, skill: str, invocation: int) -> Fraction:
    """Where in [0, 1) the draw falls, whatever the shares are."""
    key = f"aeros/outcome/1\n{seed}\n{skill}\n{invocation}".encode()
    return Fraction(int.from_bytes(hashlib.sha256(key).digest()[:8], "big"), 2**64)
