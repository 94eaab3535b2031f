"""The table of commands: each is in one group, and its module adds it."""

from __future__ import annotations

import importlib
import re

from aeros.cli.commands import COMMANDS, GROUPS, MODULES_OF_SEVERAL, OFTEN_USED
from aeros.cli.help_text import option_names
from aeros.cli.parsers import command_parser
from tests.repo.tree import text_of

_OPTIONS = re.compile(r"^### aeros (\w+)\n\n(.*?)(?=\n\n[^|]|\Z)", re.DOTALL | re.MULTILINE)
"""A table of options, with the name of its command."""


def test_each_command_is_in_one_group_and_its_module_has_code_for_it() -> None:
    assert sum(len(group.commands) for group in GROUPS.values()) == len(COMMANDS)
    assert set(OFTEN_USED) <= set(COMMANDS)
    assert {entry.module for entry in COMMANDS.values()} >= MODULES_OF_SEVERAL
    for entry in COMMANDS.values():
        assert callable(importlib.import_module(f"aeros.cli.{entry.module}").add_to)


def test_the_page_lists_each_command_in_its_group_and_no_option_that_is_not_there() -> None:
    sections = re.split(r"^## ", text_of("docs/commands.md"), flags=re.MULTILINE)[1:]
    assert [one.partition(":")[0] for one in sections] == list(GROUPS)
    for section, group in zip(sections, GROUPS.values(), strict=True):
        rows = re.findall(r"^\| (`aeros .*?) \|", section, flags=re.MULTILINE)
        named = {word for row in rows for word in re.findall(r"[\w-]+", row)}
        assert named >= set(group.commands)
        for name, row in re.findall(
            r"^### aeros (\w+)\n\n(.*?)(?=\n\n[^|]|\Z)", section, re.DOTALL | re.MULTILINE
        ):
            first_cells = "".join(re.findall(r"^\|(.*?)\|", row, flags=re.MULTILINE))
            given = re.findall(r"--?[\w][\w-]*", first_cells)
            assert given
            assert set(given) <= set(option_names(command_parser(name)))
