"""Wait for changes of files: `aeros verify --watch`."""

from __future__ import annotations

import os
import re
import select
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from aeros.spec.text.discovery import MANIFEST
from aeros.spec.verification.certificate import LOCK

_PERIOD_S: Final = 0.3
"""Seconds between two looks at the files."""

_SKIPPED: Final = frozenset(("__pycache__", "runs", "node_modules"))
"""Folders that no module is in; those whose name begins with a dot are skipped, too."""

_BASE: Final = re.compile(r"""^base:\s*["']?([^"'#\n]*[^"'#\s])""", re.MULTILINE)
"""The site file or overlay to which an overlay adds."""

Snapshot = Mapping[Path, tuple[int, int]]
"""Time of change (ns) and size of each file."""


def take_snapshot(paths: Iterable[Path]) -> Snapshot:
    """Look at files.

    Args:
        paths: files and folders, of which all files below count but certificates.

    Returns:
        What shows if one is changed, added or removed.
    """
    found = {}
    for path in paths:
        for file in _files_below(path.resolve()):
            try:
                status = file.stat()
            except OSError:
                continue  # it was removed meanwhile
            found[file] = (status.st_mtime_ns, status.st_size)
    return found


def files_read_for(modules: Sequence[Path], site: Path | None) -> Iterator[Path]:
    """Find the files on which verdicts about modules depend.

    Args:
        modules: modules, manifests and folders of modules.
        site: the site file, or an overlay; None for the site that comes with AEROS.

    Yields:
        The modules, those next to them, which they may require, and the site files that overlays name, with
        the YAML files beside them.
    """
    yield from modules
    for place in {path.resolve().parent for path in modules}:
        yield from (one.parent for one in place.glob(f"*/{MANIFEST}"))
    seen: set[Path] = set()
    while site is not None and site.resolve() not in seen:
        seen.add(site.resolve())
        yield from site.parent.glob("*.yaml")
        yield site
        try:
            base = _BASE.search(site.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError):
            return
        site = None if base is None else site.parent / base[1]


def wait_for_change(paths: Callable[[], Iterable[Path]], known: Snapshot) -> Snapshot:
    """Wait until a file changes, and until an editor has written all that it writes.

    Args:
        paths: lists files and folders.
        known: what was seen of them before.

    Returns:
        What is seen of them now.

    Raises:
        BrokenPipeError: nobody reads standard output any more.
    """
    while (seen := take_snapshot(paths())) == known:
        _pause()
    while True:
        _pause()
        later = take_snapshot(paths())
        if later == seen:
            return seen
        seen = later


def changed_files(before: Snapshot, after: Snapshot) -> list[Path]:
    """Compare two looks at files.

    Args:
        before: the first look.
        after: the second.

    Returns:
        The files that were changed, added or removed, in order.
    """
    return sorted(path for path in before.keys() | after.keys() if before.get(path) != after.get(path))


def _pause() -> None:
    time.sleep(_PERIOD_S)
    try:
        output = sys.stdout.fileno()
    except (OSError, ValueError):  # a stream without a file
        return
    poll = select.poll()
    poll.register(output, 0)
    if any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0)):
        raise BrokenPipeError


def _files_below(path: Path) -> Iterator[Path]:
    if not path.is_dir():
        yield path
        return
    for folder, folders, files in os.walk(path):
        folders[:] = [name for name in folders if name not in _SKIPPED and not name.startswith(".")]
        yield from (Path(folder, name) for name in files if name != LOCK)
