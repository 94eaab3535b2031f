"""Nearest existing path to one that does not exist, for messages."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import Final

from aeros.spec.text.discovery import reference_modules_path

_MOST_NAMES: Final = 2000
"""Names of a folder that are compared at most, so that a message does not wait for a large folder."""

_LEAST_SIMILARITY: Final = 0.6
_SAME_WORD: Final = 0.85
_MODULE_FILE: Final = "ecm.yaml"


def near_path(text: str) -> str | None:
    """Find the path that was probably intended.

    It is in the same folder, a module one folder down, or one of those that come with AEROS.

    Args:
        text: Path that does not exist.

    Returns:
        The path of an existing file or folder; None where no name is near.
    """
    path = Path(text)
    try:
        found = _same_folder(path)
        if found is None and len(path.parts) == 1:
            found = _module(text.strip("/"))
        return _shipped(path) if found is None else found
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


def _shipped(path: Path) -> str | None:
    """Find a module that comes with AEROS by its name, or their folder."""
    folder = reference_modules_path()
    match path.parts:
        case (folder.name,):
            return str(folder)
        case (name,) | (folder.name, name):
            near = _nearest(name, (one.parent.name for one in folder.glob(f"*/{_MODULE_FILE}")), _SAME_WORD)
            return None if near is None else str(folder / near)
    return None


def _nearest(name: str, known: Iterable[str], similarity: float = _LEAST_SIMILARITY) -> str | None:
    near = get_close_matches(name, list(known), 1, similarity)
    return near[0] if near else None
