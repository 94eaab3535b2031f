"""Diagnostics as text with all that they say, and files that tests compare with."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.expr.unparse import unparse
from aeros.spec.obligations.obligation import Obligation
from aeros.spec.obligations.verdicts import StaticClaim


def shown(diagnostic: Diagnostic) -> Iterator[str]:
    """Write a diagnostic.

    Args:
        diagnostic: the diagnostic.

    Yields:
        Its lines; each label has the text that it underlines.
    """
    yield f"  {diagnostic.severity.value} {diagnostic.code} {diagnostic.headline}"
    labels = [one for one in (diagnostic.primary, *diagnostic.secondary) if one is not None]
    yield from (f"    {_underlined(one)}  <- {one.text}".rstrip() for one in labels)
    for name in ("notes", "help"):
        yield from (f"    {name}: {line}" for one in getattr(diagnostic, name) for line in one.split("\n"))


def claim_lines(claim: Obligation | StaticClaim) -> Iterator[str]:
    """Write a claim with its formulas and with what its report would say.

    Args:
        claim: the claim.

    Yields:
        Its lines; none of a claim that is settled without a report.
    """
    if isinstance(claim, StaticClaim):
        if claim.diagnostic is not None:
            yield str(claim.id)
            yield from shown(claim.diagnostic)
        return
    one = claim
    yield f"{one.id}: {one.mode.value}, else {one.failure_verdict.value}"
    yield from shown(Diagnostic(one.code, one.headline, one.primary, one.secondary, one.notes, one.help))
    yield f"    over: {', '.join(one.space.by_name)}"
    yield from (f"    assumes: {unparse(term)}" for term in one.space.assumptions)
    yield f"    claims: {unparse(one.conclusion)}"
    if one.runtime_checked_rule is not None:
        yield f"    or at run time: {one.runtime_checked_rule}"
    if one.clause is not None:
        yield f"    from the envelope: {one.clause.text}"
    for part in one.labelled_conjuncts:
        yield f"    conjunct: {part.label.span.text}  <- {part.label.text}".rstrip()


def _underlined(label: SpanLabel) -> str:
    span = label.span
    first, *others = span.source.text[span.start : span.end].split("\n")
    readable = "".join(one if one.isprintable() else f"U+{ord(one):04X}" for one in first)
    return f"{readable} ..." if others else readable


def compare_with_file(path: Path, text: str) -> None:
    """Compare a text with a file; with AEROS_UPDATE_GOLDEN=1 write another file, and fail."""
    known = path.read_text(encoding="utf-8") if path.exists() else ""
    if known != text and os.environ.get("AEROS_UPDATE_GOLDEN") == "1":
        path.write_text(text, encoding="utf-8")
        pytest.fail(f"{path.name} was rewritten: read the difference, then run without the variable")
    assert text == known


def compare_with_section(path: Path, title: str, text: str) -> None:
    """Compare a text with the section of a file that has this title; otherwise as `compare_with_file`.

    Args:
        path: the file; each section begins with `=== ` and its title.
        title: one line.
        text: the text, whole lines.
    """
    sections = _sections(path)
    if os.environ.get("AEROS_UPDATE_GOLDEN") == "1":
        sections[title] = text
        compare_with_file(path, "".join(f"=== {one}\n{rest}" for one, rest in sections.items()))
    assert text == sections.get(title)


@cache
def _sections(path: Path) -> dict[str, str]:
    parts = path.read_text(encoding="utf-8").split("=== ")[1:] if path.exists() else []
    return {title: rest for title, _, rest in (part.partition("\n") for part in parts)}
