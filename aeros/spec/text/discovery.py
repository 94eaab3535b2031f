"""Where things are: the site file that comes with AEROS, and the modules below a path."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import aeros
from aeros.spec.diagnostics.codes import Diagnostics

MANIFEST = "ecm.yaml"


def reference_site_path() -> Path:
    """The site file that comes with AEROS: the Panda cell."""
    return Path(aeros.__file__).parent / "sites" / "panda_cell.yaml"


def module_folders(path: Path, sink: Diagnostics) -> list[Path]:
    """The folders below `path` that hold a module, in order; reports when there is none.

    `path` may be a manifest, the folder of a module, or a folder of modules.
    """
    if path.name == MANIFEST and path.is_file():
        return [path.parent]
    if (path / MANIFEST).exists():
        return [path]
    if path.is_dir():
        folders = sorted(_manifest_folders(path))
        if folders:
            return folders
        sink.error("AE130", f"there is no `{MANIFEST}` in or below `{path}`")
    else:
        sink.error("AE130", f"`{path}` is neither a folder nor an `{MANIFEST}`")
    return []


def _manifest_folders(path: Path) -> Iterator[Path]:
    """Folders at `path` and below that have a manifest; hidden ones and links to folders are not looked into.

    `Path.rglob` takes several times as long, which is felt among a thousand modules.
    """
    for here, folders, files in os.walk(path):
        if (MANIFEST in files or MANIFEST in folders) and os.path.exists(os.path.join(here, MANIFEST)):
            yield Path(here)
        folders[:] = [name for name in folders if not name.startswith(".")]
