"""Source positions of each character of a scalar's text, through quotes, escapes and folded lines."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from aeros.spec.diagnostics.source import SourceSpan
from aeros.spec.text.nodes import ScalarNode

_BREAKS: Final = re.compile(r"\r?\n")

_PositionedText = tuple[str, int, int]
"""One character of a scalar's text and the offsets where its writing starts and ends."""


def source_offsets(scalar: ScalarNode) -> list[int]:
    """Map each character of a scalar's text to its place in the file.

    Args:
        scalar: any scalar.

    Returns:
        For each character the offset where it is written (the break for a folded line break, the backslash
        for an escape); [] if the places are not known.
    """
    return [start for _, start, _ in _pieces(scalar)]


def sub_span(scalar: ScalarNode, start: int, end: int) -> SourceSpan:
    """Find the place of a part of a scalar's text.

    Args:
        scalar: any scalar.
        start: index in the text. `start` = `end` = its length is the place just after the last character.
        end: index after the last character.

    Returns:
        The span in the file; the whole scalar's if the places are not known.
    """
    pieces = _pieces(scalar)
    if not pieces or not 0 <= start <= end <= len(pieces):
        return scalar.span
    first = pieces[start][1] if start < len(pieces) else pieces[-1][2]
    last = pieces[end - 1][2] if end > start else first
    return scalar.span.source.span(first, last)


def _pieces(scalar: ScalarNode) -> list[_PositionedText]:
    """Return the text with its places, checked against the text itself: [] rather than a wrong place."""
    source, start, end = scalar.span.source.text, scalar.span.start, scalar.span.end
    if not scalar.style and source[start:end] == scalar.text:  # on one line, and most are
        return [(character, at, at + 1) for at, character in enumerate(scalar.text, start)]
    if scalar.style in ("|", ">"):
        pieces = _block_pieces(source, start, scalar.text, scalar.style == ">")
    elif scalar.style:
        pieces = list(_flow_pieces(source, start + 1, end - 1, scalar.style))
    else:
        pieces = list(_flow_pieces(source, start, end, ""))
    pieces = pieces[: len(scalar.text)]
    return pieces if "".join(character for character, _, _ in pieces) == scalar.text else []


_BLANKS: Final = re.compile(r"[ \t]*")
_FOLD: Final = re.compile(r"(?:\r?\n[ \t]*)+")
_HEX_DIGITS: Final = {"x": 2, "u": 4, "U": 8}
_ESCAPES: Final = {
    "0": "\0", "a": "\a", "b": "\b", "t": "\t", "\t": "\t", "n": "\n", "v": "\v", "f": "\f", "r": "\r",
    "e": "\x1b", "N": "\x85", "_": "\xa0", "L": "\u2028", "P": "\u2029",
}  # fmt: skip


def _flow_pieces(text: str, at: int, end: int, quote: str) -> Iterator[_PositionedText]:
    """Read a plain or quoted scalar: one line break folds into a space, n + 1 into n breaks."""
    while at < end:
        blanks = _BLANKS.match(text, at, end)
        after = blanks.end() if blanks else at
        fold = _FOLD.match(text, after, end)
        if fold:  # blanks before a break are not part of the text
            yield from _fold_lines(text, *fold.span())
            at = fold.end()
            continue
        yield from ((text[blank], blank, blank + 1) for blank in range(at, after))
        if after < end:
            pieces, at = _unescape(text, after, end, quote)
            yield from pieces
        else:
            at = end


def _unescape(text: str, at: int, end: int, quote: str) -> tuple[list[_PositionedText], int]:
    """Return the text of one character or escape, and the offset of the next."""
    if quote == "'" and text[at] == "'":
        return [("'", at, at + 2)], at + 2
    if quote != '"' or text[at] != "\\":
        return [(text[at], at, at + 1)], at + 1
    joined = _FOLD.match(text, at + 1, end)
    if joined:  # the break is joined away, the empty lines after it are not
        breaks = list(_BREAKS.finditer(text, *joined.span()))
        return [("\n", match.start(), match.end()) for match in breaks[1:]], joined.end()
    escaped = text[at + 1]
    digits = _HEX_DIGITS.get(escaped, 0)
    after = at + 2 + digits
    character = chr(int(text[at + 2 : after], 16)) if digits else _ESCAPES.get(escaped, escaped)
    return [(character, at, after)], after


def _fold_lines(text: str, start: int, end: int) -> Iterator[_PositionedText]:
    breaks = list(_BREAKS.finditer(text, start, end))
    if len(breaks) == 1:
        yield " ", breaks[0].start(), breaks[0].end()
    else:
        yield from (("\n", match.start(), match.end()) for match in breaks[1:])


def _block_pieces(text: str, start: int, value: str, is_folding: bool) -> list[_PositionedText]:
    """Read a block scalar: indentation goes; folding joins lines of which neither begins with a blank.

    All trailing breaks are kept: the header decides how many count, and the caller cuts.
    """
    header = text.find("\n", start)
    lines = [] if header < 0 else _block_lines(text, header + 1, value)
    pieces: list[_PositionedText] = []
    held: list[_PositionedText] = []  # breaks since the last line that holds something
    was_blank_led = True  # so that nothing folds before the first line
    for first, last, after in lines:
        if first < last:
            is_blank_led = text[first] in " \t"
            if is_folding and held and not was_blank_led and not is_blank_led:
                held = [(" ", *held[0][1:])] if len(held) == 1 else held[1:]
            pieces += held
            pieces += [(text[at], at, at + 1) for at in range(first, last)]
            held, was_blank_led = [], is_blank_led
        held.append(("\n", last, after))
    return pieces + held


def _block_lines(text: str, at: int, value: str) -> Iterator[tuple[int, int, int]]:
    """Yield (start, end, start of the next line) of each line's content, without its indentation.

    The indentation is that of the first line with content, minus the blanks that its text begins with.
    """
    content = value.lstrip("\n")
    own = len(content) - len(content.lstrip(" "))
    indent: int | None = None
    while at < len(text):
        line_break = _BREAKS.search(text, at)
        end, after = line_break.span() if line_break else (len(text), len(text))
        leading = len(text[at:end]) - len(text[at:end].lstrip(" "))
        if indent is None and at + leading < end:
            indent = max(leading - own, 0)
        if at + leading < end and leading < (indent or 0):
            return  # less indented: no longer part of the block
        yield min(at + (leading if indent is None else indent), end), end, after
        at = after
