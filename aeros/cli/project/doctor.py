"""`aeros doctor`: show which parts of AEROS work here, and how to get the others."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

import aeros
from aeros.cli.arguments import add_command
from aeros.cli.terminal.rendering import print_table
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit

if TYPE_CHECKING:
    from collections.abc import Iterator

    from aeros.apps.installation import InstalledPart

    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
The exit code is 1 if a part is broken that every command needs, and 0 if only extras are missing.

examples:
  aeros doctor                  what works, what is missing, and how to get it
  aeros doctor --format json    for programs
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "doctor", __doc__, _EXAMPLES)
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    from aeros.apps.installation import PartState, examine_installation

    parts = list(examine_installation())
    if arguments.format == "json":
        rows = [{**one._asdict(), "state": one.state.value} for one in parts]
        report = {"schema": "aeros/installation/1", "aeros": aeros.__version__, "parts": rows}
        print_data(json.dumps(report, indent=2))
    else:
        print(f"aeros {aeros.__version__}")
        print_table(row for one in parts for row in _rows(one))
    return Exit.REJECTED if any(one.state is PartState.BROKEN for one in parts) else Exit.SUCCESS


def _rows(one: InstalledPart) -> Iterator[tuple[str, str, str]]:
    yield one.name, one.state.value, one.found
    if one.cure:
        yield "", "", f"gives: {one.gives}"
        yield "", "", f"cure: {one.cure}"
