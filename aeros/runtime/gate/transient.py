"""Transient denials: they depend only on measured values or used-up quotas, so waiting may help."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from aeros.runtime.gate.decision import Reason
from aeros.spec.expr import terms as t
from aeros.spec.model.site import Site

_JOINTS_ELSEWHERE_CODE: Final = "AE761"
"""The joints are not where a motion would start: something held them, or they lacked strength."""

_UNKNOWN_VALUE_CODES: Final = ("AE703", "AE706")
"""A value is not measured or too old: the sensor may recover."""

_QUOTA_CODE: Final = "AE742"
"""A quota is used up: its window passes, unless it allows none at all."""


def is_transient_denial(reasons: Iterable[Reason], kind: str, site: Site) -> bool:
    """Check if a denial may turn into an allowance by waiting.

    Rules on parameters alone, envelopes, permissions and operator overrides do not change by waiting. The
    window of a quota passes.

    Args:
        reasons: the reasons of a denial.
        kind: the action kind that was denied.
        site: the site whose rules the reasons name.

    Returns:
        True if every reason depends on the state: a rule on it, an unknown value, displaced joints; or on a
        quota that is used up.
    """
    reading = {
        rule.id
        for rule in site.rules_for_kind(kind)
        if t.variables_of(rule.terms[kind]) & site.observed_variables.keys()
    }
    of_state = {("AE750", rule) for rule in reading}
    of_state |= {(_QUOTA_CODE, quota.id) for quota in site.quotas if quota.max_count > 0}
    if site.motion is not None:
        of_state.add((_JOINTS_ELSEWHERE_CODE, site.motion.start_variable))
    return all(
        reason.code in _UNKNOWN_VALUE_CODES or (reason.code, reason.rule) in of_state for reason in reasons
    )
