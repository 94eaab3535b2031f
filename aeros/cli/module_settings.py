"""Settings of a module on the command line: `NAME=VALUE` to read, and a table of all of them to print."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from aeros.cli.terminal import print_line
from aeros.exit_codes import UsageError
from aeros.spec.model.configured import ModuleConfiguration

if TYPE_CHECKING:
    from aeros.spec.elaborate.module.needs import Setting

_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")
_DOTTED: Final = re.compile(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?")
_MAX_VALUE: Final = 200  # characters; no quantity needs more


def add_settings(
    parser: argparse.ArgumentParser, need: str, parameter: str, *, option: str = "--set"
) -> None:
    """Add the options that bind what modules need and set their parameters.

    Args:
        parser: parser of a command.
        need: form of the name of a need, for `--help`.
        parameter: form of the name of a parameter.
        option: name of the option that sets parameters.
    """
    parser.add_argument(
        "--bind",
        action="append",
        default=[],
        type=_bind_text,
        metavar=f"{need}=NAME",
        help="the site's name for what a module needs; may be repeated",
    )
    parser.add_argument(
        option,
        dest="set",
        action="append",
        default=[],
        type=_set_text,
        metavar=f"{parameter}=VALUE",
        help="value of a module's parameter, with its unit; may be repeated",
    )


def add_module_settings(parser: argparse.ArgumentParser, *, option: str = "--set") -> None:
    """Add `--bind MODULE.NEED=NAME` and `--set MODULE.NAME=VALUE`, for modules of a folder.

    Args:
        parser: parser of a command.
        option: name of the option that sets parameters.
    """
    add_settings(parser, "MODULE.NEED", "MODULE.NAME", option=option)


def module_configuration(bindings: Iterable[str], parameters: Iterable[str]) -> ModuleConfiguration:
    """Read the settings of one module.

    Args:
        bindings: each `NEED=NAME`.
        parameters: each `NAME=VALUE`.

    Returns:
        The settings.
    """
    return ModuleConfiguration(dict(map(_split, bindings)), dict(map(_split, parameters)))


def module_configurations(arguments: argparse.Namespace) -> dict[str, ModuleConfiguration]:
    """Read the settings of modules that `add_module_settings` added.

    Args:
        arguments: parsed arguments.

    Returns:
        Settings by module.

    Raises:
        UsageError: a name does not begin with a module.
    """
    given: dict[str, tuple[list[str], list[str]]] = {}
    for place, option, texts in ((0, "--bind", arguments.bind), (1, "--set", arguments.set)):
        for text in texts:
            module, dot, rest = text.partition(".")
            if not dot or "=" in module:
                raise UsageError(f"{option} {text}: begin with the module, as in `clean_pot.{text}`")
            given.setdefault(module, ([], []))[place].append(rest)
    return {module: module_configuration(*parts) for module, parts in given.items()}


def _bind_text(text: str) -> str:
    return _checked(text, "surface=bench", _NAME)


def _set_text(text: str) -> str:
    return _checked(text, "force=6 N", None)


def _checked(text: str, example: str, form: re.Pattern[str] | None) -> str:
    """Check the form of a setting, and return it without blanks around its parts.

    Raises:
        ArgumentTypeError: it has another form.
    """
    name, value = _split(text)
    if "=" not in text or not _DOTTED.fullmatch(name) or not value or (form and not form.fullmatch(value)):
        raise argparse.ArgumentTypeError(f"`{text}` is not a setting, as in `{example}`")
    if len(value) > _MAX_VALUE or not value.isprintable():
        raise argparse.ArgumentTypeError(
            f"the value of `{name}` is not one line of at most {_MAX_VALUE} characters"
        )
    return f"{name}={value}"


def _split(text: str) -> tuple[str, str]:
    name, _, value = text.partition("=")
    return name.strip(), value.strip()


def print_settings(settings: Iterable[Setting]) -> None:
    """Print each need and parameter with its value and where that is from.

    Args:
        settings: the settings of a module.
    """
    listed = tuple(settings)
    name_width = max((len(one.name) for one in listed), default=0)
    value_width = max((len(one.value) for one in listed), default=0)
    for one in listed:
        print_line(f"  {one.name:<{name_width}} = {one.value or '?':<{value_width}}  {_reason(one)}".rstrip())


def print_open_settings(module: str, settings: Iterable[Setting]) -> None:
    """Print what an operator has to set before a module can be activated.

    Args:
        module: id of the module.
        settings: its settings.
    """
    listed = tuple(settings)
    options = [
        f"--set {one.name}=…" if one.is_parameter else f"--bind {one.name}={one.choices[0]}"
        for one in listed
        if one.is_open and (one.is_parameter or one.choices)
    ]
    if options:
        print_settings(listed)
        print_line(f"to configure it, for example: aeros configure {module} {' '.join(options)}")


def _reason(one: Setting) -> str:
    """Describe where a value is from, and which others there are."""
    others = [name for name in one.choices if name != one.value] if one.value else []
    also = f"; also possible: {', '.join(others)}" if others else ""
    if one.is_open:
        return f"open; {one.description}" if one.is_parameter else f"open: {', '.join(one.choices)}"
    match one.source:
        case "set":
            return f"set; {one.description}" if one.is_parameter else f"set{also}"
        case "default":
            return f"default; {one.description}"
        case "only choice":
            return "the only one here that suits"
        case _:
            return f"of the same name{also}"
