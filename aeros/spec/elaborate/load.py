"""Loading of site and module files: from a path to a `Site` or an `Ecm`, with every fault reported."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.declared import site as declared_site
from aeros.spec.declared.decode import decode
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.ecm import elaborate_ecm
from aeros.spec.elaborate.site import elaborate_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.text.digests import code_digest, code_files, text_digest
from aeros.spec.text.discovery import MANIFEST
from aeros.spec.text.files import read_source
from aeros.spec.text.yaml_reader import read_yaml

_T = TypeVar("_T")


@dataclass(frozen=True)
class LoadedEcm:
    """A module with its code.

    Attributes:
        ecm: the module.
        code: bytes of the Python files in its code digest, by path relative to the module's folder.
    """

    ecm: Ecm
    code: dict[str, bytes]


def load_site(path: str | os.PathLike[str], diagnostics: Diagnostics) -> Site | None:
    """Load the site at a path.

    Args:
        path: path of the site file.
        diagnostics: receives the faults.

    Returns:
        The site, or None after reporting every fault.
    """
    source = _source(path, diagnostics)
    return None if source is None else elaborate_source(source, diagnostics)


def elaborate_source(source: Source, diagnostics: Diagnostics) -> Site | None:
    """Elaborate the site that a source declares.

    Results are cached: the same text under the same path gives the same site, without elaborating it again.

    Args:
        source: text of the site file and its path.
        diagnostics: receives the faults.

    Returns:
        The site, or None after reporting every fault.
    """
    site, faults = _elaborate_with_diagnostics(source)
    diagnostics.extend(faults)
    return site


@lru_cache(maxsize=8)
def _elaborate_with_diagnostics(source: Source) -> tuple[Site | None, Diagnostics]:
    diagnostics = Diagnostics()
    declared = _decode_source(source, declared_site.Site, diagnostics)
    return None if declared is None else elaborate_site(
        declared, text_digest(source.text), diagnostics
    ), diagnostics


def load_ecm(folder: Path, site: Site, diagnostics: Diagnostics) -> LoadedEcm | None:
    """Load the module in a folder, under a site.

    Args:
        folder: the module's folder, which holds `ecm.yaml`.
        site: site under which the module is elaborated.
        diagnostics: receives the faults.

    Returns:
        The module with its code, or None after reporting every fault.
    """
    source = _source(folder / MANIFEST, diagnostics)
    declared = None if source is None else _decode_source(source, declared_ecm.Ecm, diagnostics)
    if source is None or declared is None:
        return None
    try:
        code = code_files(folder)
    except OSError as error:
        diagnostics.error("AE002", f"cannot read the code in `{folder}`: {error.strerror}")
        return None
    ecm = elaborate_ecm(
        declared, site, str(folder), (text_digest(source.text), code_digest(code)), diagnostics
    )
    return None if ecm is None else LoadedEcm(ecm, code)


def _source(path: str | os.PathLike[str], diagnostics: Diagnostics) -> Source | None:
    try:
        return read_source(path)
    except UserError as error:
        for diagnostic in error.diagnostics:
            diagnostics.report(diagnostic)
        return None


def _decode_source(source: Source, schema: type[_T], diagnostics: Diagnostics) -> _T | None:
    node = read_yaml(source, diagnostics)
    declared = None if node is None else decode(node, schema, diagnostics)
    return None if declared is None or diagnostics.has_errors else declared
