"""Verification report as JUnit XML: a test suite for each subject, a test case for each obligation.

A runtime-checked obligation passes, with a note.  Diagnostics without an obligation, such as a file that
cannot be read, fail the case `form/readable` of their subject.  The file is ASCII, so that every tool can
read it, and holds no times.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

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
        root.append(_suite(subject))
    if result.certificates:
        root.append(_certificates(result.certificates))
    for suite in root:
        _count(suite)
    ET.indent(root)
    encoded: bytes = ET.tostring(root, encoding="us-ascii", xml_declaration=True)
    return encoded.decode("ascii")


def _suite(subject: SubjectReport) -> ET.Element:
    name = escape_invisible(subject.name) or "paths"
    suite = ET.Element("testsuite", name=name)
    reported: set[Diagnostic] = set()
    for one in subject.claims:
        case = _case(suite, name, str(one.id))
        if one.diagnostic is not None:
            reported.add(one.diagnostic)
            _add_diagnostic(case, one.diagnostic, "error" if one.verdict is Verdict.UNKNOWN else "failure")
        elif one.runtime_checked_rule is not None:
            _add_runtime_checked(case, one.runtime_checked_rule, one.boundary)
    _add_other_diagnostics(suite, name, [found for found in subject.diagnostics if found not in reported])
    return suite


def _add_runtime_checked(case: ET.Element, rule: str, boundary: str) -> None:
    guard = escape_invisible(rule)
    properties = ET.SubElement(case, "properties")
    ET.SubElement(properties, "property", name="guarded", value=guard)
    note = f"not proved; `{guard}` is runtime-checked"
    allowed = f"; allowed while {escape_invisible(boundary)}" if boundary else ""
    ET.SubElement(case, "system-out").text = note + allowed


def _add_other_diagnostics(suite: ET.Element, name: str, others: list[Diagnostic]) -> None:
    """Add diagnostics without an obligation: errors fail a case of their own, the rest is output."""
    case = _case(suite, name, "form/readable")
    errors = [found for found in others if found.severity is Severity.ERROR]
    if errors:
        failure = ET.SubElement(case, "failure", type=errors[0].code, message=_headline(errors[0]))
        failure.text = render_all(errors)
    remarks = [found for found in others if found.severity is not Severity.ERROR]
    if remarks:
        ET.SubElement(suite, "system-out").text = render_all(remarks)


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
    suite.set("skipped", "0")
