"""What would be exact if attempts failed as often as they did: it tells chance in the draws from all else.

Trials of a seed compare the same numbers with every rate, so where seeds draw few failures at one rate they
do at its neighbours, and in every architecture.  Were that all, what a condition shows would be what is
exact of it at the share of attempts that failed.
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
    """`share`, of attempts that failed, and what is `exact` at it, by name; None where there is no rate."""
    settings = condition.settings
    tries = sum(one.get("tries", 0) for one in found)
    if "rate" not in settings or "bursts" in settings or not tries:
        return None
    share = Fraction(sum(one["failed_tries"] for one in found), tries)
    as_drawn = TrialCondition.create(condition.kind, condition.plant, {**settings, "rate": str(share)})
    exact: Mapping[str, float] | str = kind_of(condition.kind).expected_values(as_drawn, premises)
    return None if isinstance(exact, str) else {"share": float(share), "exact": exact}
