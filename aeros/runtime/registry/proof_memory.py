"""Proofs of sets of modules that this process made, by digests of everything that they depend on.

A swap proves one set of modules several times: when a module is configured without a change of its
settings, when the executor loads what was activated, and when a module is put back.  A remembered proof
counts only for modules whose files have the same digests now, at the same places, with the same ones active,
under a site with the same text and with the same settings.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Collection, Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import ProveConfiguration
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.text.digests import code_digest, code_files, text_digest
from aeros.spec.text.discovery import MANIFEST
from aeros.spec.text.files import read_source
from aeros.spec.text.site_layers import read_site
from aeros.spec.verification.reports import Report

_MAX_PROOFS: Final = 8
"""Number of sets of modules that are remembered; the least recently used one is forgotten."""


@dataclass(frozen=True)
class ModuleSet:
    """Stored modules to be proved together.

    Attributes:
        bundles: digest of all files that belong to a module, by its folder; read from the folder now.
        site: the site file.
        settings: settings of the operator.
        active: folders of the active modules.
    """

    bundles: Mapping[Path, str]
    site: Path
    settings: OperatorSettings
    active: Collection[Path]


class ProofMemory:
    """Prover of sets of modules that remembers its latest proofs.

    Args:
        prove: proves a set of modules, as `proving.prove_configuration` does.
    """

    def __init__(self, prove: ProveConfiguration) -> None:
        self._prove = prove
        self._proved = OrderedDict[Hashable, tuple[OperatorSettings, tuple[Configuration, Report]]]()

    def prove(self, modules: ModuleSet) -> tuple[Configuration, Report]:
        """Prove modules, unless exactly these were proved before.

        Args:
            modules: the modules.

        Returns:
            The configuration of the active ones, and the report of its proof.

        Raises:
            UserError: they cannot be read or proved.
        """
        key = _premises(modules)
        known = self._proved.get(key)
        if known is not None and known[0] == modules.settings:
            self._proved.move_to_end(key)
            return known[1]
        names = {folder.name for folder in modules.active}  # a stored folder has the name of its module
        configuration, report = self._prove(
            list(modules.bundles),
            modules.site,
            certified=False,
            settings=modules.settings,
            active=names.__contains__,
            active_folders=list(modules.active),
        )
        # Files that changed while they were proved are not those that the key names.
        if key is not None and key == _premises(modules):
            self._proved[key] = modules.settings, (configuration, report)
            if len(self._proved) > _MAX_PROOFS:
                self._proved.popitem(last=False)
        return configuration, report


def _premises(modules: ModuleSet) -> Hashable:
    """Return the digests of everything that a proof depends on; None if a file cannot be read."""
    try:
        # The manifests again, as a file may have changed since its bundle was read.
        manifests = [text_digest(read_source(folder / MANIFEST).text) for folder in modules.bundles]
        # A bundle has no hidden files and no caches, and code in these counts for a proof.
        code = [code_digest(code_files(folder)) for folder in modules.bundles]
        site = text_digest(read_site(modules.site).text)
    except (OSError, UserError):
        return None
    settings = hash(modules.settings)
    active = frozenset(modules.active)
    return tuple(modules.bundles.items()), tuple(manifests), tuple(code), modules.site, site, settings, active
