"""The name under which AEROS is installed, and how to install more of it."""

from __future__ import annotations

import json
import shlex
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution, metadata
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

NAME: Final = "aeros-robot"
"""Name of the distribution.  `aeros`, which is only that of the import and of the command, is somebody else's
on PyPI."""


def install_command(extra: str) -> str:
    """Say how to install what an extra provides, from where AEROS itself was installed.

    The distribution is not on PyPI yet: it comes from a clone, a wheel or a repository.

    Args:
        extra: name of the extra, as in `pyproject.toml`.

    Returns:
        A command, and where to give it.
    """
    source = _source()
    if source is None:
        return f"`pip install '.[{extra}]'` in the clone of AEROS"
    return f"`pip install {shlex.quote(source.format(extra=extra))}`"


@cache
def _source() -> str | None:
    """Return the requirement by which pip installed this AEROS, with `{extra}` in it; None for a clone."""
    try:
        found = json.loads(distribution(NAME).read_text("direct_url.json") or "{}")
        address = found.get("url", "")
        if "vcs_info" in found:
            revision = found["vcs_info"]["commit_id"]
            return f"{NAME}[{{extra}}] @ {found['vcs_info']['vcs']}+{address}@{revision}"
        path = unquote(urlsplit(address).path)
    except (PackageNotFoundError, OSError, ValueError, KeyError, AttributeError):
        return None
    is_wheel = "archive_info" in found and address.startswith("file:") and Path(path).is_file()
    return f"{path}[{{extra}}]" if is_wheel and not {"{", "}"} & set(path) else None


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
