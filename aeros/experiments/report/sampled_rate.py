"""Exact values at the sampled rate of failure: they separate chance in the draws from all other differences.

Trials of a seed compare the same numbers with every rate, so where seeds draw few failures at one rate they
do so at its neighbours, and in every architecture.  If that were the only difference, a condition would show
what is exact at the share of attempts that failed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from aeros.experiments.condition import TrialCondition
from aeros.experiments.inputs import TrialInputs
from aeros.experiments.trial_kinds import Findings, kind_of


def exact_at_sampled_rate(
    condition: TrialCondition, found: Sequence[Findings], premises: TrialInputs
) -> dict[str, Any] | None:
    """Compute the expected values of a condition at the share of attempts that failed.

    Args:
        condition: kind, plant and settings of the trials.
        found: findings of its trials.
        premises: proved modules, site and compiled gate.

    Returns:
        `share` of attempts that failed, and the `exact` values at it by name; None where the condition has no
        rate.
    """
    settings = condition.settings
    tries = sum(one.get("tries", 0) for one in found)
    if "rate" not in settings or "bursts" in settings or not tries:
        return None
    share = Fraction(sum(one["failed_tries"] for one in found), tries)
    as_drawn = TrialCondition.create(condition.kind, condition.plant, {**settings, "rate": str(share)})
    exact: Mapping[str, float] | str = kind_of(condition.kind).expected_values(as_drawn, premises)
    return None if isinstance(exact, str) else {"share": float(share), "exact": exact}
