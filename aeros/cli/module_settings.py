"""Settings of a module on the command line: `NAME=VALUE` to read, and a table of all of them to print."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Final

from aeros.cli.terminal.rendering import print_table
from aeros.cli.terminal.streams import print_line
from aeros.exit_codes import UsageError
from aeros.spec.elaborate.module.settings import Setting, configure_command
from aeros.spec.model.configured import (
    ModuleConfiguration,
    join_settings,
    setting_fault,
    settings_by_module,
)

if TYPE_CHECKING:
    from aeros.runtime.registry.waiting_modules import WaitingModule

_SITE_FILE: Final = "set by the site file"


def add_settings(parser: argparse.ArgumentParser, need: str, parameter: str) -> None:
    """Add the options that bind what modules need and set their parameters.

    Args:
        parser: parser of a command.
        need: form of the name of a need, for `--help`.
        parameter: form of the name of a parameter.
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
        "--set",
        action="append",
        default=[],
        type=_set_text,
        metavar=f"{parameter}=VALUE",
        help="value of a module's parameter, with its unit; may be repeated",
    )


def add_module_settings(parser: argparse.ArgumentParser) -> None:
    """Add `--bind MODULE.NEED=NAME` and `--set MODULE.NAME=VALUE`, for modules of a folder.

    Args:
        parser: parser of a command.
    """
    add_settings(parser, "MODULE.NEED", "MODULE.NAME")


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
    return join_settings(_by_module("--bind", arguments.bind), _by_module("--set", arguments.set))


def _by_module(option: str, texts: Iterable[str]) -> Mapping[str, Mapping[str, str]]:
    try:
        return settings_by_module(dict(map(_split, texts)))
    except ValueError as error:
        raise UsageError(f"{option} {error}") from error


def _bind_text(text: str) -> str:
    return _checked(text, is_binding=True)


def _set_text(text: str) -> str:
    return _checked(text, is_binding=False)


def _checked(text: str, *, is_binding: bool) -> str:
    """Check the form of a setting, and return it without blanks around its parts.

    Raises:
        ArgumentTypeError: it has another form.
    """
    name, value = _split(text)
    fault = setting_fault(name, value, is_binding=is_binding)
    if fault is not None:
        raise argparse.ArgumentTypeError(fault)
    return f"{name}={value}"


def _split(text: str) -> tuple[str, str]:
    name, _, value = text.partition("=")
    return name.strip(), value.strip()


def print_settings(settings: Iterable[Setting]) -> None:
    """Print each need and parameter with its value and where that is from.

    Args:
        settings: the settings of a module.
    """
    print_table([(one.name, f"= {one.value or '?'}", _reason(one)) for one in settings], indent=2)


def print_open_settings(module: str, settings: Iterable[Setting]) -> None:
    """Print what an operator has to set before a module can be activated.

    Args:
        module: id of the module.
        settings: its settings.
    """
    listed = tuple(settings)
    command = configure_command(module, listed)
    if command:
        print_settings(listed)
        print_line(f"to configure it, for example: {command}")


def print_waiting(waiting: Iterable[WaitingModule]) -> None:
    """Print the modules that wait to be configured, with the command for each.

    Args:
        waiting: the modules.
    """
    for one in waiting:
        print_line(f"{one.name} {one.version} is installed and waits to be configured; {one.reason}")
        print_settings(setting for setting in one.settings if setting.is_open)
        print_line(f"to configure it, for example: {one.command}")


def _reason(one: Setting) -> str:
    """Describe where a value is from, which others there are, and in parentheses its meaning."""
    meaning = f" ({one.description})" if one.description else ""
    if one.is_parameter:
        source = _SITE_FILE if one.source == "site file" else one.source
        return f"{'open' if one.is_open else source}; {one.allowed}{meaning}"
    others = [name for name in one.choices if name != one.value] if one.value else []
    also = f"; also possible: {', '.join(others)}" if others else ""
    if one.is_open and one.value:
        suiting = f"these suit: {', '.join(one.choices)}" if one.choices else "nothing here suits"
        return f"open: does not suit here; {suiting}{meaning}"
    if one.is_open:
        return f"open: {', '.join(one.choices)}{meaning}" if one.choices else f"open{meaning}"
    reason = {
        "set": f"set{also}",
        "site file": f"{_SITE_FILE}{also}",
        "only choice": "the only one here that suits",
    }
    return f"{reason.get(one.source, f'of the same name{also}')}{meaning}"
