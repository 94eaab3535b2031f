"""Short descriptions of objects and exceptions whose own methods may fail."""

from __future__ import annotations

from typing import Any


def type_name(value: Any) -> str:
    """Return the name of `value`'s type, without calling its metaclass.

    Args:
        value: any object.

    Returns:
        The class name, cut after 100 characters.
    """
    name: str = type.__dict__["__name__"].__get__(type(value))
    return str.__getitem__(name, slice(0, 100))


def describe_exception(error: BaseException, longest: int = 1000, *, one_line: bool = False) -> str:
    """Describe an exception by its type and its message, even one whose `__str__` fails.

    Args:
        error: any exception.
        longest: characters of its message that are kept.
        one_line: replaces each run of white space by one space.

    Returns:
        As in `ValueError: no such pose`.
    """
    try:
        message = str(error)
    except Exception:
        message = "(it has no message)"
    text = f"{type_name(error)}: {message[:longest]}" if message.strip() else type_name(error)
    return " ".join(text.split()) if one_line else text
