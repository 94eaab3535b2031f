"""Expected results of choosing between two skills as the dispatcher does, session by session.

One try a session. The weights of both records are real numbers, so their states cannot be enumerated. The
choice alone is simulated instead, without agent, runtime and plant: `RUNS` times with fixed random numbers.
It is written anew here, so that the measured results also check the agent's code.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import Random
from typing import Final, NamedTuple

from aeros.agent.memory.posterior import FORGETTING
from aeros.spec.model.expected_time import FAILURE_COST_S

SuccessProbabilities = Sequence[tuple[float, float]]
"""Probabilities of success of either skill, for each session."""

RUNS: Final = 10_000
"""Simulated agents; the standard error of the successes in 50 sessions is 0.03."""


class ExpectedSession(NamedTuple):
    """Expected values of one session.

    Attributes:
        success: probability of success, in [0, 1].
        first: probability that the first skill is chosen, in [0, 1].
    """

    success: float
    first: float


def with_memory(
    chances: SuccessProbabilities,
    seconds: tuple[float, float] = (0.0, 0.0),
    forgetting: float = FORGETTING,
    runs: int = RUNS,
) -> list[ExpectedSession]:
    """Estimate each session of an agent that remembers the sessions before.

    Args:
        chances: probability of success of either skill, for each session.
        seconds: time that either skill takes, s.
        forgetting: factor by which each try lowers the weight of the tries before it.
        runs: number of simulated agents.

    Returns:
        Expected values of each session.
    """
    random = Random(0)  # noqa: S311  a simulation
    firsts = [0] * len(chances)
    for _ in range(runs):
        weights, succeeded = [[0.0, 0.0], [0.0, 0.0]], [False, False]
        for number, pair in enumerate(chances):
            chosen = _choose(random, weights, seconds if all(succeeded) else None)
            firsts[number] += chosen == 0
            failed = random.random() >= pair[chosen]
            weights = [[forgetting * one for one in both] for both in weights]
            weights[chosen][failed] += 1.0
            succeeded[chosen] |= not failed
    return [
        ExpectedSession((first * one + (runs - first) * other) / runs, first / runs)
        for first, (one, other) in zip(firsts, chances, strict=True)
    ]


def _choose(random: Random, weights: list[list[float]], seconds: tuple[float, float] | None) -> int:
    """Return the index of the skill with the lower expected time until success by a draw of each posterior.

    Where the times are not both known, they count as equal, and the higher draw has the lower expected time.
    """
    one, other = (random.betavariate(successes + 1.0, failures + 1.0) for successes, failures in weights)
    if seconds is None:
        return int(one < other)
    expected = [
        (took + (1.0 - drawn) * FAILURE_COST_S) / max(drawn, 1e-12)
        for took, drawn in zip(seconds, (one, other), strict=True)
    ]
    return int(expected[0] > expected[1])


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
