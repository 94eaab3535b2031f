"""Commands about modules on this robot: bundle, install, configure, activate, deactivate, remove, list."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.agent.agent import MEMORY_FILE
from aeros.agent.errors import AgentError
from aeros.agent.memory.queries import open_memory_reader
from aeros.cli.arguments import add_command, existing_path, writable_path
from aeros.cli.module_settings import (
    add_settings,
    module_configuration,
    print_open_settings,
    print_settings,
    print_waiting,
)
from aeros.cli.robot.module_source import BUNDLE, module_source
from aeros.cli.terminal.rendering import print_table
from aeros.cli.terminal.streams import print_data, print_line
from aeros.exit_codes import Exit, UsageError
from aeros.files import replace_durably
from aeros.runtime.registry.archive import pack
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.grammar import counted
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.text.discovery import MANIFEST

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_LIFECYCLE_HELP: Final = """\
A module is installed, then configured, then activated; `deactivate` withdraws its skills and `activate`
brings them back; `remove` uninstalls a module that is not active.  Each change is proved for all modules
that are then installed.  If the proof fails the change is rejected with the reason and has no effect.
"""
_DESCRIPTIONS: Final = {
    "bundle": "Pack a module's files into one file, to install it elsewhere by its digest.",
    "install": "Install a module on this robot.  It keeps the state of a version that it replaces.  "
    "A version below the installed one needs --allow-downgrade.",
    "configure": "Bind what an installed module needs to things of this site, set its parameters, and prove "
    "it as bound.",
    "activate": "Activate a module, so that its skills can run.",
    "deactivate": "Deactivate a module; when the command returns, none of its skills acts, in any run on "
    "this robot, wherever the run has the module from.",
    "remove": "Uninstall a module that is not active.  No run uses it until it is activated again.",
    "list": "List installed modules with their states and capabilities.",
}
_EXAMPLES: Final = {
    "bundle": """\
  aeros bundle ecms/make_dumplings                  writes make_dumplings.ecm.zip and prints its digest
  aeros install make_dumplings.ecm.zip --digest sha256:1234…
                                                    elsewhere
""",
    "install": """\
  aeros install ecms/make_dumplings                 the module in a folder
  aeros install ecms/make_dumplings --digest sha256:1234…
                                                    only if its files have this digest
  aeros install make_dumplings.ecm.zip              a bundle
  aeros install make_dumplings                      from an installed Python distribution with an entry
                                                    point of that name in the group `aeros.ecms`
""",
    "configure": """\
  aeros configure make_dumplings                    bind what has one choice, and show all
  aeros configure clean_pot --bind surface=bench --set force="6 N"
  aeros configure clean_pot --reset                 forget earlier settings
""",
    "activate": """\
  aeros activate make_dumplings                     one that is installed and configured
  aeros activate --install ecms/make_dumplings      installs, configures and activates it
  aeros activate --install clean_pot.ecm.zip --bind surface=bench
""",
    "deactivate": "  aeros deactivate make_dumplings     also while one of its skills runs\n",
    "remove": "  aeros remove make_dumplings\n",
    "list": """\
  aeros list
  aeros list --capability grasping                  modules that can grasp
  aeros list --format json
