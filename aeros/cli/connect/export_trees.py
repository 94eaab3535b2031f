"""`aeros export bt`: write a composition as a behaviour tree that Groot2 and BehaviorTree.CPP read."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from aeros.apps.trees.tree_export import UnexportableError, export_tree
from aeros.cli.arguments import add_command, existing_path, writable_path
from aeros.cli.author.module_argument import add_module, read_module, select_declared
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit
from aeros.files import replace_durably
from aeros.spec.model.composition import handler_cycle

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
The tree is BehaviorTree.CPP v4 XML with a TreeNodesModel.  It runs its leaves in the composition's order.
Skills are actions, conditions are leaves `StateCondition` with the expression as a port.

examples:
  aeros export bt ecms/inspect_table                             the module's first composition
  aeros export bt ecms/inspect_table --composition look_round --output tree.xml
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    outer = add_command(commands, "export", __doc__, _EXAMPLES)
    kinds = outer.add_subparsers(metavar="KIND", required=True)
    parser = add_command(kinds, "bt", __doc__, _EXAMPLES)
    add_module(parser)
    parser.add_argument("--composition", help="the composition (default: the module's first)")
    add_module_settings(parser)
    parser.add_argument(
        "--site", type=existing_path, help="the site file (default: the reference site, a Panda cell)"
    )
    parser.add_argument(
        "--output", type=_file_path, metavar="FILE", help="write to a file (default: standard output)"
    )
    parser.set_defaults(command=_command)


def _file_path(text: str) -> Path:
    """Parse the path of a file to write: a new one, or one that may be replaced.

    Raises:
        argparse.ArgumentTypeError: something else is there, as a device or a pipe.
    """
    path = writable_path(text)
    if path.exists() and not path.is_file():
        raise argparse.ArgumentTypeError(
            f"`{text}`: is not a regular file; leave out the option to print the tree"
        )
    return path


def _command(arguments: argparse.Namespace) -> Exit:
    ecm, _ = read_module(
        arguments.module, arguments.ecms or (), arguments.site, module_configurations(arguments)
    )
    composition = select_declared(ecm, "composition", ecm.compositions, arguments.composition)
    try:
        if handler_cycle(composition):
            print(f"aeros: the handlers of `{composition.id}` lead back to each other", file=sys.stderr)
            return Exit.REJECTED
        text = export_tree(ecm, composition)
    except UnexportableError as error:
        print(f"aeros: `{composition.id}` cannot be exported: {error}", file=sys.stderr)
        return Exit.REJECTED
    if arguments.output is None:
        print_data(text, end="")
    else:
        replace_durably(arguments.output, text.encode(), is_private=False)
    return Exit.SUCCESS
