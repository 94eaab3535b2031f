"""docs/plants.md is executed: its programs, each named in its first line, and its commands, in order."""

from __future__ import annotations

import inspect
import re
import shutil
from pathlib import Path

import pytest

from aeros.sim.conformance.suite import CHECKS
from tests.repo.pages.shown import COMMAND, carry_out
from tests.repo.tree import ROOT, check_generated, text_of

_PAGE = text_of("docs/plants.md")
_BLOCK = re.compile(r"^```(python|console)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.deep  # its runs are like those of the README, the tutorial and docs/bus.md
@pytest.mark.physics
def test_the_page_does_what_it_says(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "ecms", tmp_path / "ecms")
    commands = 0
    for kind, block in _BLOCK.findall(_PAGE):
        if kind == "python":
            name = block.partition("\n")[0].removeprefix("# ")
            (tmp_path / name).write_text(block, encoding="utf-8")
            continue
        for command, shown in COMMAND.findall(block):
            carry_out(command, shown, tmp_path)
            commands += 1
    assert commands == 3


def test_the_page_lists_every_promise_that_is_checked() -> None:
    rows = "| check | promise |\n|---|---|\n"
    for check in CHECKS:
        promise = (inspect.getdoc(check) or "").splitlines()[0].removeprefix("Check that ")
        rows += f"| `{check.__name__}` | {promise[:1].upper()}{promise[1:]} |\n"
    check_generated("docs/plants.md", "promises", rows)
