"""Which declared outcome a skill has: drawn by its declared probabilities, the same for a seed for ever."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from aeros.sim.channel import Process
from aeros.spec.errors import MisuseError
from aeros.spec.model import Outcome

Shares = Sequence[tuple[Outcome, Fraction]]
"""Outcomes with their probabilities, which sum up to 1."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """What outcomes are drawn of, and what else would have drawn the same.

    skill: by `module.skill`.
    alike: for a seed, after so many outcomes, rates or mean lengths of bursts, exclusive.
    """

    skill: str
    alike: Callable[[int, int], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Bursts:
    """How the outcomes of a skill are distributed in either state of a chain, one step a run."""

    process: Process
    good: Shares
    bad: Shares


def burst_point_of(seed: int, skill: str, invocation: int) -> float:
    """Where in [0, 1) the draw falls that decides the state at the `invocation`-th run of `skill`."""
    return float(point_of(seed, f"{skill}/burst", invocation))


def draw_outcome(
    shares: Iterable[tuple[Outcome, Fraction]], seed: int, skill: str, invocation: int
) -> Outcome:
    """The outcome of the `invocation`-th run of `skill`, whatever was drawn before it.

    Counter-based: SHA-256 of the key gives 64 uniform bits, so each probability is met to 2⁻⁶⁴.
    """
    point = point_of(seed, skill, invocation)
    upper = Fraction(0)
    for outcome, share in shares:
        upper += share
        if point < upper:
            return outcome
    raise MisuseError(f"the outcomes of `{skill}` are not a distribution")


def point_of(seed: int, skill: str, invocation: int) -> Fraction:
    """Where in [0, 1) the draw falls, whatever the shares are."""
    key = f"aeros/outcome/1\n{seed}\n{skill}\n{invocation}".encode()
    return Fraction(int.from_bytes(hashlib.sha256(key).digest()[:8], "big"), 2**64)
