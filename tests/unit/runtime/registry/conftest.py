"""A robot's registry, and the modules of docs/codes/base to put into it: small, and quickly proved."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from aeros.runtime.registry.registry import Registry
from tests.repo.tree import ROOT

BASE = ROOT / "docs" / "codes" / "base"
Author = Callable[..., Path]


@pytest.fixture
def registry(tmp_path: Path) -> Registry:
    """With the site of docs/codes in force, and nothing installed."""
    made = Registry(tmp_path / "robot")
    made.set_policy(BASE / "site.yaml")
    return made


@pytest.fixture
def write(tmp_path: Path) -> Author:
    """Writes the module `tidy` with other texts in its manifest, into a folder of its own."""

    def make(folder: str = "tidy", **changed: str) -> Path:
        written = tmp_path / folder
        shutil.copytree(BASE / "tidy", written)
        manifest = written / "ecm.yaml"
        text = manifest.read_text(encoding="utf-8")
        for old, new in changed.items():
            key = f"{old}: "
            lines = [key + new if line.startswith(key) else line for line in text.splitlines()]
            text = "\n".join(lines) + "\n"
        manifest.write_text(text, encoding="utf-8")
        return written

    return make
