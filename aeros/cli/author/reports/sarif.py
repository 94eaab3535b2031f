"""Verification report as SARIF 2.1.0 for code scanning: each diagnostic at its line.

The file keeps the limits of GitHub code scanning: one run of at most 25,000 results and 10 MB.  Results
beyond the limits are left out, warnings first, and a notification gives their number; the exit code of the
command counts all.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

import aeros
from aeros.cli.author.explain import pages
from aeros.cli.author.reports.result import (
    LocatedDiagnostic,
    VerifyResult,
    message_text,
    path_below_working_folder,
)
from aeros.distribution import repository
from aeros.spec.diagnostics.codes import CODES, DiagnosticCode, Fix, Severity, SpanLabel
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.diagnostics.source import SourceSpan

MAX_RESULTS: Final = 25_000
MAX_BYTES: Final = 10_000_000
_RESERVED: Final = 1_000_000  # bytes kept for rules and notifications

_SCHEMA: Final = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_SEVERITY_ORDER: Final = (Severity.ERROR, Severity.WARNING, Severity.NOTE)


def as_sarif(result: VerifyResult) -> str:
    """Render the report as a SARIF log with one run.

    Args:
        result: Report and problems of certificates.

    Returns:
        ASCII text.
    """
    problems = sorted(result.problems, key=lambda one: _SEVERITY_ORDER.index(one.diagnostic.severity))
    rules = list(dict.fromkeys(problem.diagnostic.code for problem in problems))
    fingerprints = _fingerprints(problems)
    results = [
        _result(problem, rules.index(problem.diagnostic.code), fingerprint)
        for problem, fingerprint in zip(problems, fingerprints, strict=True)
    ]
    kept = _within_limits(results)
    run = {
        "tool": {
            "driver": {
                "name": "aeros",
                "semanticVersion": aeros.__version__,
                "rules": [_rule(CODES[code]) for code in rules],
            }
        },
        "automationDetails": {"id": _category(result)},
        "columnKind": "unicodeCodePoints",
        "invocations": [
            {
                "executionSuccessful": True,
                "toolExecutionNotifications": _truncation_notice(len(results) - len(kept)),
            }
        ],
        "results": kept,
    }
    return _to_json({"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]})


def _category(result: VerifyResult) -> str:
    """Name the kind of run for code scanning: results of a later run with the same name replace these.

    Runs under different sites do not replace each other.  The slash at the end says that no run is named.
    """
    site = result.report.site
    name = site.name if site.is_readable else "unreadable-site"
    return f"aeros/verify/{quote(name, safe='')}/"


def _to_json(data: object) -> str:
    return json.dumps(data, ensure_ascii=True, separators=(",", ":"))


def _within_limits(results: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the first results, as many as the limits allow."""
    kept, room = [], MAX_BYTES - _RESERVED
    for result in results[:MAX_RESULTS]:
        room -= len(_to_json(result)) + 1
        if room < 0:
            break
        kept.append(result)
    return kept


def _truncation_notice(count: int) -> list[dict[str, Any]]:
    if count == 0:
        return []
    text = (
        f"{count} results are left out of this file, which may hold {MAX_RESULTS} results and {MAX_BYTES} "
        "bytes; the exit code counts them all, and `--format json` lists them"
    )
    return [{"level": "warning", "message": {"text": text}}]


def _rule(code: DiagnosticCode) -> dict[str, Any]:
    """Describe a code with its summary and page."""
    sentence = f"{code.summary[0].upper()}{code.summary[1:]}."
    return {
        "id": code.id,
        "name": "".join(word.capitalize() for word in code.slug.split("-")),
        "shortDescription": {"text": code.summary},
        "fullDescription": {"text": sentence},
        "helpUri": f"{repository()}/blob/main/docs/codes/{code.id}.md",
        "help": {
            "text": f"{sentence} `aeros explain {code.id}` says more.",
            "markdown": (pages() / f"{code.id}.md").read_text(encoding="utf-8"),
        },
        "defaultConfiguration": {"level": "error"},
        "properties": {"tags": [code.group]},
    }


def _result(problem: LocatedDiagnostic, rule_index: int, fingerprint: str) -> dict[str, Any]:
    diagnostic = problem.diagnostic
    result: dict[str, Any] = {
        "ruleId": diagnostic.code,
        "ruleIndex": rule_index,
        "level": diagnostic.severity.value,
        "message": {"text": _without_links(message_text(diagnostic))},
        "partialFingerprints": {"aeros/v1": fingerprint},
    }
    if diagnostic.primary is not None:
        result["locations"] = [_location(diagnostic.primary)]
    elif problem.path is not None:
        result["locations"] = [{"physicalLocation": {"artifactLocation": {"uri": _uri(problem.path)}}}]
    if diagnostic.secondary:
        result["relatedLocations"] = [
            _location(label) | {"id": n} for n, label in enumerate(diagnostic.secondary, 1)
        ]
    if diagnostic.fix is not None:
        result["fixes"] = [_fix(diagnostic.fix)]
    return result


def _fix(fix: Fix) -> dict[str, Any]:
    """Describe a proved repair as an edit of one file."""
    replacement = {"deletedRegion": _region(fix.span), "insertedContent": {"text": fix.text}}
    artifact = {"uri": _uri(Path(fix.span.source.path))}
    return {
        "description": {"text": _visible_text(f"write {fix.text}") if fix.text else "remove this"},
        "artifactChanges": [{"artifactLocation": artifact, "replacements": [replacement]}],
    }


def _without_links(text: str) -> str:
    """Take apart the syntax of links in SARIF."""
    return text.replace("](", "] (")


def _visible_text(text: str) -> str:
    return _without_links(escape_invisible(text))


def _location(label: SpanLabel) -> dict[str, Any]:
    span = label.span
    location: dict[str, Any] = {
        "physicalLocation": {
            "artifactLocation": {"uri": _uri(Path(span.source.path))},
            "region": _region(span),
        }
    }
    return location | {"message": {"text": _visible_text(label.text)}} if label.text else location


def _region(span: SourceSpan) -> dict[str, int]:
    """Convert a span to lines and columns from 1, with an exclusive end."""
    return {
        "startLine": span.line,
        "startColumn": span.column,
        "endLine": span.end_line,
        "endColumn": span.end_column,
    }


def _uri(path: Path) -> str:
    """Return a URI, relative to the working folder (in CI the repository's root) for files below it."""
    shortened = path_below_working_folder(path)
    quoted = quote(os.fsencode(shortened))
    return f"file://{quoted}" if shortened.is_absolute() else quoted


def _fingerprints(problems: Iterable[LocatedDiagnostic]) -> list[str]:
    """Return a fingerprint for each problem, which does not change if only lines move.

    It covers code, file, headline and underlined text; equal problems of one file are numbered.
    """
    seen: Counter[tuple[str, ...]] = Counter()
    fingerprints = []
    for problem in problems:
        diagnostic, path = problem.diagnostic, problem.path
        underlined = ""
        if diagnostic.primary is not None:
            path, underlined = Path(diagnostic.primary.span.source.path), diagnostic.primary.span.text
        key = (diagnostic.code, "" if path is None else _uri(path), diagnostic.headline, underlined)
        seen[key] += 1
        fingerprints.append(hashlib.sha256(_to_json([*key, seen[key]]).encode()).hexdigest())
    return fingerprints
