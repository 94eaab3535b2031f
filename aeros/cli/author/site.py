"""`aeros site`: list the names of a site: volumes, cameras, variables, actions, limits, and access."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.apps.site_listing import as_json, as_text, site_tables
from aeros.cli.arguments import add_command, existing_path
from aeros.cli.terminal.streams import print_data, print_line
from aeros.exit_codes import Exit
from aeros.runtime.registry.installed import InstalledModules
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import decode_site, load_site

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES: Final = """\
A module uses these names, or binds its own to them by `needs`.  Numbers are those of the site file.

examples:
  aeros site                          the site in force on this robot, or else the reference site
  aeros site cell.yaml                a site file, or an overlay with its site
  aeros site --only cameras actions
  aeros site --format json
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "site", __doc__, _EXAMPLES)
    parser.add_argument("site", nargs="?", type=existing_path, help="the site file, or an overlay on it")
    parser.add_argument(
        "--only",
        nargs="+",
        metavar="WORD",
        default=[],
        help="only tables with such a word in their title, as in `cameras`",
    )
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the robot's own folder (default: .aeros)"
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    path = arguments.site
    if path is None:
        registry = InstalledModules(arguments.state)
        path = registry.site_file(registry.snapshot())
    diagnostics = Diagnostics()
    load_site(path, diagnostics)
    diagnostics.raise_if_errors()
    declared = decode_site(path)
    if declared is None:
        raise AssertionError("a site that was not read was not reported")
    tables = site_tables(declared)
    chosen = [
        table
        for table in tables
        if not arguments.only or any(word.lower() in table.title.split() for word in arguments.only)
    ]
    if not chosen:
        titles = ", ".join(table.title for table in tables)
        print_line(f"no table has such a word in its title; there are {titles}")
        return Exit.USAGE
    if arguments.format == "json":
        print_data(json.dumps({"id": declared.id.value, **as_json(chosen)}, indent=2))
        return Exit.SUCCESS
    print_line(f"{declared.id.value}: {declared.description.value}")
    for line in as_text(chosen).splitlines():
        print_line(line)
    return Exit.SUCCESS
