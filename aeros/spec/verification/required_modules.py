"""The modules around one that its proof depends on: any that may provide what it requires, at any depth."""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from pathlib import Path
from typing import Any, Final

from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.text.digests import code_digest, code_files, model_digest, text_digest
from aeros.spec.text.discovery import MANIFEST, Surroundings, may_provide
from aeros.spec.text.files import read_source
from aeros.spec.verification.certificate import LOCK

_MAX_OTHER_FILES: Final = 64 * 2**20
"""Bytes of files of a module that are hashed to find the proof of another; with more, it is proved anew."""


class RequiredModules:
    """The modules around others as they are when first asked for; each is read and hashed once.

    Args:
        surroundings: the modules among which each finds those that it requires.
    """

    def __init__(self, surroundings: Surroundings) -> None:
        self._surroundings = surroundings
        self._members: dict[Path | None, dict[Path, Source]] = {}
        self._manifests: dict[Path, Source] = {}
        self._digests: dict[Path, list[Any]] = {}

    def names(self, folder: Path, manifest: Source) -> frozenset[str] | None:
        """Collect the names of modules and capabilities that a module requires, or one that it may use.

        Args:
            folder: the module's folder.
            manifest: its manifest.

        Returns:
            The names; None if a file cannot be read.
        """
        # Imported here: a run that finds everything proved reads no manifest.
        from aeros.spec.elaborate.load import decode_manifest_text

        names: set[str] = set()
        read: set[Source] = set()
        unread = {manifest}
        try:
            while unread:
                for declared in map(decode_manifest_text, unread):
                    if declared is not None:
                        needed = declared.dependencies
                        names |= {name.value for name, _ in (*needed.modules, *needed.capabilities)}
                read |= unread
                unread = set(self._providers(folder, names).values()) - read
        except (UserError, OSError):
            return None
        return frozenset(names)

    def digest(self, folder: Path, names: Collection[str]) -> str | None:
        """Hash the modules around one that may provide any of the names, with their models.

        Args:
            folder: the module's folder.
            names: of modules and capabilities, as `names` returns them.

        Returns:
            SHA-256; None if a file cannot be read.
        """
        try:
            parts = [self._digest_of(*one) for one in self._providers(folder, names).items()]
        except (UserError, OSError):
            return None
        return text_digest(json.dumps(parts))

    def _providers(self, folder: Path, names: Collection[str]) -> dict[Path, Source]:
        """Return folder and manifest of each module that may provide any of the names, in a fixed order."""
        place = self._surroundings.place(folder)
        if place not in self._members:
            members = self._surroundings.members(place)
            self._members[place] = {one: self._manifest_of(one) for one in members}
        return {
            one: manifest
            for one, manifest in self._members[place].items()
            if may_provide(manifest.text, names)
        }

    def _manifest_of(self, folder: Path) -> Source:
        if folder not in self._manifests:
            self._manifests[folder] = read_source(folder / MANIFEST)
        return self._manifests[folder]

    def _digest_of(self, folder: Path, manifest: Source) -> list[Any]:
        if folder not in self._digests:
            self._digests[folder] = [
                folder in self._surroundings.active,
                text_digest(manifest.text),
                code_digest(code_files(folder)),
                _other_files(folder),
            ]
        return self._digests[folder]


def _other_files(folder: Path) -> list[list[str]]:
    """Return name and digest of what may be a model of a module; raise OSError where there is too much."""
    left, found = _MAX_OTHER_FILES, []
    for here, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if name != "__pycache__")
        for name in sorted(files):
            below = os.path.relpath(os.path.join(here, name), folder)
            if not name.endswith(".py") and below not in (MANIFEST, LOCK):
                digest, size = model_digest(folder, below, left)
                left -= size
                found.append([below, digest])
    return found
