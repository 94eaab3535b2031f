"""Files of the repository, as the tests of this folder read them."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

UPDATE = os.environ.get("AEROS_UPDATE_GOLDEN") == "1"
"""True if generated files are to be written again."""

PYTHON = sorted(path.relative_to(ROOT) for path in (ROOT / "aeros").rglob("*.py"))
"""The code."""

_SKIPPED = {"node_modules", "runs", "dist", "mutants"}


def markdown() -> list[Path]:
    """Every page of the repository, relative to its root."""
    pages = (path.relative_to(ROOT) for path in ROOT.rglob("*.md"))
    return sorted(
        page
        for page in pages
        if not any(part.startswith(".") or part in _SKIPPED for part in page.parts[:-1])
    )


def text_of(path: Path | str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


def prose_of(path: Path | str) -> str:
    """A page without its fenced blocks, in which nothing is a link or a heading."""
    return re.sub(r"^```.*?^```$", "", text_of(path), flags=re.MULTILINE | re.DOTALL)


def check_generated(page: str, name: str, expected: str) -> None:
    """The part of `page` between the markers of `name` is `expected`; rewritten, and failed, on request."""
    begin, end = f"<!-- generated: {name} -->\n", f"<!-- end: {name} -->\n"
    text = text_of(page)
    before, found = text.split(begin)
    current, after = found.split(end)
    if current == expected:
        return
    if UPDATE:
        (ROOT / page).write_text(before + begin + expected + end + after, encoding="utf-8")
        pytest.fail(f"{page} was rewritten")
    pytest.fail(f"{page} is not what the code says; AEROS_UPDATE_GOLDEN=1 pytest tests/repo rewrites it")
