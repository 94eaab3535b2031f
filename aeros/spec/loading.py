"""Files → models: the whole way from a path to a `Site` or an `Ecm`, reporting everything on it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TypeVar

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.declared import site as declared_site
from aeros.spec.decode import decode
from aeros.spec.diagnostics import Diagnostics
from aeros.spec.digests import code_digest, code_files, text_digest
from aeros.spec.elaborate.ecm import elaborate_ecm
from aeros.spec.elaborate.site import elaborate_site
from aeros.spec.errors import UserError
from aeros.spec.model import Ecm, Site
from aeros.spec.reader import read_source, read_yaml
from aeros.spec.source import Source

MANIFEST = "ecm.yaml"
_T = TypeVar("_T")


@dataclass(frozen=True)
class LoadedEcm:
    """A module and the Python files it was digested from, by path relative to its folder."""

    ecm: Ecm
    code: dict[str, bytes]


def reference_site() -> Path:
    """The site file that comes with AEROS: the Panda cell."""
    return Path(str(resources.files("aeros") / "sites" / "panda_cell.yaml"))


def load_site(path: str | os.PathLike[str], sink: Diagnostics) -> Site | None:
    """The site at `path`, or None after reporting everything that stands in its way."""
    found = _declared(path, declared_site.Site, sink)
    if found is None:
        return None
    declared, source = found
    return elaborate_site(declared, _digest(source), sink)


def load_ecm(folder: Path, site: Site, sink: Diagnostics) -> LoadedEcm | None:
    """The module in `folder` under `site`, or None after reporting everything that stands in its way."""
    found = _declared(folder / MANIFEST, declared_ecm.Ecm, sink)
    if found is None:
        return None
    declared, source = found
    try:
        code = code_files(folder)
    except OSError as error:
        sink.error("AE002", f"cannot read the code in `{folder}`: {error.strerror}")
        return None
    ecm = elaborate_ecm(declared, site, str(folder), (_digest(source), code_digest(code)), sink)
    return None if ecm is None else LoadedEcm(ecm, code)


def module_folders(path: Path, sink: Diagnostics) -> list[Path]:
    """The folders below `path` that hold a module, in order; reports when there is none.

    `path` may be a manifest, the folder of a module, or a folder of modules.
    """
    if path.name == MANIFEST and path.is_file():
        return [path.parent]
    if (path / MANIFEST).exists():
        return [path]
    if path.is_dir():
        folders = sorted(
            found.parent for found in path.rglob(MANIFEST) if not _hidden(found.relative_to(path))
        )
        if folders:
            return folders
        sink.error("AE130", f"there is no `{MANIFEST}` in or below `{path}`")
    else:
        sink.error("AE130", f"`{path}` is neither a folder nor an `{MANIFEST}`")
    return []


def _hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _declared(path: str | os.PathLike[str], schema: type[_T], sink: Diagnostics) -> tuple[_T, Source] | None:
    try:
        source = read_source(path)
    except UserError as error:
        for diagnostic in error.diagnostics:
            sink.report(diagnostic)
        return None
    node = read_yaml(source, sink)
    declared = None if node is None else decode(node, schema, sink)
    return None if declared is None or sink.has_errors else (declared, source)


def _digest(source: Source) -> str:
    return text_digest(source.text)
