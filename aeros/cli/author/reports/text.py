"""Verification report for a terminal: diagnostics, a line for each subject, and what is left to run time."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Final

from aeros.cli.author.reports.result import VerifyResult
from aeros.cli.terminal.rendering import Cell, table_lines
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.diagnostics.render import Paint, escape_invisible, render_text
from aeros.spec.obligations.verdicts import Conclusion
from aeros.spec.verification.reports import SubjectReport


class TextDetail(Enum):
    """Amount of text beside the diagnostics."""

    QUIET = "nothing"
    USUAL = "verdicts, and the names of what is checked at run time"
    VERBOSE = "verdicts, and the conditions of what is checked at run time"


def as_text(
    result: VerifyResult,
    *,
    paint: Paint | None = None,
    detail: TextDetail = TextDetail.USUAL,
    width: int | None = None,
) -> str:
    """Render the report as text without characters that could mislead a terminal.

    Args:
        result: Report and problems of certificates.
        paint: Colours texts; None for no colours.
        detail: How much is told beside the diagnostics.
        width: Columns of the terminal, into which tables and marked lines are fitted; None for no limit.
            Whatever writes the other lines wraps them.

    Returns:
        Lines of text; empty if there is nothing to tell.
    """
    parts = [render_text(problem.diagnostic, paint=paint, width=width) for problem in result.problems]
    lines = [] if detail is TextDetail.QUIET else _summaries(result, width, paint)
    if detail is TextDetail.USUAL:
        lines += [*_runtime_rules(result), *_left_out_count(result)]
    elif detail is TextDetail.VERBOSE:
        lines += [*_boundaries(result, width), *_left_out(result, width)]
    if detail is not TextDetail.QUIET:
        lines += _agreement(result)
    return "\n".join([*(part.rstrip("\n") + "\n" for part in parts), *lines])


def _summaries(result: VerifyResult, width: int | None, paint: Paint | None) -> list[str]:
    rows = [_summary(subject) for subject in result.subjects if subject.name]
    return table_lines(rows, width=width, least=(0, len(Conclusion.UNDECIDED.value)), paint=paint)


def _proved(result: VerifyResult) -> list[SubjectReport]:
    return [subject for subject in result.subjects if subject.conclusion is Conclusion.PROVED]


def _boundaries_of(subject: SubjectReport) -> list[tuple[str, str]]:
    """List rules with what remains to be checked of them.

    What is checked without the gate, such as the bound of a model, has no condition of the gate.
    """
    return [(escape_invisible(rule), escape_invisible(what)) for rule, what in subject.boundaries if what]


def _runtime_rules(result: VerifyResult) -> list[str]:
    """List the runtime-checked rules of proved modules, by the modules whose actions they decide."""
    by_module = {
        escape_invisible(subject.name): dict.fromkeys(rule for rule, _ in _boundaries_of(subject))
        for subject in _proved(result)
    }
    names = [name for name, rules in by_module.items() if rules]
    rules = dict.fromkeys(rule for own in by_module.values() for rule in own)
    if not rules:
        return []
    groups: dict[tuple[str, ...], list[str]] = {}
    for rule in rules:
        groups.setdefault(tuple(name for name in names if rule in by_module[name]), []).append(rule)
    are = f"{counted(len(rules), 'rule')} {'is' if len(rules) == 1 else 'are'}"
    return [
        "",
        f"{are} checked at run time, before each action (-v shows the conditions)",
        *(f"  {_modules(group, names)}: {', '.join(own)}" for group, own in groups.items()),
    ]


_MOST_NAMES: Final = 3
"""Names of modules that are listed; more are counted."""


def _modules(names: Sequence[str], all_names: Sequence[str]) -> str:
    others = [name for name in all_names if name not in names]
    if len(names) <= _MOST_NAMES:
        return ", ".join(names)
    if not others:
        return f"all {len(names)} modules"
    if len(others) <= _MOST_NAMES:
        return f"all but {', '.join(others)}"
    return f"{len(names)} of {len(all_names)} modules"


def _boundaries(result: VerifyResult, width: int | None) -> list[str]:
    """List the runtime-checked rules of proved modules with the conditions that remain to be checked."""
    pairs = dict.fromkeys(pair for subject in _proved(result) for pair in _boundaries_of(subject))
    return ["", "the gate allows while", *table_lines(pairs, width=width, indent=2)] if pairs else []


def _left_out(result: VerifyResult, width: int | None) -> list[str]:
    """List outcomes of probability 0 of proved modules: no proof about a task holds after one."""
    rows = [
        (f"{escape_invisible(subject.name)}:", ", ".join(map(escape_invisible, subject.left_out)))
        for subject in _proved(result)
        if subject.left_out
    ]
    title = "tasks are proved without these outcomes, of probability 0"
    return ["", title, *table_lines(rows, width=width, indent=2)] if rows else []


def _left_out_count(result: VerifyResult) -> list[str]:
    """Count the outcomes of probability 0 of proved modules."""
    count = sum(len(subject.left_out) for subject in _proved(result))
    if not count:
        return []
    them = "it" if count == 1 else "them"
    return ["", f"tasks are proved without {counted(count, 'outcome')} of probability 0 (-v lists {them})"]


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


def _summary(subject: SubjectReport) -> Sequence[Cell]:
    conclusion, is_proved = subject.conclusion.value, subject.conclusion is Conclusion.PROVED
    text = f"{subject.claim_count:4} obligations"
    if is_proved and subject.runtime_checked_count:
        text += f", {subject.runtime_checked_count} runtime-checked"
    return escape_invisible(subject.name), (conclusion, "good" if is_proved else "bad"), text
