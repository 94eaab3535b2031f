"""The tutorial is executed, block by block and in order, in an empty folder.

- ```console: each `$ COMMAND` is run; every line shown after it is printed, in this order.  Numbers are those
  printed, too, but for real times, and for physics, where machines differ.  It exits with 0 unless an error
  is shown.  With AEROS_UPDATE_GOLDEN=1 the page gets the lines that are printed, and the test fails.
- ```diff: `--- FILE`, then an edit of it: its lines without `+` stand in the file exactly once, and are
  replaced by those without `-`.
- ```python: a program, where its first line is `# FILE.py`, and written to that file.
- ```yaml, ```python: else an excerpt of the manifest or of the skills, as they are at this point.
"""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent

import pytest

from tests.repo.pages.shown import COMMAND, carry_out, shown_as_printed
from tests.repo.tree import ROOT, UPDATE, text_of

_BLOCK = re.compile(r"^```(console|diff|yaml|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_BLOCKS: list[tuple[str, str]] = _BLOCK.findall(text_of("docs/tutorial.md"))
_EXCERPTED = {"yaml": "tidy/ecm.yaml", "python": "tidy/skills.py"}


def _edit(block: str, folder: Path) -> None:
    header, *lines = block.splitlines(keepends=True)
    path = folder / header.removeprefix("--- ").strip()
    before = "".join(line[1:] or "\n" for line in lines if not line.startswith("+"))
    after = "".join(line[1:] or "\n" for line in lines if not line.startswith("-"))
    text = path.read_text(encoding="utf-8")
    assert text.count(before) == 1, f"{path.name} does not hold once:\n{before}"
    path.write_text(text.replace(before, after), encoding="utf-8")


def _is_excerpt(block: str, text: str) -> bool:
    """Return true if `block` stands in `text`, at any indentation."""
    wanted, lines = dedent(block).splitlines(), text.splitlines()
    windows = (lines[at : at + len(wanted)] for at in range(len(lines)))
    return any(dedent("\n".join(window)).splitlines() == wanted for window in windows)


@pytest.mark.physics
def test_the_tutorial_does_what_it_says(tmp_path: Path) -> None:
    changes: list[tuple[str, str]] = []
    for kind, block in _BLOCKS:
        if kind == "console":
            for command, shown in COMMAND.findall(block):
                printed = carry_out(command, shown, tmp_path, refused="error[" in shown)
                if not _differs_by_machine(command):
                    current = shown_as_printed(shown, printed)
                    changes += (
                        [] if current == shown else [(f"$ {command}\n{shown}", f"$ {command}\n{current}")]
                    )
        elif kind == "diff":
            _edit(block, tmp_path)
        elif program := re.match(r"# (\w+\.py)\n", block):
            (tmp_path / program[1]).write_text(block, encoding="utf-8")
        else:
            text = (tmp_path / _EXCERPTED[kind]).read_text(encoding="utf-8")
            assert _is_excerpt(block, text), f"{_EXCERPTED[kind]} does not hold:\n{block}"
    if UPDATE and changes:
        page = text_of("docs/tutorial.md")
        for old, new in changes:
            page = page.replace(old, new)
        (ROOT / "docs" / "tutorial.md").write_text(page, encoding="utf-8")
        pytest.fail("docs/tutorial.md was rewritten")
    assert changes == []


def _differs_by_machine(command: str) -> bool:
    """Say if numbers of the output are real times, or results of physics."""
    return command.startswith("pytest") or "runs/physics" in command


def test_every_fenced_block_is_one_that_is_carried_out() -> None:
    fences = re.findall(r"^```(\S+)$", text_of("docs/tutorial.md"), re.MULTILINE)
    assert len(fences) == len(_BLOCKS) > 10
