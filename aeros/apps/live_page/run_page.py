"""Page about the run under way: that of `aeros report`, made from the files as far as they are written."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Set
from html import escape
from pathlib import Path
from threading import Lock
from typing import Final

from aeros.apps.report_page.film_element import FILM_NAMES, find_film
from aeros.apps.report_page.page import page_of
from aeros.apps.report_page.run_data import AUDIT, TRACE, RunData, read_run_data
from aeros.runtime.bus.sample_file import FILE as SAMPLES
from aeros.sim.film_file import FILE as POSES
from aeros.spec.model.site import Site

_FILES: Final = (AUDIT, TRACE, SAMPLES, POSES, *FILM_NAMES)
_SIGNED: Final = "not checked here; `aeros report --public-key` checks them"
_TRIES: Final = 5
_PAUSE_S: Final = 0.1
"""Time in which a run ends the line that it writes, and writes the same event to the second file (s)."""


class RunPage:
    """Page about a run, which is made anew only after its files have changed.

    Args:
        find_run: Returns the folder of the run, and true if its process exists; None if there is none.
        find_sites: Returns the available sites among those with the given digests, by digest.
    """

    def __init__(
        self,
        find_run: Callable[[], tuple[Path, bool] | None],
        find_sites: Callable[[Set[str]], Mapping[str, Site]],
    ) -> None:
        self._find_run = find_run
        self._find_sites = find_sites
        self._lock = Lock()
        self._sites: dict[str, Site] = {}
        self._sought: frozenset[str] = frozenset()
        """Digests of sites that were searched for; reading all sites of a robot takes seconds."""
        self._made_of: object = None
        self._page = ""

    def html(self) -> str:
        """Return the page as of now.

        Returns:
            An HTML document; without a run, one that says so.

        Raises:
            OSError: the audit log cannot be read.
        """
        with self._lock:
            found = self._find_run()
            if found is None or not (found[0] / AUDIT).is_file():
                return _empty_page("no run yet" if found is None else f"no {AUDIT} in {found[0]} yet")
            state = (found, *(_stamp(found[0] / name) for name in _FILES))
            if state != self._made_of:
                self._page = self._make(*found)
                self._made_of = state
            return self._page

    def _make(self, folder: Path, is_running: bool) -> str:
        left = _read(folder, is_running)
        wanted = frozenset(one.site for one in left.decisions if one.site is not None)
        if not wanted <= self._sought:
            self._sites.update(self._find_sites(wanted))
            self._sought |= wanted
        film = None if is_running else find_film(folder, folder)
        shown = None if film is None or film.content is None else film
        return page_of(left, folder.resolve().name, self._sites, _SIGNED, shown)


def _read(folder: Path, is_running: bool) -> RunData:
    """Read the files; of a run under way again, while one ends within a line or two disagree."""
    for remaining in reversed(range(_TRIES if is_running else 1)):
        left = read_run_data(folder)
        if not remaining or (left.chain.is_sound and not left.problems):
            break
        time.sleep(_PAUSE_S)
    left.is_under_way = is_running
    return left


def _stamp(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns


def _empty_page(text: str) -> str:
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>aeros live</title>'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        "<style>:root{color-scheme:light dark}body{font:14px sans-serif;margin:2em}</style></head>"
        f"<body><main><h1>{escape(text)}</h1></main></body></html>\n"
    )
