"""docs/bus.md is executed: its programs, each named in its first line, and its commands, in order."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from aeros.runtime.bus.messages import Message
from aeros.runtime.bus.viewer import foxglove_messages
from tests.repo.pages.shown import COMMAND, carry_out
from tests.repo.tree import ROOT, text_of

_PAGE = text_of("docs/bus.md")
_BLOCK = re.compile(r"^```(python|console)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


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
    assert commands == 6


def test_every_type_that_the_page_names_has_a_shape() -> None:
    shapes = {one.ros for one in Message.__subclasses__()}
    assert foxglove_messages.SceneUpdate.ros in shapes
    named = set(re.findall(r"`(\w+/(?:msg|srv|action)/\w+)`", _PAGE))
    assert len(named) > 5
    for name in named:
        assert any(shape == name or shape.startswith(f"{name}_") for shape in shapes), name
