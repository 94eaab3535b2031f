"""Verification report as JSON; `aeros schema report` prints its schema."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, Final

from aeros.cli.author.reports.result import VerifyResult
from aeros.spec.diagnostics.render import render_json
from aeros.spec.verification.reports import SubjectReport

SCHEMA: Final = "aeros/report/1"
"""Changes with each change that breaks programs that read reports."""


def as_json(result: VerifyResult) -> str:
    """Render the report as JSON.

    Args:
        result: Report and problems of certificates.

    Returns:
        ASCII text.
    """
    data: dict[str, Any] = {
        "schema": SCHEMA,
        "conclusion": result.report.conclusion.value,
        "site": _subject(result.report.site),
        "modules": [_subject(module) for module in result.report.modules],
        "certificates": [render_json(problem.diagnostic) for problem in result.certificates],
    }
    if result.report.configuration is not None:
        data["configuration"] = _subject(result.report.configuration)
    agreement = result.report.agreement
    if agreement is not None:
        data["second_solver"] = {
            "solver": agreement.solver,
            "questions": agreement.query_count,
            "agreed": agreement.agreed_count,
            "undecided": _reasons(agreement.undecided_queries),
        }
    loops = result.report.listed_loops
    if loops is not None:
        data["listed_loops"] = {
            "certified": loops.certified,
            "uncertified": _reasons(loops.uncertified),
        }
    encodings = result.report.encodings
    if encodings is not None:
        data["encodings"] = {
            "questions": encodings.question_count,
            "truths": encodings.truth_count,
            "unread": _reasons(encodings.unread_questions),
        }
    return json.dumps(data, indent=1, ensure_ascii=True)


def _reasons(questions: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    return [{"about": about, "reason": reason} for about, reason in questions]


def _subject(subject: SubjectReport) -> dict[str, Any]:
    verdicts: list[dict[str, Any]] = [
        {
            "id": str(one.id),
            "verdict": one.verdict.value,
            "guarded": one.runtime_checked_rule is not None,
            **({} if one.witness is None else {"witness": list(one.witness)}),
            **({"boundary": one.boundary} if one.boundary else {}),
        }
        for one in subject.claims
    ]
    return {
        "name": subject.name,
        "path": str(subject.path),
        "conclusion": subject.conclusion.value,
        "obligations": verdicts,
        **({"left_out": list(subject.left_out)} if subject.left_out else {}),
        "diagnostics": [render_json(problem) for problem in subject.diagnostics],
    }
