"""Sources of modules for `aeros install`: a folder, a bundle, or an installed Python distribution."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Final

from aeros.files import temporary_folder
from aeros.runtime.registry.archive import unpack
from aeros.runtime.registry.shown_paths import shown_as
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.text.discovery import MANIFEST

BUNDLE: Final = ".ecm.zip"

ENTRY_POINT_GROUP: Final = "aeros.ecms"
"""Group of entry points under which an installed Python distribution provides its modules."""


@contextmanager
def module_source(given: str) -> Iterator[Path]:
    """Open the folder of a module.  No code of the module is executed.

    Args:
        given: A folder, a bundle file, or an entry point of the group `aeros.ecms`.

    Yields:
        The module's folder, valid until the block ends.

    Raises:
        UserError: There is no such module.
    """
    path = Path(given)
    if path.is_dir():
        yield path
    elif path.is_file():
        with temporary_folder() as unpacked:
            folder = unpacked / path.name.removesuffix(BUNDLE)
            folder.mkdir()
            unpack(path, folder)
            _require_manifest(folder, given)
            with shown_as(folder, path):
                yield folder
    else:
        for found in entry_points(group=ENTRY_POINT_GROUP, name=given):
            yield _package_folder(found)
            return
        raise _error(f"`{given}` is not a folder, a file or an entry point of `{ENTRY_POINT_GROUP}`")


def _require_manifest(folder: Path, bundle: str) -> None:
    """Require that an unpacked bundle holds a module at its top.

    Raises:
        UserError: It holds none.
    """
    if (folder / MANIFEST).exists():
        return
    deeper = sorted(one.parent.relative_to(folder).as_posix() for one in folder.glob(f"*/{MANIFEST}"))
    cure = (
        f"pack the contents of the folder `{deeper[0]}`, not the folder"
        if deeper
        else "pack a module's folder with `aeros bundle`"
    )
    raise UserError(
        [Diagnostic("AE961", f"`{bundle}` holds no module: it has no `{MANIFEST}` at its top", help=(cure,))]
    )


def _package_folder(found: EntryPoint) -> Path:
    """Return the folder of the package that the entry point names.

    Loading the package would execute it before it is proved.  So only its outermost package is located, which
    imports none of it.

    Raises:
        UserError: The entry point names no folder of a package.
    """
    outermost, *inner = found.value.split(".")
    try:
        spec = importlib.util.find_spec(outermost)
    except (ImportError, ValueError):
        spec = None
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        path = Path(folder, *inner)
        if path.is_dir():
            return path
    raise _error(f"the entry point `{found.name}` is `{found.value}`, which is not a folder of a package")


def _error(reason: str) -> UserError:
    return UserError([Diagnostic("AE961", reason)])
