"""docs/looking-on.md is executed: its commands, in order."""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.repo.pages.shown import carry_out, commands_of
from tests.repo.tree import ROOT, text_of


def test_the_page_does_what_it_says(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "ecms", tmp_path / "ecms")
    commands = commands_of(text_of("docs/looking-on.md"))
    for command, shown in commands:
        carry_out(command, shown, tmp_path)
    assert len(commands) == 6
