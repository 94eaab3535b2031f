"""Two copies of the examples' base: one is changed, the other stays."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.unit.spec.difference.versions import BASE
from tests.unit.spec.difference.whole_files import add_every_section


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copytree(BASE, tmp_path / "old"))


@pytest.fixture
def new(tmp_path: Path) -> Path:
    return Path(shutil.copytree(BASE, tmp_path / "new"))


@pytest.fixture
def rich(old: Path, new: Path) -> tuple[Path, Path]:
    """Two copies of the examples with every section."""
    for folder in (old, new):
        add_every_section(folder)
    return old, new
