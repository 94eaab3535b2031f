"""Edits of conditions as edits of the file that holds them; comments, quotes and line breaks stay."""

from __future__ import annotations

import re
from difflib import SequenceMatcher
from typing import Final

from aeros.spec.diagnostics.codes import Fix
from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.nodes import ScalarNode
from aeros.spec.text.scalar_positions import source_offsets, sub_span

AMBIGUOUS: Final = re.compile(r"[\[\]{},#:]")
"""Characters that are special in a plain YAML scalar."""

_STYLES: Final = ("'", '"', "|", ">")
_TOKEN: Final = re.compile(r"\s+|[\w.]+|.", re.DOTALL)
_UNSAFE: Final = {"'": "'", '"': '"\\'}  # characters that need an escape in quotes of this kind


def edit_in_source(span: SourceSpan, old: str, new: str) -> Fix | None:
    """Turn an edit of a scalar's text into an edit of its file, which changes nothing else.

    Args:
        span: place of the scalar, with its quotes or its block sign.
        old: text of the scalar.
        new: text that it should have; blanks at both ends do not count.

    Returns:
        The edit; None if the places of the text in the file are not known, or if the new text needs escapes.
    """
    style = span.text[:1] if span.text[:1] in _STYLES else ""
    node = ScalarNode(old, span, style)
    kept = old.rstrip()
    new = (old[: len(old) - len(old.lstrip())] + new.strip()) if kept else new
    escapes = any(character in new for character in _UNSAFE.get(style, ""))
    if escapes or not source_offsets(node):  # the places are not known
        return None
    text, last = "", span.start
    for start, end, replacement in _replaced_parts(kept, new):
        place = sub_span(node, start, end)
        text += span.source.text[last : place.start] + replacement
        last = place.end
    text += span.source.text[last : span.end]
    if not style and AMBIGUOUS.search(new) and not AMBIGUOUS.search(old):
        text = f'"{text}"'
    return Fix(span, text)


def _replaced_parts(old: str, new: str) -> list[tuple[int, int, str]]:
    """Compare two texts token by token; return offsets in the old text, and the text to write there."""
    before, after = _TOKEN.findall(old), _TOKEN.findall(new)
    offsets = [0]
    for token in before:
        offsets.append(offsets[-1] + len(token))
    return [
        (offsets[start], offsets[end], "".join(after[first:last]))
        for tag, start, end, first, last in SequenceMatcher(None, before, after, autojunk=False).get_opcodes()
        if tag != "equal"
    ]
