"""Values as lines of text, for comparison with files: numbers with six digits, records part by part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def number(value: float) -> str:
    """Write a number with six digits; what is almost zero is zero."""
    return f"{0.0 if abs(value) < 1e-9 else float(value):.6g}"


def described(value: Any) -> str:
    """Write a value in one line.

    Args:
        value: a number, text, array, sequence, mapping, dataclass or named tuple.

    Returns:
        The text.
    """
    if is_dataclass(value) and not isinstance(value, type):
        parts = [f"{one.name}={described(getattr(value, one.name))}" for one in fields(value)]
        return f"{type(value).__name__}({', '.join(parts)})"
    if hasattr(value, "_asdict"):
        parts = [f"{name}={described(one)}" for name, one in value._asdict().items()]
        return f"{type(value).__name__}({', '.join(parts)})"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{described(key)}: {described(one)}' for key, one in value.items())}}}"
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return f"({' '.join(map(described, value))})"
    if isinstance(value, float | np.floating):
        return number(float(value))
    return str(value)


def lines(values: Any) -> str:
    """Write each of several values as a line."""
    return "".join(f"{one}\n" for one in map(described, values))


def xml_lines(text: str) -> Iterator[str]:
    """Write XML line by line, its numbers with six digits."""
    for line in text.splitlines():
        words = line.replace('"', ' " ').split(" ")
        yield " ".join(number(float(word)) if _is_fraction(word) else word for word in words).replace(
            ' " ', '"'
        )


def _is_fraction(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return "." in word or "e" in word
