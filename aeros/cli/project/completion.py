"""`aeros completion`: print the script by which a shell completes commands, options and paths."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.cli.arguments import add_command, existing_folder, existing_path, writable_path
from aeros.cli.setting_defaults import inner_parsers
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_SHELLS: Final = ("bash", "zsh", "tcsh")

_EXAMPLES = """\
The script knows the commands of this version: make it again after an upgrade.

examples:
  aeros completion bash > ~/.local/share/bash-completion/completions/aeros
  aeros completion zsh > ~/.zfunc/_aeros        a folder in `fpath`, before `compinit` is called
  source <(aeros completion bash)               for this shell alone
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "completion", __doc__, _EXAMPLES)
    parser.add_argument("shell", choices=_SHELLS, help="the shell")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    import shtab  # only this command needs it

    from aeros.cli.parsers import all_parsers

    parser = all_parsers()
    for action in _actions(parser):
        if action.type in (existing_folder, existing_path, writable_path, Path):
            # shtab looks for this attribute; argparse has no place for it.
            action.complete = shtab.FILE  # type: ignore[attr-defined]
    print_data(shtab.complete(parser, shell=arguments.shell))
    return Exit.SUCCESS


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    yield from parser._actions  # argparse lists them nowhere else
    for inner in inner_parsers(parser):
        yield from _actions(inner)
