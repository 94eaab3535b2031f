"""Exact results of choosing between two skills by Thompson sampling, session by session.

One try a session.  Memory holds the record of both skills, successes and failures, which is a Markov chain:
the first is chosen with the probability that a draw from its Beta posterior is above one from the other's,
and succeeds with its probability in that session.  All states are walked, so nothing is sampled.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, lgamma
from typing import NamedTuple

SuccessProbabilities = Sequence[tuple[float, float]]
"""Probabilities of success of either skill, for each session."""

_Record = tuple[int, int, int, int]


class ExpectedSession(NamedTuple):
    """Expected values of one session.

    Attributes:
        success: probability of success, in [0, 1].
        first: probability that the first skill is chosen, in [0, 1].
    """

    success: float
    first: float


def with_memory(chances: SuccessProbabilities) -> list[ExpectedSession]:
    """Compute each session of an agent that remembers the sessions before.

    Args:
        chances: probability of success of either skill, for each session.

    Returns:
        Expected values of each session.
    """
    above = _ProbabilityAbove()
    records: dict[_Record, float] = {(0, 0, 0, 0): 1.0}
    sessions = []
    for one, other in chances:
        after: dict[_Record, float] = {}
        first = 0.0
        for (s, f, u, g), chance in records.items():
            chosen = chance * above(s + 1, f + 1, u + 1, g + 1)
            other_chosen = chance - chosen
            first += chosen
            for record, share in (
                ((s + 1, f, u, g), chosen * one),
                ((s, f + 1, u, g), chosen * (1.0 - one)),
                ((s, f, u + 1, g), other_chosen * other),
                ((s, f, u, g + 1), other_chosen * (1.0 - other)),
            ):
                after[record] = after.get(record, 0.0) + share
        sessions.append(ExpectedSession(first * one + (1.0 - first) * other, first))
        records = after
    return sessions


def without_memory(chances: SuccessProbabilities) -> list[ExpectedSession]:
    """Compute each session of an agent that remembers nothing: it chooses either skill equally often.

    Args:
        chances: probability of success of either skill, for each session.

    Returns:
        Expected values of each session.
    """
    return [ExpectedSession((one + other) / 2.0, 0.5) for one, other in chances]


def oracle(chances: SuccessProbabilities) -> list[ExpectedSession]:
    """Compute each session of an agent that knows the probabilities.

    Args:
        chances: probability of success of either skill, for each session.

    Returns:
        Expected values of each session.
    """
    return [ExpectedSession(max(one, other), float(one >= other)) for one, other in chances]


class _ProbabilityAbove:
    """P(X > Y) of X ~ Beta(a, b) and Y ~ Beta(c, d), for integers of at least 1; cached.

    For a = 1 it is E[(1 − Y)^b] = B(c, b + d) / B(c, d), and one more of a adds
    B(a + c, b + d) / (a B(a, b) B(c, d)).
    """

    def __init__(self) -> None:
        self._known: dict[_Record, float] = {}

    def __call__(self, a: int, b: int, c: int, d: int) -> float:
        known = self._known.get((a, b, c, d))
        if known is None:
            if a == 1:
                known = exp(_log_beta(c, b + d) - _log_beta(c, d))
            else:
                more = _log_beta(a - 1 + c, b + d) - _log_beta(a - 1, b) - _log_beta(c, d)
                known = self(a - 1, b, c, d) + exp(more) / (a - 1)
            self._known[a, b, c, d] = known
        return known


def _log_beta(a: int, b: int) -> float:
    return lgamma(a) + lgamma(b) - lgamma(a + b)
