from __future__ import annotations

import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.cli.author.reports.junit import as_junit
from aeros.cli.author.reports.result import VerifyResult
from aeros.cli.author.reports.text import as_text
from aeros.spec.diagnostics.codes import Diagnostic, Severity
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.verify import Detail, verify
from tests.repo.tree import ROOT
from tests.unit.cli.author.reports.results import RUNS, diagnostic_at, result_of, result_with


def suites_of(text: str) -> list[ET.Element]:
    assert text.isascii()
    root = ET.fromstring(text)  # noqa: S314  our own output
    assert root.tag == "testsuites"
    for suite in root:
        for attribute, found in (
            ("tests", "testcase"),
            ("failures", "testcase/failure"),
            ("errors", "testcase/error"),
            ("skipped", "testcase/skipped"),
        ):
            assert int(suite.attrib[attribute]) == len(suite.findall(found))
        names = [case.attrib["name"] for case in suite.findall("testcase")]
        assert len(set(names)) == len(names)
    return list(root)


def case_of(suite: ET.Element, name: str) -> ET.Element:
    (case,) = (case for case in suite.findall("testcase") if case.attrib["name"] == name)
    return case


@pytest.mark.parametrize("run", RUNS)
def test_each_subject_is_a_suite_and_each_obligation_a_case(run: str) -> None:
    result = result_of(run)
    suites = suites_of(as_junit(result))
    others = (": files", "certificates")
    of_subjects = [suite for suite in suites if not suite.attrib["name"].endswith(others)]
    assert len(of_subjects) == len(result.subjects)
    for subject, suite in zip(result.subjects, of_subjects, strict=True):
        ids = [one.id for one in subject.static_claims] + [one.obligation.id for one in subject.findings]
        assert [case.attrib["name"] for case in suite.findall("testcase")] == list(map(str, ids))
        failed = [found for tag in ("failure", "error") for found in suite.findall(f"testcase/{tag}")]
        files = {one.attrib["name"] for one in suites} & {f"{suite.attrib['name']}: files"}
        assert bool(failed or files) == (subject.conclusion is not Conclusion.PROVED)


_SUMMARY = re.compile(r"^(\S+) +\w+ +(\d+) obligations(?:, (\d+) runtime-checked)?", re.MULTILINE)


def assert_counts_of_text(result: VerifyResult) -> None:
    """Compare the counts in the document with those that are read off the text."""
    text, suites = as_text(result), suites_of(as_junit(result))
    of_files = [suite for suite in suites if suite.attrib["name"].endswith(": files")]
    of_subjects = [suite for suite in suites if suite not in of_files]
    of_subjects = [suite for suite in of_subjects if suite.attrib["name"] not in ("paths", "certificates")]
    for suite, (name, count, guarded) in zip(of_subjects, _SUMMARY.findall(text), strict=True):
        assert (suite.attrib["name"], suite.attrib["tests"]) == (name, count)
        passed = suite.findall(".//property[@name='guarded']")
        assert not guarded or len(passed) == int(guarded)
    failed = sum(int(suite.attrib["failures"]) + int(suite.attrib["errors"]) for suite in suites)
    assert failed == len(re.findall(r"^error\[", text, re.MULTILINE))


@pytest.mark.parametrize("run", RUNS)
def test_the_counts_are_those_of_the_text(run: str) -> None:
    assert_counts_of_text(result_of(run))


def test_the_counts_of_the_shipped_modules_are_those_of_the_text() -> None:
    report = verify([ROOT / "ecms"], reference_site_path(), detail=Detail.BRIEF)
    assert report.conclusion is Conclusion.PROVED
    assert_counts_of_text(VerifyResult(report))


def test_an_obligation_that_fails_for_the_reason_of_another_is_skipped() -> None:
    result = result_of("vacuous")
    suites = {one.attrib["name"]: one for one in suites_of(as_junit(result))}
    suite = suites["envelope_that_holds_nothing"]
    skipped = [case.attrib["name"] for case in suite.findall("testcase") if case.find("skipped") is not None]
    assert len(skipped) == int(suite.attrib["skipped"]) > 0


