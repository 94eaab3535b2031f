"""Modules that have settings: names of those that exist, and an error for settings of one that does not."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import decode_manifest_text
from aeros.spec.obligations.absent_modules import absent_settings
from aeros.spec.text.discovery import MANIFEST, NEIGHBOURS, Surroundings, may_provide
from aeros.spec.text.files import read_source


def other_modules(
    absent: Collection[str],
    unread: Iterable[Path],
    folders: Iterable[Path],
    surroundings: Surroundings = NEIGHBOURS,
) -> frozenset[str]:
    """Return the names of modules that could not be read, or that have settings and are next to those given.

    Args:
        absent: names with settings that no module that was read has.
        unread: folders of the given modules that could not be read.
        folders: folders of all given modules.
        surroundings: the modules among which each finds others.

    Returns:
        Names of modules.
    """
    if not absent:
        return frozenset(map(_own_name, unread))
    places = {surroundings.place(folder) for folder in folders}
    around = {one for place in places for one in surroundings.members(place)}
    named = (one for one in around if may_provide((one / MANIFEST).read_text("utf-8", "replace"), absent))
    return frozenset(map(_own_name, unread)) | (frozenset(map(_own_name, named)) & frozenset(absent))


def absent_module_problems(configured: Iterable[str], folders: Sequence[Path]) -> list[Diagnostic]:
    """Find settings of the operator for modules that are not there.

    Args:
        configured: names of the modules that have settings.
        folders: folders of the given modules.

    Returns:
        An error for each module that is neither given nor next to one that is.
    """
    wanted = frozenset(configured)
    if not wanted or not folders:
        return []
    names = frozenset(map(_own_name, folders))
    names |= other_modules(wanted - names, (), folders)
    return [absent_settings(name, None, names) for name in sorted(wanted - names)]


def _own_name(folder: Path) -> str:
    """Return the id in a module's manifest; the folder's name if the manifest has a fault."""
    try:
        declared = decode_manifest_text(read_source(folder / MANIFEST))
    except UserError:
        declared = None
    return folder.resolve().name if declared is None else declared.id.value
