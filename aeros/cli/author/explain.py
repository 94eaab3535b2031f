"""`aeros explain`: explain a diagnostic code: its meaning, its effect on a robot, and how to repair it."""

from __future__ import annotations

import argparse
import re
import sys
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from aeros.cli.arguments import add_command
from aeros.cli.terminal.rendering import markdown_text, print_table
from aeros.cli.terminal.streams import output_width, print_coloured, shows_colour
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.codes import CODES, DiagnosticCode, did_you_mean
from aeros.spec.diagnostics.render import escape_invisible

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
examples:
  aeros explain AE501                 the page of one code
  aeros explain invariant-violated    the same, by its name
  aeros explain AE50                  the codes that begin so
  aeros explain                       all codes by group
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "explain", __doc__, _EXAMPLES)
    parser.add_argument("code", nargs="?", metavar="CODE", help="a code or its name; all codes if absent")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    if arguments.code is None:
        _print_codes()
        return Exit.SUCCESS
    asked = arguments.code.strip()
    slugs = {code.slug: code.id for code in CODES.values()}
    found = asked.upper() if asked.upper() in CODES else slugs.get(asked.lower())
    if found is None and (group := _codes_that_begin(asked.upper())):
        print_table(group)
        return Exit.SUCCESS
    if found is None:
        near = did_you_mean(asked.upper().replace("O", "0").replace("I", "1"), CODES) or did_you_mean(
            asked.lower(), slugs
        )
        hint = f"; did you mean `{near}`?" if near else "; `aeros explain` lists all codes"
        print(f"aeros: there is no code `{escape_invisible(asked)}`{hint}", file=sys.stderr)
        return Exit.USAGE
    page = (pages() / f"{found}.md").read_text(encoding="utf-8")
    if sys.stdout.isatty():
        print_coloured(markdown_text(page, output_width() or 0, colour=shows_colour(sys.stdout)))
    else:
        print(page, end="")
    return Exit.SUCCESS


def _print_codes() -> None:
    """Print every code with its summary, by group."""
    for place, group in enumerate(dict.fromkeys(code.group for code in CODES.values())):
        print(f"\n{group}" if place else group)
        print_table([_row(one) for one in CODES.values() if one.group == group], indent=2)


def _codes_that_begin(text: str) -> list[tuple[str, str, str]]:
    """Return the codes that begin so, as `AE5` or `AE50x`; none for a text that is no such beginning."""
    begin = re.fullmatch(r"(AE\d{0,2})X{0,3}", text)
    return [] if begin is None else [_row(one) for one in CODES.values() if one.id.startswith(begin[1])]


def _row(code: DiagnosticCode) -> tuple[str, str, str]:
    return code.id, code.slug, code.summary


def pages() -> Traversable:
    """Return the folder of the pages: in the installed package, or in the repository.

    Returns:
        A folder with one Markdown page for each code.
    """
    package = resources.files("aeros")
    installed = package / "docs" / "codes"
    return installed if installed.is_dir() else Path(str(package)).parent / "docs" / "codes"
