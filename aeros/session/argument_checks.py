"""Checks of the arguments of the public names: wrong use is a `MisuseError` that names the argument."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

from aeros.spec.diagnostics.codes import did_you_mean
from aeros.spec.diagnostics.errors import MisuseError
from aeros.spec.diagnostics.grammar import an


def as_path(argument: str, value: Any) -> Path:
    """Convert an argument to a path.

    Args:
        argument: name of the argument, for the message.
        value: a `str` or an `os.PathLike[str]`.

    Returns:
        The path.

    Raises:
        MisuseError: the value is neither.
    """
    if isinstance(value, str | PathLike):
        try:
            return Path(value)
        except TypeError:
            pass  # a path in bytes
    raise MisuseError(f"`{argument}` is {_described(value)}; give a path, as str or pathlib.Path")


def as_paths(argument: str, value: Any) -> list[Path]:
    """Convert an argument to one or several paths.

    Args:
        argument: name of the argument, for the message.
        value: a path as `as_path` takes it, or a list or tuple of paths.

    Returns:
        The paths; at least one.

    Raises:
        MisuseError: the value is neither, or an empty list.
    """
    if not isinstance(value, list | tuple):
        return [as_path(argument, value)]
    if not value:
        raise MisuseError(f"`{argument}` is empty; give at least one path")
    return [as_path(argument, one) for one in value]


def require_one_of(what: str, given: Any, known: tuple[str, ...]) -> None:
    """Refuse a value that is not one of a few texts.

    Args:
        what: kind of the value, for the message.
        given: the value.
        known: the values that there are.

    Raises:
        MisuseError: the value is none of them; the text names the nearest one.
    """
    if not isinstance(given, str):
        raise MisuseError(f"the {what} is {_described(given)}; there are {', '.join(known)}")
    if given not in known:
        near = did_you_mean(given, known)
        hint = f"did you mean `{near}`?" if near else f"there are {', '.join(known)}"
        raise MisuseError(f"there is no {what} `{given}`; {hint}")


def require_whole_number(argument: str, value: Any) -> None:
    """Refuse a value that is not a whole number of at least 0.

    Args:
        argument: name of the argument, for the message.
        value: the value.

    Raises:
        MisuseError: the value is something else.
    """
    if type(value) is not int or value < 0:
        shown = value if type(value) is int else _described(value)
        raise MisuseError(f"`{argument}` is {shown}; give a whole number, 0 or more")


def require_text(argument: str, value: Any) -> None:
    """Refuse a value that is not a text.

    Args:
        argument: name of the argument, for the message.
        value: the value.

    Raises:
        MisuseError: the value is something else.
    """
    if not isinstance(value, str):
        raise MisuseError(f"`{argument}` is {_described(value)}; give a str")


def require_members(argument: str, value: Any, members: tuple[str, ...], wanted: str) -> None:
    """Refuse an object that lacks members.

    Args:
        argument: name of the argument, for the message.
        value: the object; a class is refused, as its instances are meant.
        members: names of the members.
        wanted: name of the type that has them, for the message.

    Raises:
        MisuseError: the object is a class or lacks a member.
    """
    missing = [one for one in members if not hasattr(value, one)]
    if isinstance(value, type):
        raise MisuseError(f"`{argument}` is the class `{value.__name__}`; give an instance of `{wanted}`")
    if missing:
        raise MisuseError(f"`{argument}` is {_described(value)}; give {an(wanted)}, which has `{missing[0]}`")


def _described(value: Any) -> str:
    return "None" if value is None else f"an object of type `{type(value).__name__}`"
