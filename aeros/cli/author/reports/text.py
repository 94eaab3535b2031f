"""Verification report for a terminal: all diagnostics, then one line for each subject."""

from __future__ import annotations

from collections.abc import Sequence

from aeros.cli.author.reports.result import VerifyResult
from aeros.spec.diagnostics.render import escape_invisible, render_text
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.reports import SubjectReport


def as_text(result: VerifyResult, *, colour: bool = False) -> str:
    """Render the report as text without characters that could mislead a terminal.

    Args:
        result: Report and problems of certificates.
        colour: True to use ANSI colours.

    Returns:
        Lines of text.
    """
    parts = [render_text(problem.diagnostic, colour=colour) for problem in result.problems]
    width = max(len(escape_invisible(subject.name)) for subject in result.subjects)
    lines = [_summary(subject, width) for subject in result.subjects if subject.name]
    after = [*_boundaries(result), *_left_out(result), *_agreement(result)]
    return "\n".join([*(part.rstrip("\n") + "\n" for part in parts), *lines, *after])


def _boundaries(result: VerifyResult) -> list[str]:
    """List the runtime-checked rules of proved modules with the conditions that remain to be checked."""
    proved = (subject for subject in result.subjects if subject.conclusion is Conclusion.PROVED)
    pairs = dict.fromkeys(pair for subject in proved for pair in subject.boundaries)
    # What is checked without the gate, such as the bound of a model, has no condition of the gate.
    shown = [(escape_invisible(rule), escape_invisible(boundary)) for rule, boundary in pairs if boundary]
    width = max((len(rule) for rule, _ in shown), default=0)
    lines = [f"  {rule:{width}}  {boundary}" for rule, boundary in shown]
    return ["", "the gate allows while", *lines] if lines else []


def _left_out(result: VerifyResult) -> list[str]:
    """List outcomes of probability 0 of proved modules: no proof about a task holds after one."""
    lines = [
        f"  {escape_invisible(subject.name)}: {', '.join(map(escape_invisible, subject.left_out))}"
        for subject in result.subjects
        if subject.conclusion is Conclusion.PROVED and subject.left_out
    ]
    return ["", "tasks are proved without these outcomes, of probability 0", *lines] if lines else []


def _agreement(result: VerifyResult) -> list[str]:
    """Summarize the answers of a second solver, if there was one."""
    found = result.report.agreement
    if found is None:
        return []
    agreement = f"{found.solver} agreed on {found.agreed_count} of {found.query_count} questions"
    if not found.undecided_queries:
        return ["", agreement, *_listed_loops(result), *_encodings(result)]
    beyond = _listed(found.undecided_queries)
    undecided = f"{agreement}; {len(beyond)} undecided by it (Z3's verdict used):"
    return ["", undecided, *beyond, *_listed_loops(result), *_encodings(result)]


def _listed_loops(result: VerifyResult) -> list[str]:
    """Summarize the second proofs of closed loops, if there were any."""
    found = result.report.listed_loops
    if found is None or not (found.certified or found.uncertified):
        return []
    total = found.certified + len(found.uncertified)
    line = (
        f"{found.certified} of {total} closed loops whose states were listed are proved by a certificate too"
    )
    return [f"{line}; not proved so:", *_listed(found.uncertified)] if found.uncertified else [line]


def _encodings(result: VerifyResult) -> list[str]:
    """Summarize the comparison of encodings, if there was one."""
    found = result.report.encodings
    if found is None:
        return []
    unread = _listed(found.unread_questions)
    compared = f"both encodings of {found.question_count} questions agree with the definition of the language"
    line = f"{compared}, by {found.truth_count} truth values at points"
    return [f"{line}; not read:", *unread] if unread else [line]


def _listed(questions: Sequence[tuple[str, str]]) -> list[str]:
    return [f"  {escape_invisible(about)}: {escape_invisible(reason)}" for about, reason in questions]


def _summary(subject: SubjectReport, width: int) -> str:
    name, conclusion = escape_invisible(subject.name), subject.conclusion.value
    line = f"{name:{width}}  {conclusion:9}  {subject.claim_count:4} obligations"
    if subject.conclusion is Conclusion.PROVED and subject.runtime_checked_count:
        rules = dict.fromkeys(rule for rule, _ in subject.boundaries)
        line += f", {subject.runtime_checked_count} runtime-checked: {', '.join(rules)}"
    return line
