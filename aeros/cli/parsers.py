"""The parser of the command line: short help, and errors that name what was probably intended."""

from __future__ import annotations

import argparse
import importlib
import re
import sys
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Final, NoReturn

import aeros
from aeros.cli.commands import COMMANDS, GROUPS, MODULES_OF_SEVERAL
from aeros.cli.help_text import all_commands, group_help, option_names, short_help, short_usage
from aeros.cli.project_settings import ProjectSettings
from aeros.cli.setting_defaults import add_repeated, set_defaults, settings_for
from aeros.exit_codes import Exit

_SYNONYMS: Final = {"module": "ecm", "modul": "ecm", "package": "ecm", "workflow": "ci", "cell": "site"}
"""Words that people type, by the choice that they mean."""


class CommandParser(argparse.ArgumentParser):
    """Parser of one command; its help fits on a screen, and `whole_help` explains everything."""

    _given: Sequence[str] = ()

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse words, and keep them for the message of an error.

        Args:
            args: words, without those before the command's name; None for those of the program.
            namespace: where to put the values.

        Returns:
            The values, and words that no argument takes.
        """
        self._given = sys.argv[1:] if args is None else args
        return super().parse_known_args(args, namespace)

    def format_usage(self) -> str:
        """Make the short usage.

        Returns:
            The usage.
        """
        return f"{short_usage(self)}\n"

    def format_help(self) -> str:
        """Make the help that fits on a screen.

        Returns:
            The help.
        """
        return short_help(self, self.whole_help())

    def whole_help(self) -> str:
        """Make the help that explains each option.

        Returns:
            The help.
        """
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        """Print what is wrong with the command line, with the nearest known word, and end the program.

        Args:
            message: of argparse, which checks values before it looks for unknown options.
        """
        if (unknown := self._unknown_option()) is not None:
            self.refuse(unrecognized([unknown], option_names(self)))
        for action in self._actions:
            name = action.metavar or action.dest
            if action.choices and message == f"the following arguments are required: {name}":
                self.refuse(f"name one of: {', '.join(map(str, action.choices))}")
        choice = re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message)
        cure = ""
        if choice is not None:
            known = [word.strip(" '") for word in choice[2].split(",")]
            synonym = _SYNONYMS.get(choice[1], "")
            cure = _intended(synonym if synonym in known else choice[1], known)
        self.refuse(message + cure)

    def _unknown_option(self) -> str | None:
        """Find the first word given that looks like an option and is none, nor the beginning of one."""
        if any(isinstance(one, argparse._SubParsersAction) for one in self._actions):
            return None  # the command inside it knows its own options
        known = option_names(self)
        for word in self._given:
            if word in {"--", "--ros-args"}:
                break
            name = word.partition("=")[0]
            if word.startswith("--") and not any(one.startswith(name) for one in known):
                return word
        return None

    def refuse(self, message: str) -> NoReturn:
        """Print an error with the usage, and end the program.

        Args:
            message: of the error.
        """
        self.print_usage(sys.stderr)
        print(f"{self.prog}: error: {message}", file=sys.stderr)
        print(f"`{self.prog} --help` shows its options", file=sys.stderr)
        self.exit(Exit.USAGE)


class _AllCommands(CommandParser):
    """Parser of `aeros` itself."""

    def format_help(self) -> str:
        """Return the commands."""
        return all_commands()

    def format_usage(self) -> str:
        """Return one line of usage."""
        return "usage: aeros COMMAND ...\n"


def parse(given: Sequence[str]) -> argparse.Namespace:
    """Parse a command line; help, version and errors end the program.

    Args:
        given: its words, without the program's name.

    Returns:
        The arguments; `command` is to be called with them, and `from_settings` names those that the project's
        settings gave.

    Raises:
        UsageError: the file with the settings of the project cannot be used.
    """
    if given[:1] == ["help"]:
        sys.exit(_print_help(given[1:]))
    if not given:
        _print(all_commands())
        sys.exit(Exit.USAGE)
    if list(given) == ["version"]:
        given = ["--version"]
    parser, command = _parsers(given)
    first = next((word for word in given if not word.startswith("-")), None)
    if first is not None and given[0] == first and first not in COMMANDS:
        parser.refuse(f"no command `{first}`{_intended(first, (*COMMANDS, 'help'))}")
    settings = ProjectSettings()
    if command is not None and first is not None:
        settings = settings_for(first, given, command)
        set_defaults(command, settings)
    parsed, unknown = parser.parse_known_args(given)
    add_repeated(parsed, settings)
    if unknown:
        (command or parser).refuse(unrecognized(unknown, [] if command is None else option_names(command)))
    return parsed


def unrecognized(words: Sequence[str], options: Iterable[str]) -> str:
    """Word the error about words that no argument takes.

    Args:
        words: the words.
        options: names of the command's options.

    Returns:
        The message, with the option that was probably intended.
    """
    known = list(options)
    first = words[0].partition("=")[0]
    # After `--` an option is a mere word, and no other one was intended.
    cure = _intended(first, known) if first.startswith("-") and first not in known else ""
    return f"unrecognized arguments: {' '.join(words)}{cure}"


def command_parser(name: str) -> CommandParser:
    """Import the code of a command and make its parser.

    Args:
        name: of the command.

    Returns:
        Its parser.

    Raises:
        KeyError: there is no such command.
    """
    _, command = _parsers([name])
    if command is None:
        raise KeyError(name)
    return command


def all_parsers() -> argparse.ArgumentParser:
    """Import the code of all commands.

    Returns:
        The parser of `aeros`, which knows each of them.
    """
    parser, commands = _program()
    for name in COMMANDS:
        _add(commands, name)
    return parser


def _parsers(given: Sequence[str]) -> tuple[CommandParser, CommandParser | None]:
    """Return the parser of `aeros`, and that of the command in the words given."""
    parser, commands = _program()
    wanted = next((word for word in given if word in COMMANDS), None)
    return parser, None if wanted is None else _add(commands, wanted)


def _program() -> tuple[CommandParser, argparse._SubParsersAction[CommandParser]]:
    """Make the parser of `aeros`, without commands, and where they are added."""
    parser = _AllCommands(prog="aeros")
    parser.add_argument("-V", "--version", action="version", version=f"aeros {aeros.__version__}")
    return parser, parser.add_subparsers(required=True, metavar="COMMAND", parser_class=CommandParser)


def _add(commands: argparse._SubParsersAction[CommandParser], name: str) -> CommandParser:
    module = COMMANDS[name].module
    add_to = importlib.import_module(f"aeros.cli.{module}").add_to
    add_to(commands, name) if module in MODULES_OF_SEVERAL else add_to(commands)
    return commands.choices[name]


def _print_help(words: Sequence[str]) -> int:
    """Print the help of a command, of a group, or of all commands."""
    if not words:
        return _print(all_commands())
    name = words[0]
    if name in COMMANDS:
        inner = _inner_parser(command_parser(name), words[1:])
        return _print(inner.whole_help() + ("" if name not in GROUPS else f"\n{group_help(name)}"))
    if name in GROUPS:
        return _print(group_help(name))
    print(
        f"aeros: there is no command or group `{name}`{_intended(name, (*COMMANDS, *GROUPS))}\n"
        "`aeros --help` lists all",
        file=sys.stderr,
    )
    return Exit.USAGE


def _inner_parser(command: CommandParser, words: Iterable[str]) -> CommandParser:
    """Return the parser of a command's own command, such as `audit show`, where one is named."""
    for word in words:
        inner = next(
            (one.choices for one in command._actions if isinstance(one, argparse._SubParsersAction)), {}
        )
        if word not in inner:
            return command
        command = inner[word]
    return command


def _print(text: str) -> int:
    print(text, end="")
    return Exit.SUCCESS


def _intended(word: str, known: Iterable[str]) -> str:
    by_letters = {one.lstrip("-"): one for one in known}  # dashes make no two options alike
    near = get_close_matches(word.lstrip("-"), list(by_letters), 1, 0.6)
    return f"; did you mean `{by_letters[near[0]]}`?" if near else ""
