"""The report for a person at a terminal: every diagnostic, then a line for each subject."""

from __future__ import annotations

from aeros.cli.author.reports.result import Result
from aeros.spec.diagnostics.render import render_text, safe
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.reports import SubjectReport


def as_text(result: Result, *, colour: bool = False) -> str:
    """The report as lines; none of them holds a character that could fool a terminal."""
    parts = [render_text(problem.diagnostic, colour=colour) for problem in result.problems]
    width = max(len(safe(subject.name)) for subject in result.subjects)
    lines = [_summary(subject, width) for subject in result.subjects if subject.name]
    after = [*_boundaries(result), *_agreement(result)]
    return "\n".join([*(part.rstrip("\n") + "\n" for part in parts), *lines, *after])


def _boundaries(result: Result) -> list[str]:
    """A line for each rule that the gate decides of a proved module, and for each way it then reads."""
    proved = (subject for subject in result.subjects if subject.conclusion is Conclusion.PROVED)
    pairs = dict.fromkeys(pair for subject in proved for pair in subject.boundaries)
    shown = [(safe(rule), safe(boundary)) for rule, boundary in pairs]
    width = max((len(rule) for rule, _ in shown), default=0)
    lines = [f"  {rule:{width}}  {boundary}" for rule, boundary in shown]
    return ["", "the gate allows while", *lines] if lines else []


def _agreement(result: Result) -> list[str]:
    """What a second solver came to, where one was asked."""
    found = result.report.agreement
    if found is None:
        return []
    said = f"{found.solver} agreed on {found.agreed} of {found.questions} questions"
    if not found.undecided:
        return ["", said]
    beyond = [f"  {safe(about)}: {safe(reason)}" for about, reason in found.undecided]
    return ["", f"{said}; {len(beyond)} undecided by it, where Z3's word stands:", *beyond]


def _summary(subject: SubjectReport, width: int) -> str:
    name, conclusion = safe(subject.name), subject.conclusion.value
    line = f"{name:{width}}  {conclusion:9}  {subject.obligation_count:4} obligations"
    if subject.conclusion is Conclusion.PROVED and subject.guarded_count:
        rules = dict.fromkeys(rule for rule, _ in subject.boundaries)
        line += f", {subject.guarded_count} guarded: the gate decides {', '.join(rules)}"
    return line
