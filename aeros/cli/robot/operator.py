"""Commands of the operator: policy, block, unblock, pause, resume, stop, release."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.agent.recovery.quarantine import Quarantine
from aeros.cli.arguments import add_command, existing_path
from aeros.cli.module_settings import print_waiting
from aeros.cli.terminal.rendering import print_diagnostics
from aeros.cli.terminal.streams import print_line
from aeros.exit_codes import Exit
from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.registry.control_page import MotionTimeoutError, request_command
from aeros.runtime.registry.operator_block import (
    OperatorBlock,
    parse_block_id,
    parse_digest,
    parse_name,
    parse_reason,
    parse_versions,
)
from aeros.runtime.registry.registry import Registry
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, did_you_mean
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.summary import summarize_site
from aeros.spec.obligations.absent_modules import absent_settings, policy_name_obligations

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_DESCRIPTIONS: Final = {
    "block": "Deny all actions of a module, of some of its versions, of one of its skills, or of an action "
    "kind, of the tools behind a channel, or of the modules that ask for a computing device, in every run on "
    "this robot: running now and started later, wherever its modules come from.",
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
  aeros block --id no-cookbook --reason "its answers are wrong" --action ask_cookbook # switches a tool off
  aeros block --id offline --reason "the line is down" --channel internet # switches off all tools behind it
  aeros block --id no-gpu --reason "it overheats" --device gpu # and with it the modules that ask for it
  aeros block --id old-tidy --reason "drops cups" --module tidy --version "<1.2"
  aeros block --id bad-build --reason "wrong model" --digest sha256:1234…
""",
    "unblock": "  aeros unblock press-under-repair\n",
    "policy": """\
  aeros policy site.yaml
  aeros policy cell.yaml        an overlay: grants, blocks and settings on top of a site file
  aeros policy                  the policy in force, with what it grants each module
""",
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
        parser.add_argument(
            "--id", required=True, type=_checked(parse_block_id), help="short name of the block"
        )
        parser.add_argument(
            "--reason", required=True, type=_checked(parse_reason), help="reason shown in denials"
        )
        parser.add_argument("--module", type=_checked(parse_name), help="the module it blocks")
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
        parser.add_argument("--skill", type=_checked(parse_name), help="the skill of that module it blocks")
        parser.add_argument("--action", type=_checked(parse_name), help="the action kind or tool it blocks")
        parser.add_argument(
            "--channel", type=_checked(parse_name), help="the channel it blocks, with every tool that uses it"
        )
        parser.add_argument(
            "--device",
            type=_checked(parse_name),
            help="the computing device it blocks, with every module that asks for it",
        )
    elif name == "unblock":
        parser.add_argument("id", help="the name of the block")
    elif name == "policy":
        parser.add_argument("site", nargs="?", type=existing_path, help="the site file, or an overlay on it")
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the robot's own folder (default: .aeros)"
    )
    parser.set_defaults(command=_COMMANDS[name])


def _block(arguments: argparse.Namespace) -> Exit:
    if arguments.version is not None and arguments.module is None:
        print("aeros: --version needs --module", file=sys.stderr)
        return Exit.USAGE
    if arguments.skill is not None and arguments.module is None:
        print("aeros: --skill needs --module", file=sys.stderr)
        return Exit.USAGE
    named = ("module", "skill", "action", "version", "digest", "channel", "device")
    parts = {name: getattr(arguments, name) for name in named}
    if all(part is None for part in parts.values()):
        print(
            "aeros: give --module, with or without --skill, or --action, --digest, --channel or --device",
            file=sys.stderr,
        )
        return Exit.USAGE
    registry = Registry(arguments.state)
    block = OperatorBlock(arguments.id, arguments.reason, **parts)
    registry.add_block(block)
    print_line(f"{block.id} is in force")
    absent = None
    with suppress(UserError):  # the block is in force all the same
        absent = _absent_target(block, registry)
    if absent is not None:
        print_line(f"{absent}; the block holds for runs that load it from a folder, and after an install")
    return Exit.SUCCESS


