"""Look up simulator input files by path or by the name of one that comes with AEROS."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import aeros
from aeros.spec.diagnostics.codes import Diagnostic, did_you_mean
from aeros.spec.diagnostics.errors import UserError


def shipped_files(folder: str) -> dict[str, Path]:
    """List the YAML files in a folder of the installed package.

    Args:
        folder: relative to the package `aeros`.

    Returns:
        Their paths by file name without suffix.
    """
    return {path.stem: path for path in sorted((Path(aeros.__file__).parent / folder).glob("*.yaml"))}


def find_file(name_or_path: str, shipped: Mapping[str, Path], kind: str) -> str | Path:
    """Find a file that comes with AEROS or a module by its name, or any file by its path.

    Args:
        name_or_path: as a user gives it; a name goes before a path.
        shipped: the files that come with AEROS or a module, by name.
        kind: kind of file for messages, as in `people file`.

    Returns:
        The path.

    Raises:
        UserError: there is neither such a name nor such a file.
    """
    if name_or_path in shipped:
        return shipped[name_or_path]
    if os.path.lexists(name_or_path):
        return name_or_path
    near = did_you_mean(name_or_path, shipped)
    listed = ", ".join(f"`{name}`" for name in shipped)
    headline = f"no file `{name_or_path}`, and no {kind} of that name comes with AEROS or a module"
    help_ = (f"did you mean `{near}`?" if near else f"give a {kind}, or one of {listed}",)
    raise UserError([Diagnostic("AE002", headline, help=help_)])
