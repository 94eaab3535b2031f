"""`aeros import bt`: turn a behaviour tree of BehaviorTree.CPP or Groot2 into a composition."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aeros.apps.trees.composition_text import ManifestConflictError, composition_text, with_composition
from aeros.apps.trees.leaves import ImportSettings, identifier
from aeros.apps.trees.library import collect_trees, leaf_names
from aeros.apps.trees.tree_import import ImportedTree, NodeReport, import_tree
from aeros.apps.trees.tree_xml import TreeFileError, read_tree_files
from aeros.cli.arguments import add_command, existing_path
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit, UsageError
from aeros.files import replace_durably
from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.text.files import read_source

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
Each node becomes a part of the composition with the same order of leaves, or it is refused with its
line and the reason.  Nothing is written if a node is refused.  Give all files that have subtrees of
the tree.  docs/how-to/behaviour-trees.md lists the nodes.

examples:
  aeros import bt tidy.xml                                    print the composition
  aeros import bt tidy.xml subtrees.xml --tree Tidy           one tree of several
  aeros import bt tidy.xml --into ecms/tidy                   add it to a module's manifest
  aeros import bt tidy.xml --action OpenGripper=open --condition IsHolding="holding and not tired"
  aeros import bt tidy.xml --format json                      the report, for programs
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    outer = add_command(commands, "import", __doc__, _EXAMPLES)
    kinds = outer.add_subparsers(metavar="KIND", required=True)
    parser = add_command(kinds, "bt", __doc__, _EXAMPLES)
    parser.add_argument("files", nargs="+", type=existing_path, metavar="FILE", help="XML, v4 or v3")
    parser.add_argument("--tree", metavar="ID", help="the tree (default: the first file's main tree)")
    parser.add_argument("--name", help="the composition's name (default: the tree's ID in lower case)")
    parser.add_argument(
        "--action", action="append", default=[], metavar="ID=SKILL", help="the skill that an action runs"
    )
    parser.add_argument(
        "--condition",
        action="append",
        default=[],
        metavar="ID=EXPRESSION",
        help="the condition on the state that a condition stands for",
    )
    parser.add_argument(
        "--assume-actions", action="store_true", help="take leaves that no file declares for actions"
    )
    parser.add_argument("--ignore-ports", action="store_true", help="leave out the ports of leaves")
    parser.add_argument("--into", type=_manifest_path, metavar="MODULE", help="add it to a module's manifest")
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


def _manifest_path(text: str) -> Path:
    """Parse the argument of a module's folder or manifest.

    Raises:
        argparse.ArgumentTypeError: it is neither.
    """
    path = existing_path(text)
    manifest = path / "ecm.yaml" if path.is_dir() else path
    if manifest.name != "ecm.yaml" or not manifest.is_file():
        raise argparse.ArgumentTypeError(f"`{text}`: is neither a module's folder nor its `ecm.yaml`")
    return path


def _command(arguments: argparse.Namespace) -> Exit:
    settings = ImportSettings(
        _bindings(arguments.action, "--action"),
        _bindings(arguments.condition, "--condition"),
        arguments.assume_actions,
        arguments.ignore_ports,
    )
    try:
        library = collect_trees(read_tree_files(arguments.files))
    except TreeFileError as error:
        if arguments.format == "json":
            refused = NodeReport(error.path, error.line, "", error.reason)
            print_data(json.dumps(_report(ImportedTree(None, (refused,)), "", ""), indent=2))
        print(f"aeros: {escape_invisible(str(error))}", file=sys.stderr)
        return Exit.REJECTED
    tree = arguments.tree or library.first_tree
    if tree not in library.trees:
        place = "" if arguments.tree else f"{library.first_place}: "
        raise UsageError(place + _missing_tree(tree, library.trees))
    for option, bound in (("--action", settings.skills), ("--condition", settings.conditions)):
        _require_known(option, bound, leaf_names(library))
    doubled = settings.skills.keys() & settings.conditions.keys()
    if doubled:
        raise UsageError(f"`{min(doubled)}` is bound both by --action and by --condition; leave out one")
    found = import_tree(library, tree, settings)
    name = identifier(arguments.name or tree)
    text = "" if found.part is None else composition_text(name, f"the behaviour tree {tree}", found.part)
    if arguments.format == "json":
        print_data(json.dumps(_report(found, tree, name), indent=2))
    else:
        for one in found.reports:
            print(escape_invisible(_line(one)), file=sys.stderr)
        count = len(found.reports)
        print(f"{tree}: {count - len(found.refused)} of {count} nodes imported", file=sys.stderr)
    if found.part is None:
        return Exit.REJECTED
    if arguments.into is not None:
        return _add_to_module(arguments.into, name, text)
    if arguments.format == "text":
        print_data(f"compositions:\n{text}", end="")
    return Exit.SUCCESS


def _bindings(given: Iterable[str], option: str) -> dict[str, str]:
    found = {}
    for one in given:
        name, equal, value = one.partition("=")
        if not equal or not name.strip() or not value.strip():
            raise UsageError(f"`{option} {one}` is not of the form ID=VALUE")
        found[name.strip()] = value.strip()
    return found


def _require_known(option: str, bound: Iterable[str], known: set[str]) -> None:
    """Refuse a binding of a leaf that no tree has.

    Raises:
        UsageError: there is one.
    """
    for name in bound:
        if name not in known:
            nearest = did_you_mean(name, sorted(known))
            cure = f"; did you mean `{nearest}`?" if nearest else ""
            raise UsageError(f"`{option} {name}=…`: no leaf `{name}` is in these files{cure}")


def _missing_tree(tree: str, known: Iterable[str]) -> str:
    listed = ", ".join(f"`{one}`" for one in sorted(known))
    if not listed:
        return "no <BehaviorTree> is in these files"
    if not tree:
        return f"several trees could be the main one; choose by --tree among {listed}"
    nearest = did_you_mean(tree, list(known))
    return f"no tree `{tree}` is in these files" + (
        f"; did you mean `{nearest}`?" if nearest else f", which have {listed}"
    )


def _add_to_module(folder: Path, name: str, text: str) -> Exit:
    path = folder / "ecm.yaml" if folder.is_dir() else folder
    try:
        manifest = read_source(path).text
        replace_durably(path, with_composition(manifest, name, text).encode(), is_private=False)
    except ManifestConflictError as error:
        print(f"aeros: {path}: {error}", file=sys.stderr)
        return Exit.REJECTED
    except OSError as error:
        print(f"aeros: {path} cannot be written: {error}", file=sys.stderr)
        return Exit.REJECTED
    print(f"added the composition `{name}` to {path}; `aeros verify {folder}` proves it", file=sys.stderr)
    return Exit.SUCCESS


def _line(one: NodeReport) -> str:
    place = f"{one.path}:{one.line}: {one.node}"
    return f"{place} refused: {one.reason}" if one.reason else f"{place} imported as {one.note}"


def _report(found: ImportedTree, tree: str, name: str) -> dict[str, Any]:
    nodes = [
        {"file": one.path, "line": one.line, "node": one.node}
        | ({"refused": one.reason} if one.reason else {"imported_as": one.note})
        for one in found.reports
    ]
    return {
        "schema": "aeros/import/1",
        "tree": tree,
        "imported": found.part is not None,
        "composition": name,
        "do": found.part,
        "nodes": nodes,
    }
