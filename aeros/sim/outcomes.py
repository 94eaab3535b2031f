"""Which declared outcome a skill has: drawn by its declared probabilities, the same for a seed for ever."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from fractions import Fraction

from aeros.spec.errors import MisuseError
from aeros.spec.model import Outcome


def shares_of(outcomes: Iterable[Outcome]) -> list[tuple[Outcome, Fraction]]:
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


def draw_outcome(
    shares: Iterable[tuple[Outcome, Fraction]], seed: int, skill: str, invocation: int
) -> Outcome:
    """The outcome of the `invocation`-th run of `skill`, whatever was drawn before it.

    Counter-based: SHA-256 of the key gives 64 uniform bits, so each probability is met to 2⁻⁶⁴.
    """
    key = f"aeros/outcome/1\n{seed}\n{skill}\n{invocation}".encode()
    point = Fraction(int.from_bytes(hashlib.sha256(key).digest()[:8], "big"), 2**64)
    upper = Fraction(0)
    for outcome, share in shares:
        upper += share
        if point < upper:
            return outcome
    raise MisuseError(f"the outcomes of `{skill}` are not a distribution")
