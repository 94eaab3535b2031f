"""Claims about quotas: each counts actions that may be allowed, and can run out before every other.

Not claimed: that a task gets by on its quotas.  The number of actions that a skill asks for is not declared,
and a quota is for a window of time, so a skill that waits may go on: the gate denies, and nothing is unsafe.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil

from aeros.spec.diagnostics.codes import Diagnostic, Severity, SpanLabel
from aeros.spec.model.policy import Quota
from aeros.spec.model.site import Site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import StaticClaim


def quota_obligations(site: Site) -> Iterator[StaticClaim]:
    """Make two claims for each quota of a site; a failure is a warning, as it allows no further action.

    Args:
        site: the site.

    Yields:
        For each quota: it counts actions that may be allowed, and it is needed.
    """
    for position, quota in enumerate(site.quotas):
        idle = [
            (kind, why) for kind in sorted(quota.kinds) if (why := denial_of_kind(site, kind)) is not None
        ]
        yield StaticClaim(
            ClaimForm.QUOTA_EFFECTIVE(quota.id),
            _warning(
                "AE609",
                f"the quota `{quota.id}` counts "
                + " and ".join(f"`{kind}`, which {why}" for kind, why in idle),
                quota,
                "count the kind that was meant, or none for it",
            )
            if idle
            else None,
        )
        # If two imply each other, the later one is not needed.
        later = (one for one in site.quotas[position + 1 :] if not quota_implies(quota, one))
        other = next((one for one in (*site.quotas[:position], *later) if quota_implies(one, quota)), None)
        yield StaticClaim(
            ClaimForm.QUOTA_NEEDED(quota.id),
            None
            if other is None
            else _warning(
                "AE610",
                f"the quota `{quota.id}` never runs out before `{other.id}` does",
                quota,
                "correct its numbers if they are not those that were meant",
                other,
            ),
        )


def quota_implies(quota: Quota, other: Quota) -> bool:
    """Tell whether actions that keep one quota always keep another; exact for actions at any instants.

    A closed window of `other.window_s` seconds holds the beginnings of at most
    ⌈other.window_s / quota.window_s⌉ disjoint windows of `quota`, and each of these may be used up at once.

    Args:
        quota: the quota that is kept.
        other: the quota that may follow from it.

    Returns:
        True if `other` never runs out before `quota`.
    """
    most = quota.max_count * ceil(other.window_s / quota.window_s)
    return other.kinds <= quota.kinds and most <= other.max_count


def denial_of_kind(site: Site, kind: str) -> str | None:
    """Give the reason why no module may ever execute an action of `kind`, as far as finite sets show it.

    Operator overrides are left out: they are lifted one day, and the quota must still be there then.

    Args:
        site: the site.
        kind: an action kind of it.

    Returns:
        The reason, for the end of a sentence; None if some module may.
    """
    declared = site.kinds[kind]
    if declared.risk > site.risk_ceiling:
        return "is riskier than the site's ceiling"
    accesses = (site.access, *(site.access_of(module) for module in site.grants))
    if not any(declared.actuators <= access.actuators for access in accesses):
        return "moves actuators that the site grants to no module"
    return None


def _warning(code: str, headline: str, quota: Quota, help_: str, other: Quota | None = None) -> Diagnostic:
    secondary = () if other is None else (SpanLabel(other.span, "runs out first"),)
    return Diagnostic(
        code, headline, SpanLabel(quota.span), secondary, help=(help_,), severity=Severity.WARNING
    )
