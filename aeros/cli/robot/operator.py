"""Commands of the operator: policy, block, unblock, pause, resume, stop, release."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.agent.recovery.quarantine import Quarantine
from aeros.cli.arguments import add_command, existing_path
from aeros.cli.terminal import print_line
from aeros.exit_codes import Exit
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import MotionTimeoutError, request_command
from aeros.runtime.registry.operator_block import OperatorBlock, parse_digest, parse_versions
from aeros.runtime.registry.registry import Registry
from aeros.spec.diagnostics.render import escape_invisible

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_DESCRIPTIONS: Final = {
    "block": "Deny all actions of a module, of some of its versions, of one of its skills, or of an action "
    "kind, in every run on this robot: running now and started later, wherever its modules come from.",
    "unblock": "Remove a block.",
    "policy": "Set the site policy of this robot, for every run on it, or show the one in force.",
    "repair": "Put the last recorded change in force again, after the registry's database was lost, damaged "
    "or replaced by an older one.",
    "pause": "Pause: no new action starts until `aeros resume`; running motions finish.",
    "resume": "Let actions start again.",
    "stop": "Stop all motion and end the run.",
    "release": "Lift the quarantine of an agent that crashed repeatedly.",
}
_EXAMPLES: Final = {
    "block": """\
  aeros block --id press-under-repair --reason "the press is open" --module make_dumplings --skill wrap
  aeros block --id no-gripping --reason "a finger is worn" --action grip
  aeros block --id old-tidy --reason "drops cups" --module tidy --version "<1.2"
  aeros block --id bad-build --reason "wrong model" --digest sha256:1234…
""",
    "unblock": "  aeros unblock press-under-repair\n",
    "policy": "  aeros policy cell.yaml\n  aeros policy\n",
    "repair": "  aeros repair\n  aeros audit verify .aeros/registry/audit.jsonl\n",
    "pause": "  aeros pause\n",
    "resume": "  aeros resume\n",
    "stop": "  aeros stop\n",
    "release": "  aeros release\n  aeros run --resume --watchdog\n",
}


def add_to(commands: Subparsers, name: str) -> None:
    """Add one of this module's commands and its arguments.

    Args:
        commands: Subparsers of `aeros`.
        name: The command's name.
    """
    parser = add_command(commands, name, _DESCRIPTIONS[name], f"examples:\n{_EXAMPLES[name]}")
    if name == "block":
        parser.add_argument("--id", required=True, type=_named(_BLOCK_NAME), help="short name of the block")
        parser.add_argument("--reason", required=True, type=_reason, help="reason shown in denials")
        parser.add_argument("--module", type=_named(_IDENTIFIER), help="the module it blocks")
        parser.add_argument(
            "--version",
            type=_checked(parse_versions),
            help="the versions of that module it blocks: one, as in 1.0.0, or a range, as in '<1.2'",
        )
        parser.add_argument(
            "--digest",
            type=_checked(parse_digest),
            metavar="sha256:HEX",
            help="the files it blocks: a module's digest, as `aeros list` and `aeros bundle` print it",
        )
        parser.add_argument("--skill", type=_named(_IDENTIFIER), help="the skill of that module it blocks")
        parser.add_argument("--action", help="the action kind it blocks")
    elif name == "unblock":
        parser.add_argument("id", help="the name of the block")
    elif name == "policy":
        parser.add_argument("site", nargs="?", type=existing_path, help="the site file")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the robot's own folder (default: .aeros)"
    )
    parser.set_defaults(command=_COMMANDS[name])


def _block(arguments: argparse.Namespace) -> Exit:
    if arguments.version is not None and arguments.module is None:
        print("aeros: --version needs --module", file=sys.stderr)
        return Exit.USAGE
    if arguments.module is None and arguments.action is None and arguments.digest is None:
        print("aeros: give --module, with or without --skill, or --action, or --digest", file=sys.stderr)
        return Exit.USAGE
    parts = (arguments.module, arguments.skill, arguments.action, arguments.version, arguments.digest)
    registry = Registry(arguments.state)
    registry.add_block(OperatorBlock(arguments.id, arguments.reason, *parts))
    print_line(f"{arguments.id} is in force")
    if arguments.module not in (None, *registry.snapshot().modules):
        print_line(
            f"`{arguments.module}` is not installed; the block holds for runs that load it from a folder"
        )
    return Exit.SUCCESS


def _unblock(arguments: argparse.Namespace) -> Exit:
    Registry(arguments.state).remove_block(arguments.id)
    print_line(f"block {arguments.id} removed")
    return Exit.SUCCESS


def _policy(arguments: argparse.Namespace) -> Exit:
    registry = Registry(arguments.state)
    if arguments.site is not None:
        registry.set_policy(arguments.site)
    configuration, _ = registry.configuration()
    print_line(f"{configuration.site.id} is in force; sha256:{configuration.site.digest}")
    return Exit.SUCCESS


def _repair(arguments: argparse.Namespace) -> Exit:
    snapshot = Registry(arguments.state).repair()
    if snapshot is None:
        print("nothing to repair: the registry agrees with its record of changes")
    else:
        print(f"the last recorded change is in force again, as change {snapshot.generation}")
    return Exit.SUCCESS


_BLOCK_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}"), "letters, digits, `-`, `_` and `.`"
_IDENTIFIER: Final = re.compile(r"[a-z][a-z0-9_]*"), "a lower-case letter, then letters, digits and `_`"


def _named(form: tuple[re.Pattern[str], str]) -> Callable[[str], str]:
    """Make an argument type of names, so that no block is in force that can reach nothing."""
    pattern, words = form

    def named(text: str) -> str:
        if not pattern.fullmatch(text):
            raise argparse.ArgumentTypeError(f"`{escape_invisible(text)}` is no name: expected {words}")
        return text

    return named


def _reason(text: str) -> str:
    if not text.strip():
        raise argparse.ArgumentTypeError("expected some words")
    if any("\ud800" <= character <= "\udfff" for character in text):
        raise argparse.ArgumentTypeError("it is not text in UTF-8")
    return text


def _checked(parse: Callable[[str], str]) -> Callable[[str], str]:
    """Make an argument type of a parser that raises ValueError."""

    def parsed(text: str) -> str:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return parsed


def _release(arguments: argparse.Namespace) -> Exit:
    was = Quarantine(arguments.state).clear()
    print("quarantine lifted; the agent can start again" if was else "the agent is not quarantined")
    return Exit.SUCCESS


def _command_for(command: OperatorCommand, done: str) -> Callable[[argparse.Namespace], Exit]:
    def ask_it(arguments: argparse.Namespace) -> Exit:
        folder = Registry(arguments.state).folder
        if not folder.is_dir():
            print(f"aeros: no robot runs from `{arguments.state}`", file=sys.stderr)
            return Exit.REJECTED
        try:
            request_command(folder, command)
        except MotionTimeoutError as late:
            print(f"aeros: still moving {late}; use the robot's emergency stop", file=sys.stderr)
            return Exit.REJECTED
        print(done)
        return Exit.SUCCESS

    return ask_it


_COMMANDS: Final = {
    "block": _block,
    "unblock": _unblock,
    "policy": _policy,
    "repair": _repair,
    "pause": _command_for(OperatorCommand.PAUSE, "paused: no action starts until `aeros resume`"),
    "resume": _command_for(OperatorCommand.RUN, "resumed"),
    "stop": _command_for(OperatorCommand.STOP, "stopped"),
    "release": _release,
}
