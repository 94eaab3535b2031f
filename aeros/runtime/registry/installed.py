"""Modules installed on one robot, as its registry's folder holds them, and the proof of those in force."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import ProveConfiguration, prove_configuration
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.store import RegistrySnapshot, RegistryStore
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.reports import Report


class InstalledModules:
    """Installed modules of one robot, to read.

    Args:
        folder: the registry's folder.
        prove: proves a set of modules, as `proving.prove_configuration` does.
    """

    def __init__(self, folder: Path, prove: ProveConfiguration = prove_configuration) -> None:
        self._prove = prove
        self.folder = folder
        self._records = RegistryStore(folder)

    @property
    def exists(self) -> bool:
        """True if anything was ever stored in it."""
        return self._records.path.exists()

    def snapshot(self) -> RegistrySnapshot:
        """Read the registry.

        Returns:
            Its content now.

        Raises:
            UserError: it cannot be read.
        """
        return self._records.read()

    def configuration(self, snapshot: RegistrySnapshot | None = None) -> tuple[Configuration, Report]:
        """Prove the configuration of the active modules.

        Args:
            snapshot: content of the registry; by default as it is now.

        Returns:
            The configuration, and the report of its proof.

        Raises:
            UserError: it cannot be read or proved.
        """
        return self._prove_snapshot(self.snapshot() if snapshot is None else snapshot, {})

    def capabilities(self, snapshot: RegistrySnapshot) -> dict[str, tuple[str, ...]]:
        """List the capabilities of the installed modules.

        Args:
            snapshot: content of the registry.

        Returns:
            Sorted capabilities that each module provides, by module.

        Raises:
            UserError: a module cannot be read.
        """
        site = self._policy_of(snapshot)
        return {
            name: tuple(sorted(load_module(site, folder).capabilities))
            for name, folder in self._folders(snapshot).items()
        }

    def inactive_modules(self) -> dict[str, Ecm]:
        """Load the modules that are installed and not active.

        Returns:
            Modules by name, not proved.

        Raises:
            UserError: a module cannot be read.
        """
        snapshot = self.snapshot()
        site, folders = self._policy_of(snapshot), self._folders(snapshot)
        idle = [name for name, one in snapshot.modules.items() if one.state is not ModuleState.ACTIVE]
        return {name: load_module(site, folders[name]) for name in idle}

    # Parts.

    def _policy_of(self, snapshot: RegistrySnapshot) -> Site:
        """Load the site in force.

        Raises:
            UserError: the stored policy cannot be read.
        """
        diagnostics = Diagnostics()
        site = load_site(self._site(snapshot), diagnostics)
        diagnostics.raise_if_errors()
        if site is None:
            raise refusal("AE965", f"the policy `{snapshot.site}` cannot be read")
        return site

    def _prove_snapshot(
        self, new: RegistrySnapshot, sources: Mapping[str, Path], site: Path | None = None
    ) -> tuple[Configuration, Report]:
        """Prove the configuration of `new`; `sources` has the folders of modules that are not stored yet.

        Raises:
            UserError: stored files were altered, a needed module is not active, or the proof fails.
        """
        folders = {**self._folders(new), **sources}
        policy = self._site(new) if site is None else site
        blocks = tuple(new.blocks.values())
        for one in new.modules.values():
            if one.name not in sources and bundle_digest(module_files(folders[one.name])) != one.digest:
                raise refusal("AE965", f"the stored files of `{one.name}` differ from the installed ones")
        active = {name for name, one in new.modules.items() if one.state is ModuleState.ACTIVE}
        configuration, report = self._prove(
            folders.values(), policy, certified=False, blocks=blocks, active=active.__contains__
        )
        for name, ecm in configuration.modules.items():
            for needed in ecm.required_modules:
                if needed not in active:
                    raise refusal(
                        "AE964",
                        f"`{name}` needs `{needed}`, which is not active",
                        f"`aeros activate {needed}` first",
                    )
        return configuration, report

    def _folders(self, snapshot: RegistrySnapshot) -> dict[str, Path]:
        return {name: self.folder / one.folder for name, one in snapshot.modules.items()}

    def _site(self, snapshot: RegistrySnapshot) -> Path:
        return self.folder / snapshot.site if snapshot.site else reference_site_path()


def load_module(site: Site, folder: Path) -> Ecm:
    """Load a module without proving it.

    Args:
        site: the policy that it is read under.
        folder: the module's folder.

    Returns:
        The module.

    Raises:
        UserError: it cannot be read.
    """
    diagnostics = Diagnostics()
    loaded = load_ecm(folder, site, diagnostics)
    diagnostics.raise_if_errors()
    if loaded is None:
        raise refusal("AE961", f"`{folder}` holds no module")
    return loaded.ecm


def refusal(code: str, headline: str, *cures: str) -> UserError:
    """Make the error for a change that is refused, or for files that cannot be used.

    Args:
        code: the diagnostic's code.
        headline: the error in one sentence.
        *cures: what helps, one line each.

    Returns:
        The error.
    """
    return UserError([Diagnostic(code, headline, help=cures)])
