"""The part of a run that an MP4 film shows, and how fast: it is in the comment of the film's file.

The comment is read without PyAV, as a report needs no package of films.  MP4 (ISO 14496-12) is a tree of
boxes: a length of four bytes, a name of four bytes, content.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

_HEADER_BYTES: Final = 8

_MAX_TIME: Final = 1e9
"""Largest time of a run that is believed, s."""

_PATH: Final = ((b"moov", 0), (b"udta", 0), (b"meta", 4), (b"ilst", 0), (b"\xa9cmt", 0), (b"data", 8))
"""Boxes around the comment, from the outermost, and the bytes at the start of each before its content."""


class FilmSpan(NamedTuple):
    """The part of a run that a film shows.

    Attributes:
        start: time in the run of the film's first picture, s.
        end: time in the run at which the film ends, s.
        speed: seconds of the run in one second of the film.
    """

    start: float
    end: float
    speed: float

    def comment(self) -> str:
        """Write the part as a comment.

        Returns:
            The comment of the film's file.
        """
        return json.dumps({"aeros_film": {name: float(one) for name, one in self._asdict().items()}})


def read_film_span(content: bytes) -> FilmSpan | None:
    """Read which part of its run a film shows.

    Args:
        content: bytes of an MP4 file.

    Returns:
        The part; None if the file does not say it in the form that `aeros film` writes.
    """
    begin, end = 0, len(content)
    for name, skipped in _PATH:
        found = _box(content, begin, end, name)
        if found is None:
            return None
        begin, end = found[0] + skipped, found[1]
    try:
        comment = json.loads(content[begin:end])
    except (ValueError, RecursionError):
        return None
    parts = comment.get("aeros_film") if type(comment) is dict else None
    return _span(parts) if type(parts) is dict else None


def _box(content: bytes, begin: int, end: int, name: bytes) -> tuple[int, int] | None:
    """Return where the content of the first box of a name begins and ends; None if there is none."""
    while begin + _HEADER_BYTES <= end:
        length = int.from_bytes(content[begin : begin + 4], "big")
        head = _HEADER_BYTES
        if length == 1:  # A length of eight bytes follows the name.
            head, length = 16, int.from_bytes(content[begin + 8 : begin + 16], "big")
        if length < head or begin + length > end:
            return None
        if content[begin + 4 : begin + 8] == name:
            return begin + head, begin + length
        begin += length
    return None


def _span(parts: Mapping[str, Any]) -> FilmSpan | None:
    values = [parts.get(name) for name in FilmSpan._fields]
    numbers = [float(one) for one in values if type(one) is float and abs(one) <= _MAX_TIME]
    if len(numbers) != len(values):
        return None
    span = FilmSpan(*numbers)
    return span if span.start < span.end and span.speed > 0.0 else None
