"""Wait for changes of files: `aeros verify --watch`."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final

from aeros.spec.verification.certificate import LOCK

_PERIOD_S: Final = 0.3
"""Seconds between two looks at the files."""

_SKIPPED: Final = frozenset(("__pycache__", "runs", "node_modules"))
"""Folders that no module is in; those whose name begins with a dot are skipped, too."""

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
        for file in _files_below(path):
            try:
                status = file.stat()
            except OSError:
                continue  # it was removed meanwhile
            found[file] = (status.st_mtime_ns, status.st_size)
    return found


def wait_for_change(paths: Iterable[Path], known: Snapshot) -> Snapshot:
    """Wait until a file changes, and until an editor has written all that it writes.

    Args:
        paths: files and folders.
        known: what was seen of them before.

    Returns:
        What is seen of them now.
    """
    listed = tuple(paths)
    while (seen := take_snapshot(listed)) == known:
        time.sleep(_PERIOD_S)
    while True:
        time.sleep(_PERIOD_S)
        later = take_snapshot(listed)
        if later == seen:
            return seen
        seen = later


def _files_below(path: Path) -> Iterator[Path]:
    if not path.is_dir():
        yield path
        return
    for folder, folders, files in os.walk(path):
        folders[:] = [name for name in folders if name not in _SKIPPED and not name.startswith(".")]
        yield from (Path(folder, name) for name in files if name != LOCK)
