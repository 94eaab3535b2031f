"""The name under which AEROS is installed, and how to install more of it."""

from __future__ import annotations

from functools import cache
from importlib.metadata import metadata
from typing import Final

NAME: Final = "aeros-robot"
"""Name of the distribution.  `aeros`, which is only that of the import and of the command, is somebody else's
on PyPI."""


def install_command(extra: str) -> str:
    """Say how to install what an extra provides.

    The distribution is not on PyPI yet, so it is installed from the clone.

    Args:
        extra: name of the extra, as in `pyproject.toml`.

    Returns:
        A command, and where to give it.
    """
    return f"`pip install '.[{extra}]'` in the clone of AEROS"


@cache
def repository() -> str:
    """Return the address of AEROS's repository, which `pyproject.toml` states.

    Returns:
        The address.

    Raises:
        LookupError: the metadata of the installed distribution name no repository.
    """
    for entry in metadata(NAME).get_all("Project-URL") or ():
        label, _, address = entry.partition(", ")
        if label == "Repository":
            return str(address).rstrip("/")
    raise LookupError(f"the metadata of `{NAME}` name no repository")
