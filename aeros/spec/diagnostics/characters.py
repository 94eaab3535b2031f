"""Characters that a reader of a text cannot see, or that change how the text around them is shown.

A review is worth nothing where the text that is shown is not the text that is read (Boucher and Anderson,
“Trojan Source”, 2021). So the files that people review hold none of these characters, and none reaches a
terminal. Source: Unicode's general categories (`unicodedata`), and `Default_Ignorable_Code_Point` of its
`DerivedCoreProperties.txt` for invisible letters and marks. One letter holds at most as many combining marks
as in Unicode's stream-safe text format (Unicode Standard Annex #15, section 13): more of them cover the lines
around it.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
from functools import lru_cache
from typing import Final

MAX_MARKS: Final = 30
"""Limit on the combining marks in a row, of the stream-safe text format."""

_CATEGORIES: Final = {
    "Cc": "a control character",
    "Cf": "invisible, or reorders the text around it",
    "Cs": "half of a character",
    "Co": "for private use, so every font shows it differently",
    "Cn": f"not assigned in Unicode {unicodedata.unidata_version}",
    "Zl": "a line break for some programs and not for others",
    "Zp": "a line break for some programs and not for others",
    "Zs": "a space that is not the space bar's",
}
"""General categories whose characters are hidden, with the reason."""

_IGNORABLE: Final = re.compile(
    "[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180d\u180f\u3164\ufe00-\ufe0f\uffa0\U000e0100-\U000e01ef]"
)
"""Letters and marks of `Default_Ignorable_Code_Point`; its other characters are of category Cf or Cn."""

_BLANKS: Final = "\u2800\ufffc\U0001107f\U00016fe4\U0001d159"
"""Characters of visible categories that show nothing: the empty pattern of braille, the mark of an absent
object, the number joiner of Brahmi, the filler of Khitan, and the null notehead."""

_LINE_BREAKS: Final = "\x0b\x0c\r\x1c\x1d\x1e\x85\u2028\u2029"
"""Characters at which Python, an editor or a terminal begins a line, and others do not."""

_NAMES: Final = {
    "\x00": "NULL",
    "\x07": "BELL",
    "\x08": "BACKSPACE",
    "\x0b": "LINE TABULATION",
    "\x0c": "FORM FEED",
    "\r": "CARRIAGE RETURN",
    "\x1b": "ESCAPE",
    "\x7f": "DELETE",
    "\x85": "NEXT LINE",
    "\x9b": "CONTROL SEQUENCE INTRODUCER",
}
"""Names of controls, for which `unicodedata` has none. Source: Unicode's NameAliases.txt."""

_ASCII_HIDDEN: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]|\r(?!\n)")


def is_hidden(character: str) -> bool:
    """Tell if a character is invisible or changes how the text around it is shown.

    Args:
        character: one character.

    Returns:
        True for every control, format, unassigned or private character, every space but U+0020, and every
        letter, mark or symbol that shows nothing. Tab and line feed count too: what ends a line is the
        caller's matter.
    """
    if " " <= character <= "~":
        return False
    return (
        unicodedata.category(character) in _CATEGORIES
        or character in _BLANKS
        or _IGNORABLE.match(character) is not None
    )


@lru_cache(maxsize=64)
def find_hidden(text: str) -> int | None:
    r"""Find the first hidden character of a text of several lines, or the first mark too many on one letter.

    Args:
        text: the text; a line ends with "\n" or "\r\n", and may hold tabs.

    Returns:
        Offset of the character; None if there is none.
    """
    if text.isascii() and text.replace("\n", "").replace("\t", "").isprintable():
        return None  # most texts; the search takes ten times as long
    found = _ASCII_HIDDEN.search(text)
    offsets = [] if found is None else [found.start()]
    if not text.isascii():
        characters = set(text)
        offsets += [text.index(one) for one in characters if one > "~" and is_hidden(one)]
        marks = "".join(filter(_is_mark, characters))
        stacked = re.search(f"[{marks}]{{{MAX_MARKS + 1}}}", text) if marks else None
        offsets += [] if stacked is None else [stacked.end() - 1]
    return min(offsets, default=None)


def escape_hidden(text: str, escape: Callable[[str], str]) -> list[str]:
    """Escape the hidden characters of a text, and the marks too many on one letter.

    Args:
        text: any text.
        escape: gives the text to show in place of such a character; tab and line feed are among them.

    Returns:
        For each character of the text what to show of it.
    """
    if text.isascii() and text.isprintable():
        return list(text)
    shown, marks = [], 0
    for one in text:
        marks = marks + 1 if _is_mark(one) else 0
        shown.append(escape(one) if marks > MAX_MARKS or is_hidden(one) else one)
    return shown


def _is_mark(character: str) -> bool:
    return unicodedata.category(character).startswith("M")


def describe_character(character: str) -> str:
    """Name a character by its code point and Unicode name.

    Args:
        character: one character.

    Returns:
        Such as `U+202E (RIGHT-TO-LEFT OVERRIDE)`.
    """
    name = _NAMES.get(character) or unicodedata.name(character, "")
    return f"U+{ord(character):04X}" + (f" ({name})" if name else "")


def hiding_reason(character: str) -> str:
    """Say why a hidden character is not allowed.

    Args:
        character: one character, of which `is_hidden` holds, or a mark too many on one letter.

    Returns:
        A phrase that completes “it is …”.
    """
    if character in _LINE_BREAKS:
        return _CATEGORIES["Zl"]
    if character in _BLANKS or _IGNORABLE.match(character):
        return "invisible"
    if _is_mark(character):
        return f"one of more than {MAX_MARKS} marks on one letter"
    return _CATEGORIES[unicodedata.category(character)]
