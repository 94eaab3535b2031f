"""Search for files: the site file that comes with AEROS, and the modules below a path."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import aeros
from aeros.spec.diagnostics.codes import Diagnostics

MANIFEST = "ecm.yaml"

SCENES: Final = "scenes"
"""Folder of scene files in a module's folder."""

_REGISTRY: Final = "registry.sqlite3"
"""Database of a robot's registry, which stores modules beside it."""


def reference_site_path() -> Path:
    """Return the site file that comes with AEROS: the Panda cell.

    Returns:
        Its path.
    """
    return Path(aeros.__file__).parent / "sites" / "panda_cell.yaml"


def reference_modules_path() -> Path:
    """Return the folder of the modules that come with AEROS.

    Returns:
        Its path.
    """
    return shipped_folder("ecms")


def shipped_folder(name: str) -> Path:
    """Return a folder that comes with AEROS beside the package: that of its clone, or its copy in a wheel.

    Args:
        name: name of the folder in the clone.

    Returns:
        Its path.
    """
    root = Path(aeros.__file__).parent.parent
    return root / name if (root / "pyproject.toml").exists() else root / "aeros_reference" / name


def module_folders(path: Path, diagnostics: Diagnostics) -> list[Path]:
    """Find the modules at a path; report an error if there are none.

    Args:
        path: a manifest, the folder of a module, or a folder of modules.
        diagnostics: receives the error.

    Returns:
        Folders of the modules, sorted.
    """
    if path.name == MANIFEST and path.is_file():
        return [path.parent]
    if (path / MANIFEST).exists():
        return [path]
    if path.is_dir():
        folders = sorted(_manifest_folders(path))
        if folders:
            return folders
        diagnostics.error("AE130", f"there is no `{MANIFEST}` in or below `{path}`")
    else:
        is_other_file = path.exists() and path.suffix in {".yaml", ".yml"}
        cures = (f"if it is a site file, give it by `--site {path}`",) if is_other_file else ()
        fault = f"`{path}` is neither a folder nor an `{MANIFEST}`"
        absent = f"there is no file or folder `{path}`"
        diagnostics.error("AE130", fault if path.exists() else absent, help=cures)
    return []


def all_module_folders(paths: Iterable[Path], diagnostics: Diagnostics) -> list[Path]:
    """Find the modules at several paths; report an error for each without any.

    Args:
        paths: as `module_folders` takes them.
        diagnostics: receives the errors.

    Returns:
        Folders of the modules in the order of the paths, each module once, also if links lead to it.
    """
    found: dict[str, Path] = {}
    for path in paths:
        for folder in module_folders(path, diagnostics):
            found.setdefault(os.path.realpath(folder), folder)
    return list(found.values())


@dataclass(frozen=True)
class Surroundings:
    """The modules among which a module finds those that it requires.

    Attributes:
        folders: folders of modules; None for the modules next to it.
        active: the folders of these that are active; a capability is provided by them, if by any of them.
        named: where `folders` is None, folders of modules that are verified together, wherever they lie. They
            come before modules that are merely next to it.
    """

    folders: tuple[Path, ...] | None = None
    active: frozenset[Path] = frozenset()
    named: tuple[Path, ...] = ()

    def place(self, folder: Path) -> Path | None:
        """Return the folder that holds a module and all around it.

        Args:
            folder: the module's folder.

        Returns:
            The folder above it; None where the modules are given.
        """
        if self.folders is not None:
            return None
        return folder.parent if folder.name not in ("", "..") else folder.resolve().parent

    def members(self, place: Path | None) -> tuple[Path, ...]:
        """List the folders of all modules that are around each other.

        Args:
            place: the folder that holds them, as `place` returns it.

        Returns:
            Folders of modules, in a fixed order.
        """
        if self.folders is not None or place is None:
            return self.folders or ()
        neighbours = [one for one in sorted(place.iterdir()) if (one / MANIFEST).is_file()]
        named = set(self.named)
        if named <= set(neighbours):  # as in a folder of a thousand modules, whose links cost time
            return tuple(sorted(neighbours, key=lambda one: one not in named))
        paths = {one.resolve(): one for one in neighbours}
        first = [one for path, one in paths.items() if path in self._resolved]
        elsewhere = [one for path, one in self._resolved.items() if path not in paths]
        return (*first, *elsewhere, *(one for path, one in paths.items() if path not in self._resolved))

    @cached_property
    def _resolved(self) -> dict[Path, Path]:
        """The named folders by their resolved paths."""
        return {one.resolve(): one for one in self.named}

    def around(self, folder: Path) -> tuple[Path, ...]:
        """List the folders of the modules around one.

        Args:
            folder: the module's folder.

        Returns:
            Folders of other modules, in a fixed order.
        """
        members = self.members(self.place(folder))
        if self.folders is not None:
            return tuple(one for one in members if one != folder)
        return tuple(one for one in members if not one.samefile(folder))


NEIGHBOURS: Final = Surroundings()
"""Each module finds those that it requires next to it."""


def may_provide(manifest: str, names: Collection[str]) -> bool:
    """Check by its text alone if a module may have, or provide, one of some names.

    To read a hundred manifests as YAML takes seconds. A manifest spells what its module provides, unless it
    has a backslash, with which YAML can spell it otherwise.

    Args:
        manifest: text of the manifest.
        names: names of modules and capabilities.

    Returns:
        False if it provides none of them.
    """
    return "\\" in manifest or any(name in manifest for name in names)


def _manifest_folders(path: Path) -> Iterator[Path]:
    """Yield folders at `path` and below that have a manifest, each once.

    A link to a module's folder counts, and is not followed farther. Hidden folders and the modules that a
    registry stores are skipped. `Path.rglob` takes several times as long, which is noticeable with a thousand
    modules.
    """
    links: list[Path] = []
    found: set[str] = set()
    for here, folders, files in os.walk(path):
        if _REGISTRY in files:
            folders.clear()
            continue
        if (MANIFEST in files or MANIFEST in folders) and os.path.exists(os.path.join(here, MANIFEST)):
            found.add(os.path.realpath(here))
            yield Path(here)
        folders[:] = [name for name in folders if not name.startswith(".")]
        links += [Path(here, name) for name in folders if os.path.islink(os.path.join(here, name))]
    for link in sorted(links):
        target = os.path.realpath(link)
        if target not in found and (link / MANIFEST).is_file():
            found.add(target)
            yield link
