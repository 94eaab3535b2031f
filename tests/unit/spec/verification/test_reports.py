"""Reports on a site, on modules and on all of them together."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, Severity
from aeros.spec.diagnostics.errors import InternalError, UserError
from aeros.spec.model.summary import ModuleSummary, SiteSummary, summarize_module, summarize_site
from aeros.spec.obligations.claim_id import ClaimForm
from aeros.spec.obligations.verdicts import Conclusion, StaticClaim, Verdict
from aeros.spec.verification.claim_summary import Claims, ClaimSummary, ListedClaims
from aeros.spec.verification.reports import (
    Known,
    ModuleFindings,
    Report,
    SubjectReport,
    certificate_verdicts,
    conclusion_of,
    configuration_report,
    dependency_candidates,
    missing_module_report,
    module_report,
    unreadable_site_report,
    with_required,
)
from tests.unit.agent.dumplings import build
from tests.unit.spec.obligations.data.tidier import module, site

ERROR, UNDECIDED = Diagnostic("AE501", "breach"), Diagnostic("AE509", "undecided")
UNANALYSED, WARNING = Diagnostic("AE803", "rules"), Diagnostic("AE505", "needless", severity=Severity.WARNING)
FOLDER = Path("some/tidier")


def claim(name: str, rule: str | None = None, boundary: str = "") -> ClaimSummary:
    verdict = Verdict.PROVED if rule is None else Verdict.REFUTED
    return ClaimSummary(ClaimForm.ACCESS_GRANTED(name), verdict, rule, boundary)


ACYCLIC = ClaimForm.DEPENDENCIES_ACYCLIC()
A, B, C = claim("a"), claim("b", "slow", "pace <= 1"), claim("c", "slow", "pace <= 1")


@pytest.mark.parametrize(
    ("problems", "conclusion"),
    [
        ((), "proved"),
        ((WARNING,), "proved"),
        ((UNDECIDED, WARNING), "undecided"),
        ((UNDECIDED, UNANALYSED), "undecided"),
        ((UNDECIDED, ERROR), "rejected"),
        ((ERROR,), "rejected"),
    ],
)
def test_errors_reject_unless_all_are_of_what_is_undecided(
    problems: tuple[Diagnostic, ...], conclusion: str
) -> None:
    assert conclusion_of(problems) is Conclusion(conclusion)


def subject(name: str, conclusion: Conclusion, *claims: ClaimSummary) -> SubjectReport:
    return SubjectReport(name, Path(name), conclusion, (), Claims.from_claims(claims))


def test_a_subject_counts_its_claims_and_what_the_gate_decides() -> None:
    one = subject("it", Conclusion.PROVED, A, B, C, claim("d", "near", "true"))
    assert (one.claim_count, one.runtime_checked_count, one.certificate) == (4, 3, None)
    assert one.boundaries == (("slow", "pace <= 1"), ("near", "true"))
    assert (
        subject("it", Conclusion.PROVED).claim_count,
        SubjectReport("", Path(), Conclusion.PROVED, ()).claim_count,
    ) == (0, 0)


def test_a_report_is_as_bad_as_its_worst_subject() -> None:
    good, open_, bad = (
        subject(one.value, one) for one in (Conclusion.PROVED, Conclusion.UNDECIDED, Conclusion.REJECTED)
    )
    assert Report(good, (), None).conclusion is Conclusion.PROVED
    assert Report(good, (open_, good), None).conclusion is Conclusion.UNDECIDED
    assert Report(good, (open_, bad), None).conclusion is Conclusion.REJECTED
    assert Report(good, (good,), None, bad).conclusion is Conclusion.REJECTED
    assert Report(good, (open_,), None, bad).subjects == (good, open_, bad)
    assert Report(good, (open_,), None).subjects == (good, open_)


def test_unreadable_input_is_rejected_with_its_reason() -> None:
    report = unreadable_site_report(FOLDER, UserError([ERROR]))
    assert (report.name, report.path, report.conclusion, report.diagnostics) == (
        str(FOLDER), FOLDER, Conclusion.REJECTED, (ERROR,)
    )  # fmt: skip


def test_paths_without_a_module_are_reported_together_if_that_is_an_error() -> None:
    sink = Diagnostics()
    assert missing_module_report(sink) == ()
    sink.report(WARNING)
    assert missing_module_report(sink) == ()
    sink.report(ERROR)
    (report,) = missing_module_report(sink)
    assert (report.conclusion, set(report.diagnostics)) == (Conclusion.REJECTED, {WARNING, ERROR})


SUMMARY = summarize_module(module())
SITE = summarize_site(site())


def report_of(
    one: ModuleFindings, co_installed: Mapping[str, ModuleSummary] | None = None, at: SiteSummary = SITE
) -> SubjectReport:
    return module_report(FOLDER, one, at, {} if co_installed is None else co_installed)


def test_a_module_that_cannot_be_read_is_reported_by_its_folder() -> None:
    report = report_of(ModuleFindings(None, (ERROR,)))
    assert (report.name, report.conclusion, report.diagnostics) == (
        str(FOLDER),
        Conclusion.REJECTED,
        (ERROR,),
    )


def test_a_proved_module_has_a_certificate_of_all_its_claims() -> None:
    report = report_of(ModuleFindings(SUMMARY, (), ListedClaims((A,), (B,)), (WARNING,)))
    assert (report.name, report.conclusion, report.diagnostics) == ("tidier", Conclusion.PROVED, (WARNING,))
    first, *between, last = report.claims
    assert (first, last, [str(one.id) for one in between]) == (A, B, [str(ACYCLIC)])
    assert report.runtime_checked_count == 1
    assert report.certificate is not None
    assert report.certificate.obligations == {A.id: "PROVED", ACYCLIC: "PROVED", B.id: "GUARDED"}


def test_a_module_that_is_not_proved_has_no_certificate() -> None:
    for problem, conclusion in ((ERROR, Conclusion.REJECTED), (UNDECIDED, Conclusion.UNDECIDED)):
        for one in (ModuleFindings(SUMMARY, (problem,)), ModuleFindings(SUMMARY, last_problems=(problem,))):
            report = report_of(one)
            assert (report.conclusion, report.lock) == (conclusion, None)


def test_claims_about_other_modules_come_between_and_can_reject() -> None:
    asks = summarize_module(
        module(
            (
                'dependencies:\n  aeros: ">=0.1"',
                'dependencies:\n  aeros: ">=0.1"\n  modules: {helper: ">=1.0"}',
            )
        )
    )
    findings = ModuleFindings(asks, (WARNING,), ListedClaims((A,), (B,)), (WARNING,))
    alone = report_of(findings)
    assert alone.conclusion is Conclusion.REJECTED
    assert [one.code for one in alone.diagnostics] == ["AE505", "AE301", "AE505"]
    helper = replace(SUMMARY, id="helper")
    among = report_of(findings, {"helper": helper})
    assert among.conclusion is Conclusion.PROVED
    claims = list(among.claims)
    assert (claims[0], claims[-1], len(claims)) == (A, B, among.claim_count)
    assert len(claims) > 2


def test_full_findings_are_passed_on_in_order() -> None:
    ecm = module()
    first, last = (StaticClaim(one.id, None) for one in (A, B))
    report = report_of(ModuleFindings(SUMMARY, findings=(ecm, (first,), (last,), ())))
    assert (report.ecm, report.findings) == (ecm, ())
    assert [one.id for one in report.static_claims] == [A.id, ACYCLIC, B.id]
    assert report_of(ModuleFindings(SUMMARY)).ecm is None


def test_two_claims_of_one_identity_are_an_error_of_our_own() -> None:
    assert certificate_verdicts([A, B]) == {A.id: "PROVED", B.id: "GUARDED"}
    with pytest.raises(InternalError, match="two claims have one identity: permission/access/a"):
        certificate_verdicts([A, B, A])


def test_one_module_is_no_configuration() -> None:
    assert configuration_report([SUMMARY], SITE) is None
    assert configuration_report([], SITE) is None


def test_several_modules_are_reported_together() -> None:
    report = configuration_report([SUMMARY, replace(SUMMARY, id="other")], SITE)
    assert report is not None
    assert report.claim_count > 0
    again = configuration_report([SUMMARY, SUMMARY], SITE)
    assert again is not None
    assert again.conclusion is Conclusion.REJECTED


def test_earlier_findings_are_none_unless_given() -> None:
    assert (Known().site, dict(Known().modules)) == (None, {})


def test_modules_nearby_are_read_only_where_a_module_asks_for_others(tmp_path: Path) -> None:
    for name in ("asker", "neighbour", "unreadable", "empty"):
        (tmp_path / name).mkdir()
    for name in ("asker", "neighbour", "unreadable"):
        (tmp_path / name / "ecm.yaml").write_text("")
    shutil.copytree(tmp_path / "neighbour", tmp_path / "elsewhere" / "neighbour")
    read: list[str] = []

    def reader(folder: Path) -> ModuleSummary | None:
        read.append(folder.name)
        return None if folder.name == "unreadable" else replace(SUMMARY, id=folder.name)

    alone = {tmp_path / "asker": SUMMARY}
    assert dependency_candidates(alone, reader) == {"tidier": SUMMARY}
    assert read == []
    asks = summarize_module(
        module(
            (
                'dependencies:\n  aeros: ">=0.1"',
                'dependencies:\n  aeros: ">=0.1"\n  modules: {helper: ">=1.0"}',
            )
        )
    )
    found = dependency_candidates({tmp_path / "asker": asks}, reader)
    assert (set(found), read) == ({"tidier", "neighbour"}, ["neighbour", "unreadable"])
    given = replace(SUMMARY, id="neighbour", version="9.0")
    both = dependency_candidates(
        {tmp_path / "asker": asks, tmp_path / "elsewhere" / "neighbour": given}, reader
    )
    assert both["neighbour"] is given


def test_modules_that_others_require_are_added_once_and_only_those() -> None:
    summaries = {
        name: build(ModuleSummary, id=name, requires=dict.fromkeys(required, ">=1"))
        for name, required in (("a", ("b", "missing")), ("b", ("c", "a")), ("c", ()), ("d", ()))
    }
    found = with_required([summaries["a"], summaries["c"]], summaries)
    assert [one.id for one in found] == ["a", "c", "b"]
