"""The film of a run in its report page: inside the page if it is small enough, else a link to it."""

from __future__ import annotations

import base64
import os
from collections.abc import Sequence
from html import escape
from os.path import relpath
from pathlib import Path
from typing import Final, NamedTuple
from urllib.parse import quote

from aeros.files import open_regular
from aeros.sim.film.film_span import FilmSpan, read_film_span

FILM_NAMES: Final = ("film.mp4", "film.webp", "film.gif")
"""Names of the film in the folder of a run, in the order in which a page looks for one."""

_MAX_BYTES: Final = 16_000_000
"""Size of the largest film that is put into the page: a third more as text."""

_TYPES: Final = {".mp4": "video/mp4", ".webp": "image/webp", ".gif": "image/gif"}


class FilmFile(NamedTuple):
    """A film.

    Attributes:
        name: Path of its file from the folder of the page, with `/` between its parts.
        content: Its bytes; None if it is too large for the page.
    """

    name: str
    content: bytes | None

    @property
    def span(self) -> FilmSpan | None:
        """The part of the run that it shows; None if the page cannot set it to a time of the run."""
        if self.content is None or not _type(self.name).startswith("video"):
            return None
        return read_film_span(self.content)


def find_film(folder: Path, page: Path, names: Sequence[str] = FILM_NAMES) -> FilmFile | None:
    """Find the film of a run.

    Args:
        folder: Folder of the run, or of the film.
        page: Folder of the page.
        names: Names that it may have, the preferred one first.

    Returns:
        The film; None if there is none that can be read.
    """
    for name in names:
        path = folder / name
        try:
            with open_regular(path) as file:
                content = None if os.fstat(file.fileno()).st_size > _MAX_BYTES else file.read()
                return FilmFile(Path(relpath(folder.resolve() / name, page.resolve())).as_posix(), content)
        except OSError:
            continue
    return None


def film_element(film: FilmFile) -> str:
    """Show a film.

    Args:
        film: The film.

    Returns:
        An HTML element that needs no other file, or a link.
    """
    if film.content is None:
        place = "in another folder than" if "/" in film.name else "beside"
        return f'<p><a href="{quote(film.name)}">{escape(film.name)}</a>, which lies {place} this page.</p>'
    kind = _type(film.name)
    source = f"data:{kind};base64,{base64.b64encode(film.content).decode()}"
    if kind.startswith("video"):
        span = film.span
        if span is None:
            return f'<video controls muted loop src="{source}"></video>'
        times = f'data-start="{span.start}" data-end="{span.end}" data-speed="{span.speed}"'
        return (
            f'<video id="film" {times} controls muted loop src="{source}"></video>\n'
            "<p>A click on a time, on a mark or a step of the timeline, or Enter on it, sets the film there. "
            "A line on the timeline follows the film.</p>"
        )
    return f'<img class="film" alt="film of the run" src="{source}">'


def _type(name: str) -> str:
    return _TYPES[Path(name).suffix]
