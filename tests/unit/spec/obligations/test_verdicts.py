"""Verdicts are compared, and never asked for their truth."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, Severity
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import Conclusion, StaticClaim, Verdict


@pytest.mark.parametrize("one", [*Verdict, *Conclusion])
def test_a_verdict_has_no_truth_value(one: Verdict | Conclusion) -> None:
    noun = "verdict" if isinstance(one, Verdict) else "conclusion"
    with pytest.raises(TypeError, match=f"^a {noun} has no truth value; compare it$"):
        bool(one)


def test_a_claim_is_refuted_by_an_error_alone() -> None:
    claim_id = ClaimForm.ACCESS_GRANTED("sensors")
    assert StaticClaim(claim_id, None).verdict is Verdict.PROVED
    assert StaticClaim(claim_id, Diagnostic("AE404", "it")).verdict is Verdict.REFUTED
    for severity in (Severity.WARNING, Severity.NOTE):
        diagnostic = Diagnostic("AE404", "it", severity=severity)
        assert StaticClaim(claim_id, diagnostic).verdict is Verdict.PROVED


def test_a_claim_is_unknown_if_it_is_undecided_or_left_to_run_time() -> None:
    claim_id = ClaimForm.ACCESS_GRANTED("sensors")
    assert StaticClaim(claim_id, Diagnostic("AE509", "it")).verdict is Verdict.UNKNOWN
    assert StaticClaim(claim_id, None, runtime_checked_rule="it").verdict is Verdict.UNKNOWN
