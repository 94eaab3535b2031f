"""Past configurations of a robot, rebuilt from what its registry keeps.

The registry's log names the files of each configuration by digest. They are still stored, and are proved
again. The result must have the requested digest, so nothing here has to be trusted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import MappingProxyType

from aeros.runtime.gate.configuration import Configuration, UnknownConfigurationError
from aeros.runtime.registry.change_log import LOG, recorded_changes, recorded_configurations
from aeros.runtime.registry.folder_modules import FolderModules
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.configured import ModuleConfiguration


class PastConfigurations:
    """Implement `FindConfiguration` over a registry."""

    def __init__(self, registry: Registry) -> None:
        self._registry = registry
        self._adopted = recorded_configurations(registry.folder)

    def __call__(self, digest: str) -> Configuration:
        """Implement `FindConfiguration`.

        Raises:
            UnknownConfigurationError: the configuration is not recorded, not stored, or no longer provable.
        """
        snapshot = self._adopted.get(digest)
        if snapshot is None:
            log = self._registry.folder / LOG
            raise UnknownConfigurationError(
                f"no change recorded in `{log}` led to it; "
                "replay a run with --site or --ecms with the same options"
            )
        lost = self._missing_files(snapshot)
        if lost:
            raise UnknownConfigurationError(f"parts of it are no longer stored: {', '.join(lost)}")
        try:
            configuration, _ = self._registry.configuration(snapshot)
        except UserError as refusal:
            headlines = "; ".join(one.headline for one in refusal.diagnostics)
            raise UnknownConfigurationError(f"it is refused now: {headlines}") from refusal
        if configuration.digest != digest:
            raise UnknownConfigurationError(
                f"its modules and policy now give the configuration {configuration.digest}: "
                "AEROS or the solver is of another release, or stored files were changed"
            )
        return configuration

    def _missing_files(self, snapshot: RegistrySnapshot) -> list[str]:
        """Return descriptions of the files of a snapshot that are not stored any more."""
        folder = self._registry.folder
        lost = [
            f"`{one.name}` {one.version} sha256:{one.digest}"
            for one in snapshot.modules.values()
            if not (folder / one.folder).is_dir()
        ]
        return lost if (folder / snapshot.site).is_file() else [*lost, f"`{snapshot.site}`"]


class FolderConfigurations:
    """Implement `FindConfiguration` for runs that loaded their modules from folders.

    A configuration consists of the modules of the folders, the site file, and what the operator had withdrawn
    and blocked.  The registry's log tells the last, so each state that it names is tried.

    Args:
        folders: folders, each of a module or of modules, as the run had them.
        site: site file of the run; None for the policy then in force, or else the reference site.
        registry: the robot's registry; need not exist.
        configurations: settings of the modules, as the run had them, by module.
    """

    def __init__(
        self,
        folders: Sequence[Path],
        site: Path | None,
        registry: Registry,
        configurations: Mapping[str, ModuleConfiguration] = MappingProxyType({}),
    ) -> None:
        self._modules = FolderModules(
            folders, site, registry, needs_certificates=False, configurations=configurations
        )
        self._found: list[Configuration] = []
        self._untried = [snapshot for _, snapshot in recorded_changes(registry.folder)]
        if self._untried:
            self._untried.append(RegistrySnapshot())
        else:
            # Not tried but loaded: an error in the files is reported as it is.
            self._found.append(self._modules.load(RegistrySnapshot()).configuration)

    def __call__(self, digest: str) -> Configuration:
        """Implement `FindConfiguration`.

        Raises:
            UnknownConfigurationError: no recorded state of the registry leads to it.
        """
        while not any(one.digest == digest for one in self._found):
            if not self._untried:
                raise UnknownConfigurationError(
                    "these modules and this site never led to it on this robot; "
                    "replay a run with the --site, --ecms and --state that it had"
                )
            with suppress(UserError):
                self._found.append(self._modules.load(self._untried.pop()).configuration)
        return next(one for one in self._found if one.digest == digest)
