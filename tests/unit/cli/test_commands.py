"""The table of commands: each is in one group, and its module adds it."""

from __future__ import annotations

import importlib

from aeros.cli.commands import COMMANDS, GROUPS, MODULES_OF_SEVERAL, OFTEN_USED


def test_each_command_is_in_one_group_and_its_module_has_code_for_it() -> None:
    assert sum(len(group.commands) for group in GROUPS.values()) == len(COMMANDS)
    assert set(OFTEN_USED) <= set(COMMANDS)
    assert {entry.module for entry in COMMANDS.values()} >= MODULES_OF_SEVERAL
    for entry in COMMANDS.values():
        assert callable(importlib.import_module(f"aeros.cli.{entry.module}").add_to)
