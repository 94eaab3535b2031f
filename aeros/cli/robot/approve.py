"""`aeros approve`: list, approve or reject requests of clients of `aeros mcp`."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aeros.apps.mcp.approvals import ApprovalError, approve, pending_requests, reject
from aeros.cli.arguments import add_command
from aeros.cli.terminal.streams import print_data, print_line
from aeros.exit_codes import Exit
from aeros.spec.diagnostics.render import escape_invisible

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES = """\
An approval covers exactly the listed content, is used once, and expires after ten minutes.

examples:
  aeros approve                     list pending requests
  aeros approve 3f9c01aa
  aeros approve 3f9c01aa --reject
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "approve", __doc__, _EXAMPLES)
    parser.add_argument("id", nargs="?", help="id of the pending request (default: list pending requests)")
    parser.add_argument("--reject", action="store_true", help="reject the request")
    parser.add_argument(
        "--format", choices=("text", "json"), default="text", help="format of the list (default: text)"
    )
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the robot's own folder (default: .aeros)"
    )
    parser.set_defaults(command=_command)


def _command(arguments: argparse.Namespace) -> Exit:
    if arguments.id is None:
        if arguments.reject:
            print("aeros: --reject needs the id of a request", file=sys.stderr)
            return Exit.USAGE
        waiting = pending_requests(arguments.state)
        if arguments.format == "json":
            print_data(json.dumps(waiting, indent=1))
        else:
            print("\n".join(map(_format_request, waiting)) or "no pending approvals")
        return Exit.SUCCESS
    try:
        (reject if arguments.reject else approve)(arguments.state, arguments.id)
    except (ApprovalError, OSError) as error:
        print(f"aeros: {escape_invisible(str(error))}", file=sys.stderr)
        return Exit.REJECTED
    print_line(
        f"{arguments.id} is {'rejected' if arguments.reject else 'approved, once and within ten minutes'}"
    )
    return Exit.SUCCESS


def _format_request(one: Mapping[str, Any]) -> str:
    asked = one.get("asked")
    ago = f", {time.time() - asked:.0f} s ago" if type(asked) is float else ""
    lines = [f"{one.get('id')}  {one.get('what')}, requested by {one.get('client')}{ago}"]
    if one.get("task"):
        lines.append(f"    for {one['task']}")
    steps = one.get("steps")
    for step in steps if type(steps) is list else []:
        given = step.get("inputs") if type(step) is dict else None
        inputs_text = f" {json.dumps(given)}" if given else ""
        lines.append(f"    {step.get('skill') if type(step) is dict else step}{inputs_text}")
    if one.get("goal"):
        lines.append(f"    until {one['goal']}")
    return "\n".join(escape_invisible(line) for line in lines)
