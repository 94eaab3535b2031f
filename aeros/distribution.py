"""The name under which AEROS is installed, and how to install more of it."""

from __future__ import annotations

import json
import shlex
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution, metadata
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

NAME: Final = "aeros-robot"
"""Name of the distribution.  `aeros`, which is only that of the import and of the command, is somebody else's
on PyPI."""

_PYTHON: Final = sys.version_info[:2]


def install_command(extra: str) -> str:
    """Say how to install what an extra provides, from where AEROS itself was installed.

    The distribution is not on PyPI yet: it comes from a clone, a wheel or a repository.  PyBullet has wheels
    for Python 3.11 only, and pip would compile it for minutes elsewhere.

    Args:
        extra: name of the extra, as in `pyproject.toml`.

    Returns:
        A command, and where to give it; or the Python that the extra needs.
    """
    if extra == "sim" and _PYTHON >= (3, 12):
        return f"Python 3.11, as PyBullet has no wheel for Python {_PYTHON[0]}.{_PYTHON[1]}"
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
