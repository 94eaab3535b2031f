"""Unknown names told once: many uses of one name that is not declared have one cause.

If the file declares a similar name that nothing uses, that declaration is misspelt, and the error is there.
Otherwise the error is at the first use.  The other uses are marked in both cases.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from aeros.spec.diagnostics.codes import Diagnostic, SpanLabel
from aeros.spec.diagnostics.repeated import MAX_USES, merge_repeated
from aeros.spec.diagnostics.source import Source, SourceSpan

_CODES: Final = ("AE122", "AE202")
_DECLARED: Final = re.compile(
    r"(?:^[ \t]*(?:- )?|[{,][ \t]*|(?<=\bid:)[ \t]+)([a-z_][a-z0-9_-]*)(?=[ \t]*[:,}\n])", re.MULTILINE
)
_WORD: Final = re.compile(r"[A-Za-z_][\w-]*")
_MAX_EDITS: Final = 2  # by which a misspelt declaration differs from the name that is used


def merge_unknown_names(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Merge the errors about one unknown name of a file into one.

    Args:
        diagnostics: diagnostics of a file, in order.

    Returns:
        The diagnostics with one error for each unknown name, where its first one was.
    """
    return merge_repeated(diagnostics, _key, lambda key, group: _merge(key[0], group))


def _key(found: Diagnostic) -> tuple[str, Source] | None:
    """Return name and file of an error about an unknown name."""
    if found.code not in _CODES or found.primary is None or found.secondary:
        return None
    span = found.primary.span
    module = re.search(r"no dependency declares `([^`]+)`", found.headline)
    name = module[1] if module else span.text.rpartition(".")[2]
    return (name, span.source) if f"`{name}`" in found.headline else None


def _merge(name: str, group: list[Diagnostic]) -> Diagnostic:
    first, spans = group[0], [found.primary.span for found in group if found.primary is not None]
    labels = tuple(SpanLabel(span, "used here") for span in spans)
    misspelt = _misspelt_declaration(name, spans[0].source)
    if misspelt is None:
        return replace(first, secondary=tuple(replace(one, text="and here") for one in labels[1:MAX_USES]))
    return Diagnostic(
        first.code,
        f"`{misspelt.text}` is declared and never used; `{name}` is used {len(spans)} times and not declared",
        SpanLabel(misspelt, "declared here"),
        labels[:MAX_USES],
        help=(f"correct the declaration to `{name}`, or the uses to `{misspelt.text}`",),
    )


def _misspelt_declaration(name: str, source: Source) -> SourceSpan | None:
    """Find the declaration that is nearest to a name, among names that stand nowhere else."""
    words = _WORD.findall(source.text)
    declared = {match[1]: match for match in _DECLARED.finditer(source.text) if words.count(match[1]) == 1}
    edits = {word: _edit_count(word, name) for word in declared if abs(len(word) - len(name)) <= _MAX_EDITS}
    least = min(edits.values(), default=len(name))
    near = [word for word, count in edits.items() if count == least]
    if len(near) != 1 or least > _MAX_EDITS or 2 * least >= len(name):
        return None
    return source.span(*declared[near[0]].span(1))


def _edit_count(first: str, second: str) -> int:
    """Count the edits between two words: insertions, deletions, replacements and swaps of neighbours.

    This is the distance of optimal string alignment.
    """
    before: list[int] = []
    row = list(range(len(second) + 1))
    for i, one in enumerate(first, 1):
        older, before, row = before, row, [i]
        for j, other in enumerate(second, 1):
            count = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (one != other))
            if i > 1 and j > 1 and one == second[j - 2] and first[i - 2] == other:
                count = min(count, older[j - 2] + 1)
            row.append(count)
    return row[-1]
