"""A copy of the file of tests, which a test may change."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.cli.author.site_tests.rewriting import CORPUS, TABLE


@pytest.fixture
def changed(tmp_path: Path) -> Path:
    """A copy of the file, with absolute paths, that a test may change."""
    file = tmp_path / "tests.yaml"
    file.write_text(TABLE.read_text().replace("../../../../corpus", str(CORPUS)))
    return file
