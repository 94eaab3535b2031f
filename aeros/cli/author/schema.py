"""`aeros schema`: print the JSON Schema of the files that people write, and of reports."""

from __future__ import annotations

import argparse
import json
from importlib import resources
from typing import TYPE_CHECKING, Any, Final

from aeros.cli.arguments import add_command
from aeros.cli.terminal.streams import print_data
from aeros.exit_codes import Exit
from aeros.spec.declared.json_schema import FILES, json_schema_of

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
examples:
  aeros schema ecm > .vscode/ecm.schema.json      then, as first line of an ecm.yaml:
                                                  # yaml-language-server: $schema=../.vscode/ecm.schema.json
  aeros schema site > .vscode/site.schema.json    the same for a site file
  aeros schema overlay > .vscode/overlay.schema.json  the same for an overlay on a site file
  aeros schema people > .vscode/people.schema.json  the same for a people file
  aeros schema faults > faults.schema.json        the same for a faults file
  aeros schema scene > scene.schema.json          the same for a scene file
  aeros schema tests > tests.schema.json          the same for a file of `aeros test`
  aeros schema report                             the output of `aeros verify --format json`
"""

_REPORT: Final = "report"


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "schema", __doc__, _EXAMPLES)
    parser.add_argument("name", choices=(*FILES, _REPORT), help="which schema")
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    schema = report_schema() if arguments.name == _REPORT else json_schema_of(arguments.name)
    print_data(json.dumps(schema, indent=2, ensure_ascii=True))
    return Exit.SUCCESS


def report_schema() -> dict[str, Any]:
    """Read the published schema of `aeros verify --format json`.

    Returns:
        The JSON Schema.
    """
    text = (resources.files("aeros") / "schemas" / "report.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema
