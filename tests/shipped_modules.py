"""Tests that need the shipped modules, and how they are told from those of the core.

A test file needs them if it, or a file of `tests` that it imports, names their folder, one of them, or one
of their scenes. Where `ecms/` is deleted, these are not collected, and all others pass: the core needs no
module.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Final

_ROOT: Final = Path(__file__).parents[1]
_NAMED: Final = re.compile(
    r"\becms\b|\blearned\b|shipped_scene|\"(?:fetch|table)\"|dumpling|clean the table|fetch the|"
    r"\bbenchmarks\b|"
    r"\b(?:clean_table|fetch_object|inspect_table|make_dumplings|serve_table|hold_sponge)\b"
)
_IMPORTED: Final = re.compile(r"^\s*(?:from (tests(?:\.\w+)+) import|import (tests(?:\.\w+)+))", re.MULTILINE)


def are_there() -> bool:
    """Return true if the shipped modules are there."""
    return (_ROOT / "ecms").is_dir()


@cache
def is_needed_by(path: Path) -> bool:
    """Return true if a file of tests needs the shipped modules."""
    text = path.read_text(encoding="utf-8")
    if path != Path(__file__) and _NAMED.search(text):
        return True
    imported = (first or second for first, second in _IMPORTED.findall(text))
    files = (_ROOT / f"{name.replace('.', '/')}.py" for name in imported)
    return any(is_needed_by(file) for file in files if file.is_file() and file not in (path, Path(__file__)))
