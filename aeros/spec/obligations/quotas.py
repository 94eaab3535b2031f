"""Claims about quotas: each counts something that is ever allowed, and runs out where no other has.

Not claimed: that a task gets by on its quotas.  How many actions a skill asks for is not declared, and
a quota is of a window of time, so whoever waits may go on: the gate denies, and nothing is unsafe.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil

from aeros.spec.diagnostics.codes import Diagnostic, Label, Severity
from aeros.spec.model.model import Quota, Site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import Settled


def quota_obligations(site: Site) -> Iterator[Settled]:
    """Two claims for each quota of `site`; what fails is a warning, as no action more is allowed by it."""
    for position, quota in enumerate(site.quotas):
        idle = [
            (kind, why) for kind in sorted(quota.kinds) if (why := _never_allowed(site, kind)) is not None
        ]
        yield Settled(
            ClaimForm.QUOTA_EFFECTIVE(quota.id),
            _warning(
                "AE609",
                f"the quota `{quota.id}` counts "
                + " and ".join(f"`{kind}`, which {why}" for kind, why in idle),
                quota,
                "take it out of the quota's `on`" if len(idle) < len(quota.kinds) else "remove the quota",
            )
            if idle
            else None,
        )
        # Of two that imply each other the later one is not needed.
        later = (one for one in site.quotas[position + 1 :] if not implies(quota, one))
        other = next((one for one in (*site.quotas[:position], *later) if implies(one, quota)), None)
        yield Settled(
            ClaimForm.QUOTA_NEEDED(quota.id),
            None
            if other is None
            else _warning(
                "AE610",
                f"the quota `{quota.id}` never runs out before `{other.id}` does",
                quota,
                "remove it, or correct its numbers",
                other,
            ),
        )


def implies(one: Quota, other: Quota) -> bool:
    """Whether whatever keeps `one` keeps `other`; exactly so for actions at any instants.

    A closed window of `other.within` seconds holds the beginnings of at most ⌈other.within / one.within⌉
    windows that have nothing in common, and each of these may be used up at once.
    """
    most = one.at_most * ceil(other.within / one.within)
    return other.kinds <= one.kinds and most <= other.at_most


def _never_allowed(site: Site, kind: str) -> str | None:
    """Why no module may ever have an action of `kind` executed, as far as finite sets tell.

    Operator overrides are left out: they are lifted one day, and the quota must still be there then.
    """
    declared = site.kinds[kind]
    if declared.risk > site.risk_ceiling:
        return "is riskier than the site's ceiling"
    accesses = (site.access, *(site.access_of(module) for module in site.grants))
    if not any(declared.actuators <= access.actuators for access in accesses):
        return "moves what the site gives access to nobody"
    return None


def _warning(code: str, headline: str, quota: Quota, help_: str, other: Quota | None = None) -> Diagnostic:
    beside = () if other is None else (Label(other.span, "runs out first"),)
    return Diagnostic(code, headline, Label(quota.span), beside, help=(help_,), severity=Severity.WARNING)
