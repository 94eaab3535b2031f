"""Modules that others require and that lie next to them: a run loads them with the folder it is given."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.elaborate.load import decode_manifest
from aeros.spec.text.discovery import NEIGHBOURS
from aeros.spec.text.versions import suits


def with_required_folders(folders: Iterable[Path]) -> list[Path]:
    """Add the folders of the modules that modules require and that lie next to them, at any depth.

    A link to a folder counts as the folder, as it does where `aeros verify` looks up what a module requires.

    Args:
        folders: folders of modules.

    Returns:
        The folders, then those of further modules: each that one of them requires by its name, and each that
        provides a required capability in a version that suits if none of those before does.
    """
    found = list(folders)
    known = {one.resolve() for one in found}
    modules = [one for one in map(decode_manifest, found) if one is not None]
    for folder in found:  # grows while it is gone through
        module = decode_manifest(folder)
        if module is None or not (
            module.dependencies.modules.items or module.dependencies.capabilities.items
        ):
            continue
        open_names = {name.value for name, _ in module.dependencies.modules} - {
            one.id.value for one in modules
        }
        open_capabilities = _unprovided(module, modules)
        for neighbour in NEIGHBOURS.around(folder):
            other = None if neighbour.resolve() in known else decode_manifest(neighbour)
            if other is None:
                continue
            if other.id.value in open_names or open_capabilities - _unprovided(module, [other]):
                found.append(neighbour)
                known.add(neighbour.resolve())
                modules.append(other)
    return found


def _unprovided(module: declared_ecm.Ecm, others: Iterable[declared_ecm.Ecm]) -> set[str]:
    """Return the capabilities that a module requires and that none of some others provides in its range."""
    provided = [offer for other in others for offer in other.capability_versions.items()]
    return {
        name.value
        for name, needed in module.dependencies.required_capabilities
        if not any(
            name.value == offered and suits(needed.version.value, version) for offered, version in provided
        )
    }
