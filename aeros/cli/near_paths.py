"""Nearest existing path to one that does not exist, for messages."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import Final

_MOST_NAMES: Final = 2000
"""Names of a folder that are compared at most, so that a message does not wait for a large folder."""

_LEAST_SIMILARITY: Final = 0.6
_MODULE_FILE: Final = "ecm.yaml"


def near_path(text: str) -> str | None:
    """Find the path that was probably intended: in the same folder, or a module one folder down.

    Args:
        text: Path that does not exist.

    Returns:
        The path of an existing file or folder; None where no name is near.
    """
    try:
        found = _same_folder(Path(text))
        return found if found is not None or len(Path(text).parts) != 1 else _module(text.strip("/"))
    except (OSError, ValueError):
        return None


def _same_folder(path: Path) -> str | None:
    """Correct the first name of a path that does not exist, and keep what follows it where that exists."""
    folder = Path(path.anchor)
    parts = path.parts[1:] if path.anchor else path.parts
    for at, name in enumerate(parts):
        if (folder / name).exists():
            folder /= name
            continue
        if not folder.is_dir():
            return None
        # A link that leads nowhere is no cure.
        known = (one.name for one in islice(folder.iterdir(), _MOST_NAMES) if one.exists())
        near = _nearest(name, known)
        if near is None:
            return None
        whole = (folder / near).joinpath(*parts[at + 1 :])
        return str(whole if whole.exists() else folder / near)
    return None


def _module(name: str) -> str | None:
    """Find a module by its name in a folder of modules, which is not named."""
    places = islice(Path().glob("*/*/"), _MOST_NAMES)
    folders = {one.name: one for one in places if (one / _MODULE_FILE).exists()}
    near = _nearest(name, folders)
    return None if near is None else str(folders[near])


def _nearest(name: str, known: Iterable[str]) -> str | None:
    near = get_close_matches(name, list(known), 1, _LEAST_SIMILARITY)
    return near[0] if near else None
