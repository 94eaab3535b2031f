"""Loading of site and module files: from a path to a `Site` or an `Ecm`, with every fault reported."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TypeVar

from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.declared import site as declared_site
from aeros.spec.declared.decode import decode
from aeros.spec.declared.site import Overlay, with_overlay
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.module.absent_modules import blame_missing_modules
from aeros.spec.elaborate.module.callables import foreign_names
from aeros.spec.elaborate.module.ecm import elaborate_ecm
from aeros.spec.elaborate.site import elaborate_site
from aeros.spec.elaborate.tools import check_words_of_overlay
from aeros.spec.model.ecm import Ecm, ForeignNames
from aeros.spec.model.site import Site
from aeros.spec.text.digests import code_digest, code_files, text_digest
from aeros.spec.text.discovery import MANIFEST, NEIGHBOURS, Surroundings, may_provide
from aeros.spec.text.files import read_source
from aeros.spec.text.site_layers import layers_of, read_site
from aeros.spec.text.versions import suits
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
        path: path of the site file, or of an overlay.
        diagnostics: receives the faults.

    Returns:
        The site, or None after reporting every fault.
    """
    source = _site_source(path, diagnostics)
    return None if source is None else elaborate_source(source, diagnostics)


def elaborate_source(source: Source, diagnostics: Diagnostics) -> Site | None:
    """Elaborate the site that a source declares.

    Results are cached: the same text under the same path gives the same site, without elaborating it again.

    Args:
        source: text of the site file and its path, overlays included.
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
    declared = _decode_site_source(source, diagnostics)
    return None if declared is None else elaborate_site(
        declared, text_digest(source.text), diagnostics
    ), diagnostics


def decode_site(path: str | os.PathLike[str]) -> declared_site.Site | None:
    """Read a site file as it is declared, with what overlays add.

    Args:
        path: path of the site file, or of an overlay.

    Returns:
        The site as it declares itself; None if the file has a fault.
    """
    source = _site_source(path, Diagnostics())
    return None if source is None else _decode_site_source(source, Diagnostics())


def _decode_site_source(source: Source, diagnostics: Diagnostics) -> declared_site.Site | None:
    """Decode a site file, and add what each overlay says, the innermost first."""
    *overlays, base = layers_of(source)
    site = _decode_source(base, declared_site.Site, diagnostics)
    for layer in reversed(overlays):
        overlay = _decode_source(layer, Overlay, diagnostics)
        if site is None or overlay is None or not check_words_of_overlay(site, overlay, diagnostics):
            site = None
        else:
            site = with_overlay(site, overlay)
    return site


def load_ecm(
    folder: Path,
    site: Site,
    diagnostics: Diagnostics,
    surroundings: Surroundings = NEIGHBOURS,
    above: frozenset[str] = frozenset(),
    manifest: Source | None = None,
) -> LoadedEcm | None:
    """Load the module in a folder, under a site.

    A module without models is elaborated once a process, as long as it and those that it requires are as they
    were: the same text and code under the same site, around the same modules, give the same module.

    Args:
        folder: the module's folder, which holds `ecm.yaml`.
        site: site under which the module is elaborated.
        diagnostics: receives the faults.
        surroundings: the modules among which it finds those that it requires.
        above: ids of modules that require this one, which it cannot require itself.
        manifest: manifest to read in place of the one in the folder.

    Returns:
        The module with its code, or None after reporting every fault.
    """
    source = manifest or _source(folder / MANIFEST, diagnostics)
    if source is None:
        return None
    declared, faults = _decode_ecm(source)
    diagnostics.extend(faults)
    if declared is None or diagnostics.has_errors:
        return None
    try:
        code = code_files(folder)
    except OSError as error:
        diagnostics.error("AE002", f"cannot read the code in `{folder}`: {error.strerror}")
        return None
    digests = text_digest(source.text), code_digest(code)
    needed = declared.dependencies
    around = None
    if needed.modules.items or needed.capabilities.items:
        around = _modules_around(declared, folder, site, surroundings, above)
    # Of a module with models, which are files, the arguments are not all that the result depends on.
    elaborate = _elaborate.__wrapped__ if declared.models else _elaborate
    ecm, faults = elaborate(source, site, str(folder), digests, around)
    diagnostics.extend(faults if around is None else blame_missing_modules(declared, around.names, faults))
    return None if ecm is None else LoadedEcm(ecm, code)


class _ModulesAround:
    """The modules that a module requires; equal where these are the same objects.

    Args:
        needed: names of the modules that it requires by name.
        modules: these, and those that provide a capability that it requires, by name.
        providers: for each required capability, those that provide it, each with True if it is active.
        unsuitable: for each required capability, those that provide it in another version.
    """

    def __init__(
        self,
        needed: frozenset[str],
        modules: Mapping[str, Ecm],
        providers: Mapping[str, list[tuple[Ecm, bool]]],
        unsuitable: Mapping[str, tuple[tuple[str, str], ...]],
    ) -> None:
        self._needed, self._modules, self._providers = needed, modules, providers
        self._unsuitable = unsuitable
        self._identity = (
            needed,
            tuple((name, id(one)) for name, one in modules.items()),
            tuple((name, tuple((id(one), at) for one, at in each)) for name, each in providers.items()),
            tuple(unsuitable.items()),
        )

    @cached_property
    def names(self) -> ForeignNames:
        """What a module may call of them."""
        found = foreign_names(self._modules, self._needed, self._providers)
        return replace(found, unsuitable=self._unsuitable)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ModulesAround) and other._identity == self._identity

    def __hash__(self) -> int:
        return hash(self._identity)


def _modules_around(
    declared: declared_ecm.Ecm,
    folder: Path,
    site: Site,
    surroundings: Surroundings,
    above: frozenset[str],
) -> _ModulesAround:
    """Load the modules that a module requires, as far as they can be read."""
    needed = frozenset(name.value for name, _ in declared.dependencies.modules)
    ranges = {name.value: one.version.value for name, one in declared.dependencies.required_capabilities}
    above |= {declared.id.value}
    modules: dict[str, Ecm] = {}
    providers: dict[str, list[tuple[Ecm, bool]]] = {name: [] for name in ranges}
    unsuitable: dict[str, tuple[tuple[str, str], ...]] = {}
    for one in surroundings.around(folder):
        source = _source(one / MANIFEST, Diagnostics())
        if source is None or not may_provide(source.text, needed | ranges.keys()):
            continue
        other = decode_manifest_text(source)
        if other is None or other.id.value in above or other.id.value in modules:
            continue
        provided = {name.value for name, _ in other.capabilities} & ranges.keys()
        if other.id.value not in needed and not provided:
            continue
        loaded = load_ecm(one, site, Diagnostics(), surroundings, above)
        if loaded is None:
            continue
        modules[loaded.ecm.id] = loaded.ecm
        for name in provided:
            version = loaded.ecm.capability_versions[name]
            if suits(ranges[name], version):
                providers[name].append((loaded.ecm, one in surroundings.active))
            else:
                unsuitable[name] = (*unsuitable.get(name, ()), (loaded.ecm.id, version))
    return _ModulesAround(needed, modules, providers, unsuitable)


def decode_manifest(folder: Path) -> declared_ecm.Ecm | None:
    """Read a manifest without a site.

    Args:
        folder: the module's folder.

    Returns:
        The module as it declares itself; None if the manifest has a fault.
    """
    source = _source(folder / MANIFEST, Diagnostics())
    return None if source is None else decode_manifest_text(source)


def decode_manifest_text(source: Source) -> declared_ecm.Ecm | None:
    """Read the text of a manifest without a site.

    Args:
        source: the text and its path.

    Returns:
        The module as it declares itself; None if the manifest has a fault.
    """
    return _decode_ecm(source)[0]


# A robot may have a thousand modules, which each change of its registry reads in turn.
@lru_cache(maxsize=2048)
def _decode_ecm(source: Source) -> tuple[declared_ecm.Ecm | None, Diagnostics]:
    diagnostics = Diagnostics()
    return _decode_source(source, declared_ecm.Ecm, diagnostics), diagnostics


@lru_cache(maxsize=2048)
def _elaborate(
    source: Source, site: Site, folder: str, digests: tuple[str, str], around: _ModulesAround | None
) -> tuple[Ecm | None, Diagnostics]:
    """Elaborate a module; without models, its arguments are all that the result depends on."""
    diagnostics = Diagnostics()
    declared, _ = _decode_ecm(source)
    if declared is None:
        return None, diagnostics
    foreign = ForeignNames() if around is None else around.names
    return elaborate_ecm(declared, site, folder, digests, diagnostics, foreign), diagnostics


def _site_source(path: str | os.PathLike[str], diagnostics: Diagnostics) -> Source | None:
    return _read(lambda: read_site(Path(path)), diagnostics)


def _source(path: str | os.PathLike[str], diagnostics: Diagnostics) -> Source | None:
    return _read(lambda: read_source(path), diagnostics)


def _read(read: Callable[[], Source], diagnostics: Diagnostics) -> Source | None:
    try:
        return read()
    except UserError as error:
        for diagnostic in error.diagnostics:
            diagnostics.report(diagnostic)
        return None


def _decode_source(source: Source, schema: type[_T], diagnostics: Diagnostics) -> _T | None:
    node = read_yaml(source, diagnostics)
    declared = None if node is None else decode(node, schema, diagnostics)
    return None if declared is None or diagnostics.has_errors else declared
