"""Explanation of findings: the cause of each failure, a repair, and the boundary of each runtime check."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from aeros.spec.backends.oracle import Oracle
from aeros.spec.model.site import Site
from aeros.spec.obligations.obligation import ClaimMode, Obligation
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.discharge import ObligationResult
from aeros.spec.verification.gate_boundary import gate_boundaries, relevant_envelope
from aeros.spec.verification.repairs.repair import Repair, find_repairs
from aeros.spec.verification.unsat_core import (
    find_unsat_core,
    label_core,
    label_edited_conjunct,
    label_violated_conjuncts,
)


def explain_findings(
    findings: Iterable[ObligationResult], site: Site, oracle: Oracle, readable: frozenset[str] = frozenset()
) -> tuple[ObligationResult, ...]:
    """Explain findings: label the conditions at fault, repair envelopes and describe gate boundaries.

    Verdicts and witnesses stay as they are; proved claims need no work.

    Args:
        findings: results of obligations.
        site: the site.
        oracle: solver with its budget.
        readable: names of the state variables that a repair may read.

    Returns:
        The same results with labels, repairs and boundaries.
    """
    listed = list(findings)
    repairs = find_repairs(listed, site, oracle, readable)
    # By identity: terms are large, and the obligations keep them alive. Most rules share no variable with an
    # envelope, and then one boundary is that of every envelope.
    keys = [_boundary_key(one.obligation) if one.is_runtime_checked else None for one in listed]
    described = {key: one.obligation for key, one in zip(keys, listed, strict=True) if key is not None}
    texts = gate_boundaries(list(described.values()), site, oracle.with_reduced_budget(10))
    boundaries = dict(zip(described, texts, strict=True))
    return tuple(
        replace(one, boundary=boundaries[key])
        if key is not None
        else _explain_finding(one, repairs.get(one.obligation.id), oracle)
        for key, one in zip(keys, listed, strict=True)
    )


def _boundary_key(obligation: Obligation) -> tuple[int, int]:
    return id(obligation.conclusion), id(obligation.clause) if relevant_envelope(obligation) else 0


def _explain_finding(finding: ObligationResult, repair: Repair | None, oracle: Oracle) -> ObligationResult:
    one = finding.obligation
    if finding.verdict in (Verdict.PROVED, Verdict.UNKNOWN):
        return finding
    primary, secondary = one.primary, one.secondary
    if one.mode is ClaimMode.SOMETIMES:
        core = find_unsat_core(one, oracle.with_reduced_budget(10))
        if core is not None:
            primary, secondary = label_core(one, core)
    elif finding.witness is not None:
        primary, secondary = label_violated_conjuncts(one, finding.witness)
        if repair is not None and repair.fix is not None and one.clause is not None:
            primary = label_edited_conjunct(one.clause, repair.fix, primary)
    found = replace(finding, labels=(primary, *secondary))
    return found if repair is None else replace(found, repair=repair.line, fix=repair.fix)
