"""Help of the command line: of all commands, of a group, and of one command, short or whole.

The standard library draws it, as `aeros --help` would take 20 ms more to start with rich.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable, Sequence
from textwrap import shorten, wrap
from typing import Any, Final

from aeros.cli.commands import COMMANDS, GROUPS, OFTEN_USED
from aeros.cli.terminal.streams import screen_width
from aeros.exit_codes import EXIT_CODES

MOST_LINES: Final = 39
"""Greatest number of lines of any help but `aeros help COMMAND`, so that it fits on a screen."""

_EXAMPLES: Final = 5
"""Greatest number of examples in a short help."""

_NAME_COLUMN: Final = 12

_REMARK_COLUMN: Final = 6
"""Column of remarks that do not fit beside their example."""

_QUOTED: Final = re.compile(r'"[^"]*"')
"""Quoted argument of an example; a short one stays on one line, so that it can be copied."""

_KEPT_BLANK: Final = "\0"


class WrappedEpilog(argparse.RawDescriptionHelpFormatter):
    """Fills paragraphs of description and epilog; keeps indented lines, as of examples, broken where wide."""

    def _format_usage(self, *parts: Any) -> str:
        """Break what argparse leaves wider than the terminal, such as a long choice of options."""
        width = self._width
        whole = super()._format_usage(*parts).rstrip("\n")
        return "\n".join(_broken_usage(line, width) for line in whole.split("\n")) + "\n\n"

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n".join(
            one for line in _paragraphs(text.splitlines()) for one in _broken(indent + line, width)
        )


def _paragraphs(lines: Iterable[str]) -> list[str]:
    """Join the lines of each paragraph."""
    joined: list[str] = []
    for line in lines:
        is_further = line[:1].strip() and joined and joined[-1][:1].strip() and not joined[-1].endswith(":")
        if is_further and not line.startswith("exit codes:"):
            joined[-1] += f" {line}"
        else:
            joined.append(line)
    return joined


def _broken_usage(line: str, width: int) -> str:
    """Break a line of usage at blanks, or after a comma of a choice; further lines start below it."""
    indent = " " * min(len(line) - len(line.lstrip()), width // 2)
    lines = [""]
    for part in re.findall(r"[^\s,]+,?\s*|,", line.lstrip()):
        if len(indent + lines[-1] + part.rstrip()) > width:
            lines.append("")
        lines[-1] += part
    return "\n".join(indent + one.rstrip() for one in lines)


def _broken(line: str, width: int) -> list[str]:
    """Break a line at its column of remarks, or else at spaces; further lines are indented further."""
    if len(line) <= width:
        return [line]
    text = line.lstrip()
    # A remark that stands alone in the column of remarks goes where those are that are broken off.
    indent = " " * min(len(line) - len(text), _REMARK_COLUMN)
    line = indent + text
    further = indent + "    " if indent else ""
    command, *remark = re.split(r"(?<=\S) {2,}(?=\S)", line, maxsplit=1)
    if remark:
        return [part for half in (command, further + remark[0]) for part in _broken(half, width)]
    whole = _QUOTED.sub(
        lambda quoted: quoted[0].replace(" ", _KEPT_BLANK) if len(quoted[0]) < width // 3 else quoted[0], line
    )
    lines = wrap(whole, width, subsequent_indent=further, break_long_words=False, break_on_hyphens=False)
    return [one.replace(_KEPT_BLANK, " ") for one in lines]


def all_commands() -> str:
    """Make the help of `aeros` itself.

    Returns:
        The help: common commands explained, and all others named by group.
    """
    width = screen_width()
    lines = [
        "usage: aeros COMMAND ...",
        "",
        *wrap("Capability packages proved safe before installation, actions decided before motion.", width),
        "",
        "often used:",
        *(_entry(name, COMMANDS[name].summary, width) for name in OFTEN_USED),
        "",
        "all commands:",
    ]
    for title, group in GROUPS.items():
        names = wrap(", ".join(group.commands), width - _NAME_COLUMN - 2, break_on_hyphens=False)
        lines += [
            f"  {title if not at else '':{_NAME_COLUMN}}{part}".rstrip() for at, part in enumerate(names)
        ]
    lines += [
        "",
        "options:",
        _entry("-h, --help", "show this help message and exit", width, 16),
        _entry("-V, --version", "show the version and exit", width, 16),
        "",
        "examples:",
        "  aeros demo",
        "  aeros verify ecms/make_dumplings",
        '  aeros run "make dumplings" --plant symbolic',
        "",
        *wrap(
            "`aeros help GROUP` says what each command of a group does, `aeros COMMAND --help` how it is "
            "used, and `aeros help COMMAND` explains each option of it.",
            width,
        ),
        *wrap(EXIT_CODES, width),
    ]
    return "\n".join(lines) + "\n"


def group_help(name: str) -> str:
    """Make the help of a group.

    Args:
        name: of the group, one of `GROUPS`.

    Returns:
        The help: a summary of each of its commands.
    """
    group, width = GROUPS[name], screen_width()
    lines = [*wrap(f"{name}: {group.summary}", width), ""]
    lines += [_entry(command, entry.summary, width) for command, entry in group.commands.items()]
    lines += ["", "`aeros COMMAND --help` shows how a command is used."]
    return "\n".join(lines) + "\n"


def short_usage(parser: argparse.ArgumentParser) -> str:
    """Make a short usage, one line where the terminal is wide enough.

    Args:
        parser: of the command.

    Returns:
        The command, `[options]` and its arguments.
    """
    words = ["usage:", parser.prog, "[options]"]
    for action in _arguments(parser):
        name = _name(action)
        repeated = {"?": f"[{name}]", "*": f"[{name} ...]", "+": f"{name} [{name} ...]"}
        words.append(repeated.get(str(action.nargs), name))
    return "\n".join(_broken(" ".join(words), screen_width()))


def short_help(parser: argparse.ArgumentParser, whole: str) -> str:
    """Shorten the help of a command to a screen: options in a line each, the last ones only named.

    Args:
        parser: of the command.
        whole: its whole help.

    Returns:
        The help, at most `MOST_LINES` lines; `whole` where that is no longer.
    """
    if whole.count("\n") <= MOST_LINES:
        return whole
    width = screen_width()
    head = [short_usage(parser), "", *wrap(parser.description or "", width), ""]
    if arguments := [_entry(_name(one), _first_clause(one), width) for one in _arguments(parser)]:
        head += ["arguments:", *arguments, ""]
    foot = _first_examples(parser.epilog or "", width)
    foot += ["", *wrap(EXIT_CODES, width), f"`aeros help {_command_of(parser)}` explains each option."]
    options = _options(parser)
    room = MOST_LINES - len(head) - len(foot)
    for shown in range(len(options), 0, -1):
        body = ["options:", *_option_lines(options[:shown], width), ""]
        if names := ["/".join(one.option_strings) for one in options[shown:]]:
            body += [*_named("more options", names, width), ""]
        if len(body) <= room:
            break
    return "\n".join(head + body + foot) + "\n"


def option_names(parser: argparse.ArgumentParser) -> list[str]:
    """List the options of a command.

    Args:
        parser: of the command.

    Returns:
        All their names.
    """
    return [name for option in _options(parser) for name in option.option_strings]


def _options(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    # argparse lists them nowhere else.
    return [one for one in parser._actions if one.option_strings and one.help != argparse.SUPPRESS]


def _arguments(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [one for one in parser._actions if not one.option_strings]


def _command_of(parser: argparse.ArgumentParser) -> str:
    return parser.prog.removeprefix("aeros ")


def _name(action: argparse.Action) -> str:
    """Return the name that help gives to the value of an argument."""
    if isinstance(action.metavar, tuple):
        return action.metavar[0]
    if action.metavar is not None:
        return action.metavar
    if action.choices:
        return "{" + ",".join(map(str, action.choices)) + "}"
    return action.dest.upper() if action.option_strings else action.dest


def _option_lines(options: Sequence[argparse.Action], width: int) -> Iterable[str]:
    for option in options:
        name = ", ".join(option.option_strings)
        if option.nargs != 0:
            name += f" {_name(option)}"
        yield _entry(name, _first_clause(option), width, 26)


def _first_clause(action: argparse.Action) -> str:
    """Return what is written of an argument, up to its first semicolon and without what is in brackets."""
    text = (action.help or "").replace("%%", "%")
    return re.sub(r"\s*\([^()]*\)", "", text).partition(";")[0]


def _entry(name: str, summary: str, width: int, column: int = _NAME_COLUMN) -> str:
    head = f"  {name:{column - 1}} "
    head += "" if head.endswith("  ") else " "
    return f"{head}{shorten(summary, max(10, width - len(head)), placeholder=' ...')}"


def _named(title: str, names: Sequence[str], width: int) -> list[str]:
    text = f"{title}: {', '.join(names)}"
    return wrap(text, width, subsequent_indent="  ", break_on_hyphens=False, break_long_words=False)


def _first_examples(epilog: str, width: int) -> list[str]:
    """Return the first examples of a command, each with what is below it and indented further."""
    *_, examples = epilog.partition("examples:\n")
    kept: list[str] = []
    count = 0
    for line in examples.splitlines():
        if not line.startswith("  "):
            break
        count += line.startswith("  aeros ")
        if count > _EXAMPLES:
            break
        kept += _broken(line, width)
    return ["examples:", *kept] if kept else []
