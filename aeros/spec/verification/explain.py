"""Findings → findings with what a person needs to act on them: the cause, a repair, the boundary."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from aeros.spec.backends.oracle import Oracle
from aeros.spec.model.model import Site
from aeros.spec.obligations.obligation import Claim, Obligation
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import Finding
from aeros.spec.verification.gate_boundary import boundary_of, envelope_about
from aeros.spec.verification.repair import repairs_of
from aeros.spec.verification.unsat_core import core_of, labels_of_breach, labels_of_core


def answered(findings: Iterable[Finding], site: Site, oracle: Oracle) -> tuple[Finding, ...]:
    """The findings, with labels on what is at fault, repairs of envelopes, and boundaries of guards.

    Verdicts and witnesses stay as they are; what is proved costs nothing.
    """
    listed = list(findings)
    repairs = repairs_of(listed, site, oracle)
    boundaries = _Boundaries(site, oracle)
    return tuple(
        replace(one, boundary=boundaries.of(one.obligation))
        if one.guarded
        else _explained(one, repairs.get(one.obligation.id, ""), oracle)
        for one in listed
    )


class _Boundaries:
    """Each boundary once: most rules that are left to the gate read nothing that an envelope speaks of."""

    def __init__(self, site: Site, oracle: Oracle) -> None:
        self._site = site
        self._oracle = oracle
        self._known: dict[tuple[int, int], str] = {}  # by identity: terms are large, and live in the site

    def of(self, one: Obligation) -> str:
        key = (id(one.conclusion), id(one.clause) if envelope_about(one) else 0)
        if key not in self._known:
            self._known[key] = boundary_of(one, self._site, self._oracle.hurried(10))
        return self._known[key]


def _explained(finding: Finding, repair: str, oracle: Oracle) -> Finding:
    one = finding.obligation
    if finding.verdict in (Verdict.PROVED, Verdict.UNKNOWN):
        return finding
    primary, secondary = one.primary, one.secondary
    if one.claim is Claim.SOMETIMES:
        core = core_of(one, oracle.hurried(10))
        if core is not None:
            primary, secondary = labels_of_core(one, core)
    elif finding.witness is not None:
        primary, secondary = labels_of_breach(one, finding.witness)
    return replace(finding, labels=(primary, *secondary), repair=repair)