@pytest.mark.parametrize("run", RUNS)
def test_every_diagnostic_is_reported(run: str) -> None:
    result = result_of(run)
    reported = as_junit(result)
    for problem in result.problems:
        assert f"[{problem.diagnostic.code}]" in reported


def test_a_guarded_obligation_passes_and_says_so() -> None:
    _, module, *_ = suites_of(as_junit(result_of("accepted")))
    case = case_of(module, "safety/tidy/approach/slow-near-person")
    assert case.find("failure") is None
    reported = case.find("properties/property")
    assert reported is not None
    assert reported.attrib == {"name": "guarded", "value": "slow-near-person"}
    shown = case.findtext("system-out") or ""
    assert shown.startswith("not proved; `slow-near-person` is runtime-checked; allowed while ")


def test_a_refutation_fails_with_the_rendered_diagnostic() -> None:
    suite = next(
        one
        for one in suites_of(as_junit(result_of("rejected")))
        if one.attrib["name"] == "fast_near_a_person"
    )
    failure = case_of(suite, "safety/tidy/approach/slow-near-person").find("failure")
    assert failure is not None
    assert failure.attrib["type"] == "AE501"
    assert "| " + " " * 16 + "^^^^^^^^^^^^^^^^ allows it\n" in (failure.text or "")


def test_an_undecided_obligation_is_an_error_and_no_failure() -> None:
    for suite in suites_of(as_junit(result_of("undecided"))):
        assert suite.attrib["failures"] == "0"
        assert int(suite.attrib["errors"]) > 0
        assert {error.attrib["type"] for error in suite.findall("testcase/error")} == {"AE509"}


def test_a_file_that_cannot_be_read_fails_one_case() -> None:
    _, *modules = suites_of(as_junit(result_of("unreadable")))
    for suite, files in zip(modules[::2], modules[1::2], strict=True):
        assert suite.attrib["tests"] == "0"
        (case,) = files.findall("testcase")
        failure = case.find("failure")
        assert failure is not None
        assert case.attrib["name"] == failure.attrib["type"]


def test_a_warning_fails_nothing() -> None:
    found = diagnostic_at("a", "a", severity=Severity.WARNING)
    _, suite = suites_of(as_junit(result_with(found)))
    assert suite.attrib["failures"] == "0"
    assert "warning[AE101]" in (suite.findtext("system-out") or "")


def test_certificates_are_a_suite_of_their_own() -> None:
    *_, suite = suites_of(as_junit(result_of("accepted")))
    assert suite.attrib["name"] == "certificates"
    assert suite.attrib["failures"] == "2"


def test_there_are_no_times_and_the_same_run_gives_the_same_bytes() -> None:
    text = as_junit(result_of("vacuous"))
    elements = list(ET.fromstring(text).iter())  # noqa: S314  our own output
    assert len(elements) > 3
    assert not [one for one in elements if {"time", "timestamp"} & one.attrib.keys()]
    # In another process, where sets have another order.
    print_it = (
        "from aeros.cli.author.reports.junit import as_junit\n"
        "from tests.unit.cli.author.reports.results import result_of\n"
        "print(as_junit(result_of('vacuous')), end='')"
    )
    for seed in ("1", "2"):
        ran = subprocess.run(
            [sys.executable, "-c", print_it],
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        )
        assert ran.stdout == text


@given(st.text(st.characters(codec=None, categories=None)), st.text(st.characters(codec=None)))
def test_the_report_is_well_formed_for_all_names(name: str, headline: str) -> None:
    found = Diagnostic("AE101", headline + "]]>", notes=(name,), help=(headline,))
    path = Path(name.replace("\x00", "") or "m")
    _, _, files = suites_of(as_junit(result_with(found, name=name, path=path)))
    assert files.find("testcase/failure") is not None
