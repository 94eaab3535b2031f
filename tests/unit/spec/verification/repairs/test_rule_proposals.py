"""Candidates for rules and starts change one place of a manifest, and no comment is lost."""

from __future__ import annotations

import pytest

from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.obligations.claim_id import ClaimForm, ClaimId
from aeros.spec.obligations.closed_loop import closed_loop_obligations
from aeros.spec.obligations.verdicts import StaticClaim
from aeros.spec.verification.repairs.manifest_edit import ManifestEditor
from aeros.spec.verification.repairs.repair import FailedClaim
from aeros.spec.verification.repairs.rule_proposals import RuleProposals
from tests.repo.tree import ROOT

CORPUS = ROOT / "tests" / "corpus"


def candidates(case: str, claim: ClaimId) -> dict[str, str]:
    """Lines of the candidates for a claim that fails, each with the manifest that it makes."""
    site = load_site(CORPUS / "site" / "table.yaml", Diagnostics())
    assert site is not None
    loaded = load_ecm(CORPUS / "rejected" / "closed_loop" / case, site, Diagnostics())
    assert loaded is not None
    ecm = loaded.ecm
    (failed,) = (
        FailedClaim(one.id, one.diagnostic)
        for one in closed_loop_obligations(ecm, site.with_modules(ecm.with_owners))
        if one.id == claim and isinstance(one, StaticClaim) and one.diagnostic is not None
    )
    editor = ManifestEditor(ecm.access_span.source)
    proposals = RuleProposals(ecm, editor)
    propose = proposals.correct_start if claim.form is ClaimForm.RULES_EFFECTIVE else proposals.keep_invariant
    return {line: editor.applied(fix) for line, fix in propose(failed) if fix is not None}


@pytest.mark.parametrize(
    ("case", "claim", "lines"),
    [
        (
            "start_at_the_goal",
            ClaimForm.RULES_EFFECTIVE("tidy"),
            ["table_tidy: false` under `initial", "remove `table_tidy` from `initial`"],
        ),
        (
            "start_that_contradicts_a_definition",
            ClaimForm.RULES_EFFECTIVE("tidy"),
            [
                "table_tidy: true` under `initial",
                "remove `table_tidy` from `initial`",
                "hand_raised: false` under `initial",
                "remove `hand_raised` from `initial`",
            ],
        ),
        (
            "sponge_never_fetched",
            ClaimForm.RULES_KEEP_INVARIANT("tidy", "by-sponge"),
            ["- {unless: fetched == sponge, do: fetch}` before the rule for `tidy", "on_failure: fetch"],
        ),
        (
            "invariant_lost_by_a_recovery",
            ClaimForm.RULES_KEEP_INVARIANT("tidy_up", "no-knife"),
            [
                "between_tries: tidy",
                "between_tries: fetch",
                "remove `between_tries` from that rule",
                "on_failure: fetch",
                "on_failure: pick_up",
            ],
        ),
    ],
)
def test_each_candidate_is_one_edit(case: str, claim: ClaimId, lines: list[str]) -> None:
    found = candidates(case, claim)
    assert list(found) == lines
    before = (CORPUS / "rejected" / "closed_loop" / case / "ecm.yaml").read_text(encoding="utf-8")
    for text in found.values():
        old, new = set(before.splitlines()), set(text.splitlines())
        assert len(old - new) <= 1
        assert len(new - old) <= 1
        assert text.count("#") == before.count("#")
