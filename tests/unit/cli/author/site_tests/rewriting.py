"""Changes of the file of tests."""

from __future__ import annotations

from pathlib import Path

from tests.repo.tree import ROOT

TABLE = Path(__file__).parent / "table_tests.yaml"
CORPUS = ROOT / "tests" / "corpus"


def rewrite(file: Path, old: str, new: str) -> Path:
    """Replace a part of a file."""
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    return file
