"""Whether a denial may pass: it is on account of what is measured now, so that waiting may help."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from aeros.runtime.decision import Reason
from aeros.spec.expr import terms as t
from aeros.spec.model import Site

_NOT_KNOWN: Final = ("AE703", "AE706")
"""Nothing is measured, or it is too old: the sensor may come back."""


def may_pass(reasons: Iterable[Reason], kind: str, site: Site) -> bool:
    """Whether each reason speaks of the state: a rule that reads it, or a value that is not known.

    What a rule says of parameters alone, an envelope, a permission or the operator stays as it is.
    """
    reading = {
        rule.id for rule in site.rules_on(kind) if t.variables_of(rule.terms[kind]) & site.observed.keys()
    }
    return all(one.code in _NOT_KNOWN or (one.code == "AE750" and one.rule in reading) for one in reasons)
