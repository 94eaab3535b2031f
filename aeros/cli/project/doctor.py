"""`aeros doctor`: show which parts of AEROS work here, and how to get the others."""

from __future__ import annotations

import argparse
import json
from textwrap import wrap
from typing import TYPE_CHECKING

import aeros
from aeros.cli.arguments import add_command
from aeros.cli.help_text import screen_width
from aeros.exit_codes import Exit

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

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
        print(json.dumps(report, indent=2))
    else:
        print("\n".join(_lines(parts, screen_width())))
    return Exit.REJECTED if any(one.state is PartState.BROKEN for one in parts) else Exit.SUCCESS


def _lines(parts: Sequence[InstalledPart], width: int) -> Iterator[str]:
    yield f"aeros {aeros.__version__}"
    column = 2 + max(len(one.name) for one in parts)
    indent = " " * (column + 11)
    for one in parts:
        head = f"{one.name:{column}}{one.state.value:11}"
        texts = [one.found] + ([f"gives: {one.gives}", f"cure: {one.cure}"] if one.cure else [])
        lines = [line for text in texts for line in wrap(text, max(20, width - len(indent)))]
        yield head + lines[0]
        yield from (indent + line for line in lines[1:])
