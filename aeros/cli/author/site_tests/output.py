"""Results of site tests as text, JSON or JUnit XML."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from aeros.cli.author.site_tests.cases import CaseResult
from aeros.spec.diagnostics.render import escape_invisible

SCHEMA: Final = "aeros/test-report/1"

Results = Sequence[tuple[Path, Sequence[CaseResult]]]
"""Results of each file."""


def as_text(results: Results, *, is_verbose: bool) -> str:
    """Render the results for people: each failure with its place, then counts.

    Args:
        results: Results of each file.
        is_verbose: True to list the tests that passed, too.

    Returns:
        Lines of text.
    """
    lines = []
    for _, cases in results:
        for one in cases:
            if one.is_passed and not is_verbose:
                continue
            place = f"{one.case.span.source.path}:{one.case.span.line}"
            word = "pass" if one.is_passed else "FAIL"
            lines.append(f"{word}  {escape_invisible(place)}  {escape_invisible(one.case.name)}")
            lines += [f"      {escape_invisible(problem)}" for problem in one.problems]
    every = [one for _, cases in results for one in cases]
    passed = sum(one.is_passed for one in every)
    return "\n".join([*lines, f"{passed} passed, {len(every) - passed} failed"])


def as_json(results: Results) -> str:
    """Render the results as JSON.

    Args:
        results: Results of each file.

    Returns:
        ASCII text: `schema`, counts, and each test with its file, line, name and problems.
    """
    tests: list[dict[str, Any]] = [
        {
            "file": str(path),
            "line": one.case.span.line,
            "name": one.case.name,
            "passed": one.is_passed,
            "problems": list(one.problems),
        }
        for path, cases in results
        for one in cases
    ]
    passed = sum(one["passed"] for one in tests)
    data = {"schema": SCHEMA, "passed": passed, "failed": len(tests) - passed, "tests": tests}
    return json.dumps(data, indent=1, ensure_ascii=True)


def as_junit(results: Results) -> str:
    """Render the results as JUnit XML: a suite for each file, a case for each test.

    Args:
        results: Results of each file.

    Returns:
        A well-formed ASCII document.
    """
    root = ET.Element("testsuites", name="aeros test")
    for path, cases in results:
        name = escape_invisible(str(path))
        failed = sum(not one.is_passed for one in cases)
        counts = {"tests": str(len(cases)), "failures": str(failed), "errors": "0", "skipped": "0"}
        suite = ET.SubElement(root, "testsuite", {"name": name, **counts})
        for one in cases:
            case = ET.SubElement(suite, "testcase", classname=name, name=escape_invisible(one.case.name))
            if not one.is_passed:
                problems = [escape_invisible(problem) for problem in one.problems]
                failure = ET.SubElement(case, "failure", message=problems[0])
                failure.text = "\n".join(problems)
    ET.indent(root)
    encoded: bytes = ET.tostring(root, encoding="us-ascii", xml_declaration=True)
    return encoded.decode("ascii")
