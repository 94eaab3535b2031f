"""Expected time until a step succeeds, where each failed try costs time: for choices and plans.

    E[time] = (t + (1 - p) * FAILURE_COST_S) / p

for tries of t seconds that succeed with probability p, independently of each other.
"""

from __future__ import annotations

from typing import Final

FAILURE_COST_S: Final = 60.0
"""Cost of a failed try, s: time to look again, to recover and to plan anew, and that nothing may help."""

LEAST_SUCCESS: Final = 1e-9
"""Chance of success that a smaller one counts as, so that times are finite."""


UNKNOWN_DURATION_S: Final = 10
"""Duration that an outcome without one counts as, s; so plans without durations are the shortest ones."""


def expected_time(seconds: float, success: float) -> float:
    """Compute the expected time until success.

    Args:
        seconds: time of each try, s.
        success: probability that a try succeeds, in [0, 1].

    Returns:
        Seconds.
    """
    return (seconds + (1.0 - success) * FAILURE_COST_S) / max(success, LEAST_SUCCESS)
