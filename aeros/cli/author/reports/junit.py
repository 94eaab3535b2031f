"""Verification report as JUnit XML: a test suite for each subject, a test case for each obligation.

The counts are those of the text: a suite has as many cases as the text has obligations, and as many cases
fail as the text has errors.  A runtime-checked obligation passes, with a note.  An obligation that is not
proved for the reason of another one, such as a rule in an empty envelope, is skipped.  Errors without an
obligation, such as a file that cannot be read, are cases of a suite `NAME: files`.  The document is ASCII, so
that every tool can read it, and holds no times.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable, Iterator

from aeros.cli.author.reports.result import LocatedDiagnostic, VerifyResult
from aeros.spec.diagnostics.codes import Diagnostic, Severity
from aeros.spec.diagnostics.render import escape_invisible, render_all
from aeros.spec.obligations.verdicts import Verdict
from aeros.spec.verification.reports import SubjectReport


def as_junit(result: VerifyResult) -> str:
    """Render the report as JUnit XML.

    Args:
        result: Report and problems of certificates.

    Returns:
        A well-formed ASCII document, for any content of the files.
    """
    root = ET.Element("testsuites", name="aeros verify")
    for subject in result.subjects:
        root.extend(_suites(subject))
    if result.certificates:
        root.append(_certificates(result.certificates))
    for suite in root:
        _count(suite)
    ET.indent(root)
    encoded: bytes = ET.tostring(root, encoding="us-ascii", xml_declaration=True)
    return encoded.decode("ascii")


def _suites(subject: SubjectReport) -> Iterator[ET.Element]:
    """Yield the suite of a subject's obligations, and one of its other errors if it has any."""
    name = escape_invisible(subject.name) or "paths"
    suite = ET.Element("testsuite", name=name)
    unreported = Counter(subject.diagnostics)
    for one in subject.claims:
        case = _case(suite, name, str(one.id))
        if one.diagnostic is not None and unreported[one.diagnostic] > 0:
            unreported[one.diagnostic] -= 1
            _add_diagnostic(case, one.diagnostic, "error" if one.verdict is Verdict.UNKNOWN else "failure")
        elif one.diagnostic is not None:
            reason = f"not proved, for the reason of another obligation: {_headline(one.diagnostic)}"
            ET.SubElement(case, "skipped", message=reason)
        elif one.runtime_checked_rule is not None:
            _add_runtime_checked(case, one.runtime_checked_rule, one.boundary)
    others = list(unreported.elements())
    remarks = [found for found in others if found.severity is not Severity.ERROR]
    if remarks:
        ET.SubElement(suite, "system-out").text = render_all(remarks)
    yield suite
    errors = [found for found in others if found.severity is Severity.ERROR]
    if errors:
        yield _error_suite(f"{name}: files", errors)


def _error_suite(name: str, errors: list[Diagnostic]) -> ET.Element:
    suite = ET.Element("testsuite", name=name)
    counts = Counter(found.code for found in errors)
    numbers: Counter[str] = Counter()
    for found in errors:
        numbers[found.code] += 1
        number = f" {numbers[found.code]}" if counts[found.code] > 1 else ""
        _add_diagnostic(_case(suite, name, f"{found.code}{number}"), found)
    return suite


def _add_runtime_checked(case: ET.Element, rule: str, boundary: str) -> None:
    guard = escape_invisible(rule)
    properties = ET.SubElement(case, "properties")
    ET.SubElement(properties, "property", name="guarded", value=guard)
    note = f"not proved; `{guard}` is runtime-checked"
    allowed = f"; allowed while {escape_invisible(boundary)}" if boundary else ""
    ET.SubElement(case, "system-out").text = note + allowed


def _certificates(problems: Iterable[LocatedDiagnostic]) -> ET.Element:
    suite = ET.Element("testsuite", name="certificates")
    for problem in problems:
        _add_diagnostic(_case(suite, "certificates", str(problem.path)), problem.diagnostic)
    return suite


def _case(suite: ET.Element, subject: str, name: str) -> ET.Element:
    return ET.SubElement(suite, "testcase", classname=subject, name=escape_invisible(name))


def _add_diagnostic(case: ET.Element, diagnostic: Diagnostic, kind: str = "failure") -> None:
    """Add a diagnostic to a case: an error fails it, anything less is output."""
    if diagnostic.severity is not Severity.ERROR:
        ET.SubElement(case, "system-out").text = render_all([diagnostic])
        return
    element = ET.SubElement(case, kind, type=diagnostic.code, message=_headline(diagnostic))
    element.text = render_all([diagnostic])


def _headline(diagnostic: Diagnostic) -> str:
    return escape_invisible(diagnostic.headline)


def _count(suite: ET.Element) -> None:
    suite.set("tests", str(len(suite.findall("testcase"))))
    suite.set("failures", str(len(suite.findall("testcase/failure"))))
    suite.set("errors", str(len(suite.findall("testcase/error"))))
    suite.set("skipped", str(len(suite.findall("testcase/skipped"))))
