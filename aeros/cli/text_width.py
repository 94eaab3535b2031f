"""Width of text in a terminal: letters of East Asia and pictures take two columns, accents none."""

from __future__ import annotations

from unicodedata import category, east_asian_width

_JOINED = frozenset({"Mn", "Me", "Cf"})
"""Categories of characters that are drawn with the one before them."""


def cell_width(text: str) -> int:
    """Count the columns that text takes.

    Args:
        text: text without control characters.

    Returns:
        The number of columns.
    """
    return len(text) if text.isascii() else sum(map(_width, text))


def cut_to_width(text: str, columns: int) -> str:
    """Cut text so that it takes no more columns than that.

    Args:
        text: text without control characters.
        columns: greatest number of columns.

    Returns:
        The longest beginning that fits.
    """
    if cell_width(text) <= columns:
        return text
    used = 0
    for place, character in enumerate(text):
        used += _width(character)
        if used > columns:
            return text[:place]
    return text


def pad_to_width(text: str, columns: int) -> str:
    """Fill text up with blanks to the right.

    Args:
        text: text without control characters.
        columns: least number of columns.

    Returns:
        The text with blanks.
    """
    return text + " " * (columns - cell_width(text))


def _width(character: str) -> int:
    if category(character) in _JOINED:
        return 0
    return 2 if east_asian_width(character) in ("W", "F") else 1
