"""`aeros diff`: compare two modules or sites; list newly allowed and newly denied actions."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from aeros.cli.arguments import add_colour, add_command, add_solver_limits, existing_path
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.terminal.rendering import painter, print_table
from aeros.cli.terminal.streams import output_width, print_coloured, print_data
from aeros.exit_codes import Exit
from aeros.spec.backends.oracle import Oracle
from aeros.spec.backends.resource_limit import MAX_TIMEOUTS
from aeros.spec.diagnostics.codes import Severity
from aeros.spec.diagnostics.render import Paint, escape_invisible, render_all, render_json
from aeros.spec.difference.compare import PolicyDifference, compare, is_site
from aeros.spec.difference.policy_change import PolicyChange, Relation
from aeros.spec.text.discovery import reference_site_path

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
Each skill and action kind (for sites: each action kind) is compared over all states, parameters and
inputs.  The report lists what is newly allowed and what is newly denied, with witnesses that were
replayed.  So are access, limits, perceivers, tools and the rest of the policy.  Every other field is
compared by its text, and a change of it is listed as changed.  Neither side is verified; use `aeros verify`.

examples:
  aeros diff released/wrap ecms/wrap                          two versions of a module
  aeros diff released ecms --site cell.yaml                   two folders of modules, under a site
  aeros diff old/polish polish --set polish.force="6 N"       a module whose needs or parameters are open
  aeros diff cell.yaml cell_after_assessment.yaml             two versions of a site
  aeros diff released ecms --fail-on newly-allowed            for a review: 1 if anything is newly allowed
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "diff", __doc__, _EXAMPLES)
    for name in ("old", "new"):
        parser.add_argument(
            name,
            type=existing_path,
            metavar=name.upper(),
            help="a module, a folder of modules, or a site file",
        )
    parser.add_argument(
        "--site",
        type=existing_path,
        help="the site under which modules are compared (default: the reference site, a Panda cell)",
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.add_argument(
        "--fail-on", choices=("newly-allowed",), help="exit with 1 if anything is newly allowed"
    )
    add_module_settings(parser)
    add_solver_limits(parser)
    add_colour(parser)
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    old, new = arguments.old, arguments.new
    if is_site(old) != is_site(new):
        print("aeros: one of the two is a site file, the other holds modules", file=sys.stderr)
        return Exit.USAGE
    configurations = module_configurations(arguments)
    is_site_given = arguments.site is not None and "site" not in arguments.from_settings
    if is_site(old) and (is_site_given or configurations):
        given = "--bind` and `--set` are" if configurations else "--site` is"
        print(f"aeros: `{given} for comparing modules; these are site files", file=sys.stderr)
        return Exit.USAGE
    oracle = Oracle(arguments.rlimit, seconds=arguments.question_timeout, max_timeouts=MAX_TIMEOUTS)
    difference = compare(old, new, arguments.site or reference_site_path(), oracle, configurations)
    if arguments.format == "json":
        print_data(json.dumps(_as_json(difference), indent=1, ensure_ascii=True))
    else:
        _print_text(difference, painter(sys.stdout, arguments.color))
    if any(problem.severity is Severity.ERROR for problem in difference.problems):
        return Exit.REJECTED
    if arguments.fail_on and difference.allows_more:
        return Exit.REJECTED
    return Exit.UNDECIDED if difference.undecided else Exit.SUCCESS


def _print_text(difference: PolicyDifference, paint: Paint | None) -> None:
    changed = [one for one in difference.changes if one.relation is not Relation.EQUAL]
    diagnostics = [*difference.problems, *(diagnostic for one in changed for diagnostic in one.diagnostics)]
    if diagnostics:
        print_coloured(render_all(diagnostics, paint=paint, width=output_width()))
    print_table([(escape_invisible(one.subject), one.relation.value) for one in changed])
    if difference.changes:
        print(f"{len(difference.changes) - len(changed)} of {len(difference.changes)} subjects are equal")


def _as_json(difference: PolicyDifference) -> dict[str, Any]:
    return {
        "schema": "aeros/difference/1",
        "newly_allowed": difference.allows_more,
        "undecided": difference.undecided,
        "problems": [render_json(problem) for problem in difference.problems],
        "changes": [_change_json(one) for one in difference.changes],
    }


def _change_json(change: PolicyChange) -> dict[str, Any]:
    return {
        "subject": change.subject,
        "relation": change.relation.value,
        "witnesses": {direction: witness.lines() for direction, witness in change.witnesses.items()},
        "diagnostics": [render_json(diagnostic) for diagnostic in change.diagnostics],
    }