""",
}


def add_to(commands: Subparsers, name: str) -> None:
    """Add one of this module's commands and its arguments.

    Args:
        commands: Subparsers of `aeros`.
        name: The command's name.
    """
    examples = f"{_LIFECYCLE_HELP}\nexamples:\n{_EXAMPLES[name]}"
    parser = add_command(commands, name, _DESCRIPTIONS[name], examples)
    if name == "install":
        parser.add_argument("module", help="a folder, a bundle, or the name of an entry point")
        _add_install_options(parser)
    elif name == "bundle":
        parser.add_argument("module", type=existing_path, help="the module's folder")
        parser.add_argument(
            "--out", type=writable_path, metavar="FILE", help="default: its name with .ecm.zip, here"
        )
        parser.set_defaults(command=_bundle)
        return
    elif name == "list":
        parser.add_argument("--capability", help="only modules that provide this capability")
        parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    elif name == "activate":
        parser.add_argument("module", nargs="?", help="the module's name")
        parser.add_argument(
            "--install",
            metavar="SOURCE",
            help="install and configure it first: a folder, bundle or entry point",
        )
        _add_install_options(parser)
        add_settings(parser, "NEED", "NAME")
    else:
        parser.add_argument("module", help="the module's name")
        if name == "configure":
            _add_settings(parser)
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the robot's own folder (default: .aeros)"
    )
    parser.set_defaults(command=_COMMANDS[name])


def _add_install_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--digest", metavar="sha256:HEX", help="expected digest of the module's files")
    parser.add_argument(
        "--allow-downgrade", action="store_true", help="install a version below the installed one"
    )


def _bundle(arguments: argparse.Namespace) -> Exit:
    folder: Path = arguments.module.resolve()
    out: Path = arguments.out or Path(f"{folder.name}{BUNDLE}")
    files = module_files(folder)
    if MANIFEST not in files:
        raise UserError(
            [Diagnostic("AE961", f"`{arguments.module}` holds no module: it has no `{MANIFEST}`")]
        )
    try:
        replace_durably(out, pack(files), is_private=False)
    except OSError as failure:
        raise UserError([Diagnostic("AE961", f"`{out}` cannot be written: {failure.strerror}")]) from failure
    print_line(f"{out}: {counted(len(files), 'file')}, sha256:{bundle_digest(files)}")
    return Exit.SUCCESS


def _install(arguments: argparse.Namespace) -> Exit:
    with module_source(arguments.module) as source:
        registry = Registry(arguments.state)
        one = registry.install(source, arguments.digest, allows_downgrade=arguments.allow_downgrade)
    print_line(f"{one.name} {one.version} is {one.state.value}; sha256:{one.digest}")
    print_open_settings(one.name, registry.settings(one.name))
    _print_blocks(registry, one)
    return Exit.SUCCESS


def _add_settings(parser: argparse.ArgumentParser) -> None:
    add_settings(parser, "NEED", "NAME")
    parser.add_argument(
        "--reset",
        action="store_true",
        help="forget what was bound and set before; alone, a module with an open need waits to be configured",
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")


def _configure(arguments: argparse.Namespace) -> Exit:
    registry = Registry(arguments.state)
    given = module_configuration(arguments.bind, arguments.set)
    one = registry.configure(arguments.module, given, resets=arguments.reset)
    settings = registry.settings(one.name)
    if arguments.format == "json":
        shown = {one.name: one.value for one in settings}
        print_data(
            json.dumps(
                {"name": one.name, "version": one.version, "state": one.state.value, "settings": shown}
            )
        )
        return Exit.SUCCESS
    if one.state is ModuleState.CONFIGURED:
        print_line(f"{one.name} {one.version} is {one.state.value}")
        print_settings(settings)
    else:
        print_waiting([registry.waiting()[one.name]])
    _print_blocks(registry, one)
    return Exit.SUCCESS


def _activate(arguments: argparse.Namespace) -> Exit:
    given = module_configuration(arguments.bind, arguments.set)
    if (arguments.module is None) == (arguments.install is None):
        raise UsageError("name an installed module, or give `--install SOURCE`")
    if arguments.install is None:
        if given != ModuleConfiguration() or arguments.digest is not None or arguments.allow_downgrade:
            options = "--bind, --set, --digest and --allow-downgrade"
            raise UsageError(f"{options} are for a module that `--install` installs")
        return _lifecycle_command("activate")(arguments)
    registry = Registry(arguments.state)
    with module_source(arguments.install) as source:
        downgrade = arguments.allow_downgrade
        one = registry.install(source, arguments.digest, allows_downgrade=downgrade, active=given)
    print_line(f"{one.name} {one.version} is {one.state.value}; sha256:{one.digest}")
    print_settings(registry.settings(one.name))
    _print_blocks(registry, one)
    return Exit.SUCCESS


def _lifecycle_command(verb: str) -> Callable[[argparse.Namespace], Exit]:
    def command(arguments: argparse.Namespace) -> Exit:
        registry = Registry(arguments.state)
        one: InstalledModule = getattr(registry, verb)(arguments.module)
        print_line(f"{one.name} {one.version} is {one.state.value}")
        if one.state is not ModuleState.ABSENT:
            _print_blocks(registry, one)
        return Exit.SUCCESS

    return command


def _print_blocks(registry: Registry, module: InstalledModule) -> None:
    """Print the blocks that name the module, so that nobody believes that it can act."""
    snapshot = registry.snapshot()
    identity = registry.identities(snapshot)[module.name]
    for block in snapshot.blocks.values():
        names_it = (block.module, block.digest, block.device) != (None, None, None)
        if names_it and block.applies_to(module.name, identity):
            print(_block_line(block))


def _block_line(block: OperatorBlock) -> str:
    return escape_invisible(f"blocked: {block.id}: {block.reason} ({block.scope})")


def _list(arguments: argparse.Namespace) -> Exit:
    registry = Registry(arguments.state)
    snapshot = registry.snapshot()
    capable = registry.capabilities(snapshot)
    shown = {
        name: one
        for name, one in snapshot.modules.items()
        if arguments.capability is None or arguments.capability in capable[name]
    }
    broken = _broken_assumptions(arguments.state)
    as_text = arguments.format == "text"
    if as_text:
        _print_text(shown, snapshot, capable, broken)
    else:
        print_data(_json(shown, snapshot, capable, broken))
    return Exit.SUCCESS if shown or arguments.capability is None else Exit.REJECTED


_Broken = dict[tuple[str, str], list[dict[str, Any]]]
"""Measured events that certificates exclude, by module and version."""


def _broken_assumptions(state: Path) -> _Broken:
    """Read the broken assumptions from the agent's memory."""
    found: _Broken = {}
    if not (state / MEMORY_FILE).exists():
        return found
    try:
        with open_memory_reader(state / MEMORY_FILE) as memory:
            for one in memory.broken_assumptions():
                found.setdefault((one["module"], one["version"]), []).append(one)
    except AgentError as refusal:
        print(f"aeros: warning: broken assumptions are unknown: {refusal}", file=sys.stderr)
    return found


