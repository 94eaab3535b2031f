"""Bounded texts for objects and exceptions of unknown classes, which no code of theirs can break."""

from __future__ import annotations

from typing import Any


def type_name(value: Any) -> str:
    """Return the name of `value`'s type, at most 100 characters, read without asking its metaclass."""
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
    text = f"{type_name(error)}: {message[:longest]}"
    return " ".join(text.split()) if one_line else text
