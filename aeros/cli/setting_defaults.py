"""Defaults of arguments that the settings of a project give."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from aeros.cli.project_settings import ProjectSettings, find_settings
from aeros.exit_codes import UsageError

_AS_FOR_RUN: Final = frozenset(("site", "ecms", "state"))
_RUNS: Final = _AS_FOR_RUN | {"plant"}

_SETTINGS_OF: Final = {
    **dict.fromkeys(("run", "mcp", "serve"), _RUNS),
    **dict.fromkeys(("tasks", "plan", "look", "predict", "graph"), _AS_FOR_RUN),
    **dict.fromkeys(("new", "decide", "diff", "export"), frozenset(("site",))),
    "verify": frozenset(("site", "ecms")),
}
"""Settings that commands take; others take `state` alone, as they may be about another project's run."""

_MUST_WORK: Final = frozenset(("stop", "pause", "resume", "release", "block", "deactivate", "repair"))
"""Commands that no broken file may keep from working."""

_GOING_ON: Final = frozenset(("--resume", "--serve-plant"))
"""Options of a run that goes on with the options that it began with."""


def settings_for(name: str, given: Sequence[str], command: argparse.ArgumentParser) -> ProjectSettings:
    """Read the settings of the project, as far as a command takes them.

    Args:
        name: of the command.
        given: words of the command line.
        command: its parser.

    Returns:
        The settings.

    Raises:
        UsageError: the file cannot be used; only a warning for commands that stop a robot.
    """
    goes_on = not _GOING_ON.isdisjoint(given)
    wanted = frozenset(("state",)) if goes_on else _SETTINGS_OF.get(name, frozenset(("state",)))
    alias = {"ecms": "paths"} if name == "verify" else {}
    names = [one for one in sorted(wanted) if _has(command, alias.get(one, one))]
    if not names:
        return ProjectSettings()
    try:
        return find_settings(Path.cwd(), names)
    except UsageError as error:
        if name not in _MUST_WORK:
            raise
        print(f"aeros: warning: {error}; the settings are left out", file=sys.stderr)
        return ProjectSettings()


def set_defaults(command: argparse.ArgumentParser, settings: ProjectSettings) -> None:
    """Make settings the defaults of options; an option that is given takes their place.

    Args:
        command: the parser.
        settings: settings of the project.
    """
    own = {action.dest for action in command._actions if action.option_strings}  # argparse lists them nowhere
    defaults = {key: one for key, one in settings.options.items() if key in own and key != "ecms"}
    if any(action.dest == "paths" for action in command._actions) and "ecms" in settings.options:
        defaults["paths"] = settings.options["ecms"]  # of `aeros verify`
    command.set_defaults(**defaults)
    for inner in inner_parsers(command):
        set_defaults(inner, settings)


def add_repeated(parsed: argparse.Namespace, settings: ProjectSettings) -> None:
    """Set what argparse would add to, and note what the settings gave.

    Args:
        parsed: the arguments; gets `from_settings`, the names of those that the settings gave.
        settings: settings of the project.
    """
    if "ecms" in settings.options and getattr(parsed, "ecms", ()) is None:
        parsed.ecms = settings.options["ecms"]
    parsed.from_settings = frozenset(
        key for key, value in settings.options.items() if getattr(parsed, key, None) is value
    )


def inner_parsers(command: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Find the parsers of a command's own commands, such as `audit show`.

    Args:
        command: the parser of the command.

    Yields:
        Their parsers.
    """
    for action in command._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield from action.choices.values()


def _has(command: argparse.ArgumentParser, dest: str) -> bool:
    own = any(action.dest == dest for action in command._actions)
    return own or any(_has(inner, dest) for inner in inner_parsers(command))
