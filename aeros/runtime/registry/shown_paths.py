"""Paths in error messages: the user's own file is named, where a stored copy of it was read."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from aeros.spec.diagnostics.errors import UserError


@contextmanager
def shown_as(read: Path, named: Path) -> Iterator[None]:
    """Name another path in the errors that the block raises.

    Args:
        read: file or folder that the block reads.
        named: file or folder that it is a copy of, as the user named it.

    Yields:
        Nothing.

    Raises:
        UserError: the error of the block, with the paths below `read` replaced.
    """
    try:
        yield
    except UserError as error:
        raise type(error)(_renamed(error.diagnostics, str(read), str(named))) from error


def _renamed(value: Any, old: str, new: str) -> Any:
    """Replace a path in all texts of a value, except in the texts of source files."""
    if isinstance(value, str):
        return value.replace(old, new)
    if isinstance(value, tuple):
        return tuple(_renamed(one, old, new) for one in value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [one.name for one in dataclasses.fields(value) if one.init and one.name != "text"]
        return dataclasses.replace(
            value, **{name: _renamed(getattr(value, name), old, new) for name in names}
        )
    return value
