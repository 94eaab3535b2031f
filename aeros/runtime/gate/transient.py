"""Whether a denial may pass: it is on account of what is measured now, so that waiting may help."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from aeros.runtime.gate.decision import Reason
from aeros.spec.expr import terms as t
from aeros.spec.model.model import Site

_JOINTS_ELSEWHERE_CODE: Final = "AE761"
"""The joints are not where a motion would start: something held them, or they lacked strength."""

_UNKNOWN_VALUE_CODES: Final = ("AE703", "AE706")
"""Nothing is measured, or it is too old: the sensor may come back."""


def is_transient_denial(reasons: Iterable[Reason], kind: str, site: Site) -> bool:
    """Whether each reason speaks of the state: a rule that reads it, a value not known, joints elsewhere.

    What a rule says of parameters alone, an envelope, a permission or the operator stays as it is.
    """
    reading = {
        rule.id
        for rule in site.rules_for_kind(kind)
        if t.variables_of(rule.terms[kind]) & site.observed_variables.keys()
    }
    of_state = {("AE750", rule) for rule in reading}
    if site.motion is not None:
        of_state.add((_JOINTS_ELSEWHERE_CODE, site.motion.start_variable))
    return all(one.code in _UNKNOWN_VALUE_CODES or (one.code, one.rule) in of_state for one in reasons)
