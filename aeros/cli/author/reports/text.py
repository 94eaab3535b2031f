"""Verification report for a terminal: diagnostics, a line for each subject, and what is left to run time."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from textwrap import wrap
from typing import Final

from aeros.cli.author.reports.result import VerifyResult
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.diagnostics.render import escape_invisible, render_text
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
    colour: bool = False,
    detail: TextDetail = TextDetail.USUAL,
    width: int | None = None,
) -> str:
    """Render the report as text without characters that could mislead a terminal.

    Args:
        result: Report and problems of certificates.
        colour: True to use ANSI colours.
        detail: How much is told beside the diagnostics.
        width: Columns of the terminal, into which conditions and lists are broken; None to break nothing.

    Returns:
        Lines of text; empty if there is nothing to tell.
    """
    parts = [render_text(problem.diagnostic, colour=colour) for problem in result.problems]
    lines = [] if detail is TextDetail.QUIET else _summaries(result)
    if detail is TextDetail.USUAL:
        lines += [*_runtime_rules(result, width), *_left_out_count(result)]
    elif detail is TextDetail.VERBOSE:
        lines += [*_boundaries(result, width), *_left_out(result, width)]
    if detail is not TextDetail.QUIET:
        lines += _agreement(result)
    return "\n".join([*(part.rstrip("\n") + "\n" for part in parts), *lines])


def _summaries(result: VerifyResult) -> list[str]:
    width = max(len(escape_invisible(subject.name)) for subject in result.subjects)
    return [_summary(subject, width) for subject in result.subjects if subject.name]


def _proved(result: VerifyResult) -> list[SubjectReport]:
    return [subject for subject in result.subjects if subject.conclusion is Conclusion.PROVED]


def _boundaries_of(subject: SubjectReport) -> list[tuple[str, str]]:
    """List rules with what remains to be checked of them.

    What is checked without the gate, such as the bound of a model, has no condition of the gate.
    """
    return [(escape_invisible(rule), escape_invisible(what)) for rule, what in subject.boundaries if what]


def _runtime_rules(result: VerifyResult, width: int | None) -> list[str]:
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
    lines = [f"{_modules(group, names)}: {', '.join(own)}" for group, own in groups.items()]
    return [
        "",
        f"{are} checked at run time, before each action (-v shows the conditions)",
        *(part for line in lines for part in _wrapped(line, width or _USUAL_WIDTH)),
    ]


_MOST_NAMES: Final = 3
"""Names of modules that are listed; more are counted."""

_USUAL_WIDTH: Final = 100
"""Columns of a list of names that is not for a terminal."""


def _modules(names: Sequence[str], all_names: Sequence[str]) -> str:
    others = [name for name in all_names if name not in names]
    if len(names) <= _MOST_NAMES:
        return ", ".join(names)
    if not others:
        return f"all {len(names)} modules"
    if len(others) <= _MOST_NAMES:
        return f"all but {', '.join(others)}"
    return f"{len(names)} of {len(all_names)} modules"


def _wrapped(line: str, width: int) -> list[str]:
    return wrap(
        line,
        max(width, _LEAST_COLUMN),
        initial_indent="  ",
        subsequent_indent="    ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def _boundaries(result: VerifyResult, width: int | None) -> list[str]:
    """List the runtime-checked rules of proved modules with the conditions that remain to be checked."""
    pairs = dict.fromkeys(pair for subject in _proved(result) for pair in _boundaries_of(subject))
    return ["", "the gate allows while", *_rows(list(pairs), width)] if pairs else []


def _left_out(result: VerifyResult, width: int | None) -> list[str]:
    """List outcomes of probability 0 of proved modules: no proof about a task holds after one."""
    rows = [
        (f"{escape_invisible(subject.name)}:", ", ".join(map(escape_invisible, subject.left_out)))
        for subject in _proved(result)
        if subject.left_out
    ]
    return (
        ["", "tasks are proved without these outcomes, of probability 0", *_rows(rows, width)] if rows else []
    )


def _left_out_count(result: VerifyResult) -> list[str]:
    """Count the outcomes of probability 0 of proved modules."""
    count = sum(len(subject.left_out) for subject in _proved(result))
    if not count:
        return []
    them = "it" if count == 1 else "them"
    return ["", f"tasks are proved without {counted(count, 'outcome')} of probability 0 (-v lists {them})"]


def _rows(rows: Sequence[tuple[str, str]], width: int | None) -> list[str]:
    """Write two columns; the second one is broken at spaces where it is wider than the terminal."""
    first = max(len(name) for name, _ in rows)
    lines: list[str] = []
    for name, text in rows:
        head = f"  {name:{first}}  "
        room = len(text) if width is None else max(width - len(head), _LEAST_COLUMN)
        parts = wrap(text, max(room, 1), break_long_words=False, break_on_hyphens=False) or [""]
        lines += [(head if at == 0 else " " * len(head)) + part for at, part in enumerate(parts)]
    return [line.rstrip() for line in lines]


_LEAST_COLUMN: Final = 24
"""Columns that a text gets on however narrow a terminal."""


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
        line += f", {subject.runtime_checked_count} runtime-checked"
    return line