def _broken_lines(broken: list[dict[str, Any]]) -> list[str]:
    """Format the latest broken assumption of each skill."""
    lines = []
    for skill in dict.fromkeys(one["skill"] for one in broken):
        every = [one for one in broken if one["skill"] == skill]
        last = every[-1]
        declared = ", ".join(f"`{name}`" for name in last["declared"])
        rests = f"{len(last['obligations'])} obligations of certificate {(last['certificate'] or '')[:12]}"
        when = f"last in session {last['session']} at {last['time']:.2f} s"
        lines.append(
            f"broken assumption: {skill} ended in none of {declared}, {counted(len(every), 'time')}, {when}; "
            f"affects {rests}"
        )
    return lines


def _print_text(
    shown: dict[str, InstalledModule],
    snapshot: RegistrySnapshot,
    capable: dict[str, tuple[str, ...]],
    broken: _Broken,
) -> None:
    if not shown:
        print("no installed module provides it" if snapshot.modules else "no modules installed")
    rows = [
        (f"{name} {one.version}", one.state.value, ", ".join(capable[name])) for name, one in shown.items()
    ]
    print_table(rows, least=(0, max(len(state.value) for state in ModuleState)))
    for one in shown.values():
        for line in _broken_lines(broken.get((one.name, one.version), [])):
            print(line)
    for line in _operator_lines(snapshot):
        print(line)


def _operator_lines(snapshot: RegistrySnapshot) -> list[str]:
    """Describe what the operator has withdrawn and blocked."""
    removed = [
        f"removed: {name}: no run uses it until it is installed and activated again"
        for name in sorted(snapshot.withdrawn - snapshot.modules.keys())
    ]
    return [*removed, *map(_block_line, snapshot.blocks.values())]


def _json(
    shown: dict[str, InstalledModule],
    snapshot: RegistrySnapshot,
    capable: dict[str, tuple[str, ...]],
    broken: _Broken,
) -> str:
    modules: list[dict[str, Any]] = [
        {
            "name": one.name,
            "version": one.version,
            "state": one.state.value,
            "digest": f"sha256:{one.digest}",
            "capabilities": list(capable[one.name]),
            "configuration": one.configuration.to_json(),
            "broken_assumptions": broken.get((one.name, one.version), []),
        }
        for one in shown.values()
    ]
    blocks = [
        {**asdict(block), "digest": None if block.digest is None else f"sha256:{block.digest}"}
        for block in snapshot.blocks.values()
    ]
    found = {
        "generation": snapshot.generation,
        "modules": modules,
        "withdrawn": sorted(snapshot.withdrawn),
        "blocks": blocks,
    }
    return json.dumps(found, indent=2)


_COMMANDS: Final = {
    "install": _install,
    "list": _list,
    "configure": _configure,
    "activate": _activate,
    **{verb: _lifecycle_command(verb) for verb in ("deactivate", "remove")},
}
