"""`aeros new`: create a module, a site, checks in CI, or a project with all of them, from a template."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from aeros.cli.arguments import add_command
from aeros.cli.author.new import module, project

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
What is created is proved and works unchanged.  Nothing that exists is overwritten.

examples:
  aeros new project cell                      the folder cell/: site, module, tests, CI; all green at once
  aeros new ecm tidy                          a module for the reference site, with tests
  aeros new ecm tidy --site cell.yaml         ... for a site of your own
  aeros new site cell                         the file cell.yaml, with comments
  aeros new ci                                a workflow and a hook that run `aeros verify`
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its own commands.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "new", __doc__, _EXAMPLES)
    kinds = parser.add_subparsers(required=True, title="commands", metavar="WHAT")
    module.add_to(kinds)
    project.add_to(kinds)
