"""Claims are counted before they are read, and read at most once."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, Severity
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import StaticClaim, Verdict
from aeros.spec.verification.claim_summary import (
    ClaimCounts,
    Claims,
    ClaimSummary,
    ListedClaims,
    diagnostics_of,
    summarize_static_claim,
)

WRONG, ALSO = Diagnostic("AE404", "it"), Diagnostic("AE404", "another")


def claim(
    name: str, rule: str | None = None, boundary: str = "", problem: Diagnostic | None = None
) -> ClaimSummary:
    return ClaimSummary(ClaimForm.ACCESS_GRANTED(name), Verdict.PROVED, rule, boundary, diagnostic=problem)


A, B, C = claim("a"), claim("b", "slow", "pace <= 1"), claim("c", "slow", "pace <= 1", WRONG)
D, E = claim("d", "slow", "true"), claim("e", "near", "true")


def test_a_mistake_in_a_function_of_two_skills_is_one_diagnostic() -> None:
    again = claim("f", problem=Diagnostic("AE404", "it"))
    assert diagnostics_of([A, C, again]) == (WRONG,)


def test_a_settled_claim_keeps_its_verdict_and_its_report() -> None:
    claim_id = ClaimForm.ACCESS_GRANTED("sensors")
    assert summarize_static_claim(StaticClaim(claim_id, None)) == ClaimSummary(claim_id, Verdict.PROVED)
    refuted = summarize_static_claim(StaticClaim(claim_id, WRONG))
    assert (refuted.verdict, refuted.diagnostic, refuted.witness) == (Verdict.REFUTED, WRONG, None)
    warned = Diagnostic("AE408", "it", severity=Severity.WARNING)
    assert summarize_static_claim(StaticClaim(claim_id, warned)).verdict is Verdict.PROVED


def test_the_reports_of_claims_are_collected_in_order() -> None:
    assert diagnostics_of([A, C, B, claim("f", problem=ALSO)]) == (WRONG, ALSO)
    assert diagnostics_of([]) == ()


def test_claims_left_to_the_gate_are_counted_by_rule_and_boundary() -> None:
    counts = Claims.from_claims([A, B, D, C, E]).tally
    assert counts == ClaimCounts(5, (("slow", "pace <= 1", 2), ("slow", "true", 1), ("near", "true", 1)))
    assert Claims.from_claims([]).tally == ClaimCounts(0)


def test_claims_are_a_sequence() -> None:
    claims = Claims.from_claims(iter([A, B, C]))
    assert (len(claims), list(claims), claims[1], claims[-1], claims[1:]) == (3, [A, B, C], B, C, (B, C))
    assert B in claims
    with pytest.raises(IndexError):
        claims[3]


def test_claims_are_read_at_the_first_use_and_only_then() -> None:
    read: list[int] = []

    def reader() -> list[ClaimSummary]:
        read.append(1)
        return [A, B]

    claims = Claims(ClaimCounts(2), reader)
    assert (len(claims), claims.tally.claims, read) == (2, 2, [])
    assert [*claims, *claims] == [A, B, A, B]
    assert read == [1]


def test_a_module_s_own_claims_are_counted_together_and_read_in_two_parts() -> None:
    own = ListedClaims((A, B), (C,))
    assert own.tally == ClaimCounts(3, (("slow", "pace <= 1", 2),))
    assert own.read() == ((A, B), (C,))
    assert (ListedClaims().tally, ListedClaims().read()) == (ClaimCounts(0), ((), ()))