def _absent_target(block: OperatorBlock, registry: Registry) -> str | None:
    """Say in words that nothing installed now has the name, version, files or skill that a block names."""
    snapshot = registry.snapshot()
    installed = snapshot.modules
    named = {name: one for name, one in installed.items() if block.module in (None, name)}
    if block.module is not None and not named:
        near = did_you_mean(block.module, installed)
        return f"no module `{block.module}` is installed now" + (f" (there is `{near}`)" if near else "")
    identities = {name: one for name, one in registry.identities(snapshot).items() if name in named}
    if not any(block.applies_to(name, one) for name, one in identities.items()) and (
        block.module is not None or block.digest is not None
    ):
        found = ", ".join(f"{name} {one.version} sha256:{one.digest}" for name, one in identities.items())
        return f"no such version or digest is installed now (there is {found or 'nothing'})"
    if block.module is not None and block.skill is not None:
        skills = registry.skills(block.module)
        if block.skill not in skills:
            near = did_you_mean(block.skill, skills)
            known = f"`{near}`" if near else ", ".join(f"`{one}`" for one in skills)
            return f"the installed `{block.module}` has no skill `{block.skill}` now (there is {known})"
    return None


def _unblock(arguments: argparse.Namespace) -> Exit:
    Registry(arguments.state).remove_block(arguments.id)
    print_line(f"block {arguments.id} removed")
    return Exit.SUCCESS


def _policy(arguments: argparse.Namespace) -> Exit:
    registry = Registry(arguments.state)
    if arguments.site is not None:
        _require_robot_by_name(arguments.site)
        registry.set_policy(arguments.site)
        _warn_of_absent_names(arguments.site, registry)
    configuration, _ = registry.configuration()
    site = configuration.site
    print_line(f"{site.id} is in force; sha256:{site.digest}")
    for module, access in sorted(site.grants.items()):
        print_line(f"  {module} may also use {access}")
    for block in site.blocks:
        print_line(f"  blocked: {block.id}: {block.reason} ({block.scope})")
    print_waiting(registry.waiting().values())
    return Exit.SUCCESS


def _require_robot_by_name(path: Path) -> None:
    """Refuse a site whose robot is a path relative to it, as the registry stores the site elsewhere.

    Raises:
        UserError: It is.
    """
    site = load_site(path, Diagnostics())
    robot = "" if site is None or site.robot is None else site.robot
    if robot.endswith((".yaml", ".yml")) and not Path(robot).is_absolute():
        headline = f"the robot `{robot}` is a path relative to `{path}`, which is stored elsewhere"
        raise UserError([Diagnostic("AE961", headline, help=("write its absolute path",))])


def _warn_of_absent_names(path: Path, registry: Registry) -> None:
    """Print a warning for each module or skill that the site file names and that is not installed.

    A policy is put in force before the first module is installed, so then there is none.
    """
    installed = registry.snapshot().modules
    site = load_site(path, Diagnostics()) if installed else None
    if site is None:
        return
    summary = summarize_site(site)
    skills = {name: registry.skills(name) for name in installed}
    claims = policy_name_obligations(skills, summary)
    absent = [one.diagnostic for one in claims if one.diagnostic is not None]
    absent += [
        absent_settings(name, span, installed)
        for name, span in summary.settings.items()
        if name not in installed
    ]
    if absent:
        print_diagnostics(absent)


def _repair(arguments: argparse.Namespace) -> Exit:
    snapshot = Registry(arguments.state).repair()
    if snapshot is None:
        print("nothing to repair: the registry agrees with its record of changes")
    else:
        print(f"the last recorded change is in force again, as change {snapshot.generation}")
    return Exit.SUCCESS


def _checked(parse: Callable[[str], str]) -> Callable[[str], str]:
    """Make an argument type of a parser that raises ValueError."""

    def parsed(text: str) -> str:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(escape_invisible(str(error))) from error

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
