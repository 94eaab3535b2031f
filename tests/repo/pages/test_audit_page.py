"""docs/audit.md is executed, command by command: every line it shows is printed, in this order.

Numbers apart, as the runs of two machines differ in their times.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.repo.pages.shown import carry_out, commands_of
from tests.repo.tree import ROOT, text_of

_COMMANDS = commands_of(text_of("docs/audit.md"))


def test_the_page_does_what_it_says(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "ecms", tmp_path / "ecms")
    shutil.copy(ROOT / "aeros" / "sites" / "panda_cell.yaml", tmp_path / "site.yaml")
    assert len(_COMMANDS) > 10
    for command, shown in _COMMANDS:
        carry_out(command, shown, tmp_path, refused="NOT SOUND" in shown or "--ecms hasty" in command)
