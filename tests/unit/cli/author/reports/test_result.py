"""The result of `aeros verify`: every diagnostic with its file, in the order of subjects."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from aeros.cli.author.reports.result import LocatedDiagnostic, VerifyResult
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.reports import Report, SubjectReport


def problem(text: str) -> Diagnostic:
    return Diagnostic("AE101", text)


SITE = SubjectReport("site", Path("site.yaml"), Conclusion.PROVED, (problem("of the site"),))
ONE = SubjectReport("one", Path("ecms/one"), Conclusion.REJECTED, (problem("first"), problem("second")))
TWO = SubjectReport("two", Path("ecms/two"), Conclusion.PROVED, ())
UNREAD = SubjectReport("", Path("ecms"), Conclusion.REJECTED, (problem("no module"),))
TOGETHER = SubjectReport("configuration", Path("ecms"), Conclusion.REJECTED, (problem("of both"),))
LOCK = LocatedDiagnostic(problem("stale"), Path("ecms/two/ecm.lock"))


def reported(result: VerifyResult) -> list[tuple[str, str | None]]:
    return [(one.diagnostic.headline, None if one.path is None else str(one.path)) for one in result.problems]


def test_problems_come_by_subject_with_their_files_and_certificates_last() -> None:
    result = VerifyResult(Report(SITE, (ONE, TWO, UNREAD), None, TOGETHER), (LOCK,))
    assert reported(result) == [
        ("of the site", "site.yaml"),
        ("first", "ecms/one/ecm.yaml"),
        ("second", "ecms/one/ecm.yaml"),
        ("no module", None),
        ("of both", None),
        ("stale", "ecms/two/ecm.lock"),
    ]


def test_a_single_module_makes_no_configuration() -> None:
    result = VerifyResult(Report(replace(SITE, diagnostics=()), (TWO,), None))
    assert reported(result) == []
    assert [subject.name for subject in result.subjects] == ["site", "two"]


def test_the_configuration_is_the_last_subject() -> None:
    result = VerifyResult(Report(SITE, (ONE, TWO), None, TOGETHER))
    assert [subject.name for subject in result.subjects] == ["site", "one", "two", "configuration"]
