"""Modules installed on one robot, as its registry's folder holds them, and the proof of those in force."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import prove_configuration
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.proof_memory import ModuleSet, ProofMemory
from aeros.runtime.registry.run_modules import LoadedModules
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.runtime.registry.stored_modules import StoredModules, refusal
from aeros.runtime.registry.waiting_modules import WaitingModule, find_waiting, require_configured
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_ecm
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import Surroundings
from aeros.spec.text.versions import is_compatible_version
from aeros.spec.verification.reports import Report


class InstalledModules(StoredModules):
    """Installed modules of one robot, to read; implements `RunModules`.

    Args:
        state: the robot's state folder.
    """

    def __init__(self, state: Path) -> None:
        super().__init__(state)
        self._proofs = ProofMemory(prove_configuration)

    def configuration(self, snapshot: RegistrySnapshot | None = None) -> tuple[Configuration, Report]:
        """Prove the configuration of the active modules.

        Args:
            snapshot: content of the registry; by default as it is now.

        Returns:
            The configuration, and the report of its proof.

        Raises:
            UserError: it cannot be read or proved.
        """
        return self._prove_snapshot(self.snapshot() if snapshot is None else snapshot)

    def load(self, snapshot: RegistrySnapshot) -> LoadedModules:
        """Implement `RunModules.load`: the active modules."""
        configuration, report = self._prove_snapshot(snapshot)
        identities = self.identities(snapshot)
        return LoadedModules(
            snapshot, snapshot.site, identities, configuration, report, {}, is_installed=True
        )

    def waiting(self) -> dict[str, WaitingModule]:
        """List the modules that wait to be configured.

        Returns:
            The modules by name; each after those that it needs.

        Raises:
            UserError: a module cannot be read.
        """
        return self._find_waiting(self.snapshot())

    def inactive_modules(self) -> dict[str, Ecm]:
        """Load the modules that are installed and not active.

        Returns:
            Modules by name, not proved; without those that wait to be configured.

        Raises:
            UserError: a module cannot be read.
        """
        snapshot = self.snapshot()
        site, folders = self._policy_of(snapshot), self._folders(snapshot)
        unconfigured = self._unconfigured(snapshot)
        idle = [
            name
            for name, one in snapshot.modules.items()
            if one.state is not ModuleState.ACTIVE and name not in unconfigured
        ]
        return {name: load_module(site, folders[name], folders.values()) for name in idle}

    # Parts.

    def _modules_that_need(self, name: str, snapshot: RegistrySnapshot) -> list[str]:
        """List the proved modules whose manifest names a module as required."""
        waiting = self._unconfigured(snapshot)
        return [
            other
            for other, folder in self._folders(snapshot).items()
            if other != name
            and other not in waiting
            and name in {one.value for one, _ in self._declared(folder).dependencies.modules}
        ]

    def _find_waiting(self, snapshot: RegistrySnapshot) -> dict[str, WaitingModule]:
        """Find the modules that cannot be proved before they are configured, in any state."""
        if not snapshot.modules:
            return {}
        declared = {name: self._declared(folder) for name, folder in self._folders(snapshot).items()}
        return find_waiting(snapshot, declared, self._site_of(snapshot))

    def _unconfigured(self, snapshot: RegistrySnapshot) -> frozenset[str]:
        """Return the modules that are not proved yet: they are installed, and wait to be configured.

        Raises:
            UserError: a configured or active module needs one that waits.
        """
        waiting = self._find_waiting(snapshot)
        require_configured(snapshot, waiting)
        return frozenset(name for name in waiting if snapshot.modules[name].state is ModuleState.INSTALLED)

    def _prove_snapshot(self, new: RegistrySnapshot) -> tuple[Configuration, Report]:
        """Prove the configuration of `new`, whose files are stored, unless the proof is known.

        Raises:
            UserError: stored files were altered, a needed module is not active, or the proof fails.
        """
        folders = self._folders(new)
        for one in new.modules.values():
            if bundle_digest(module_files(folders[one.name])) != one.digest:
                raise refusal(
                    "AE965",
                    f"the stored files of `{one.name}` differ from the installed ones",
                    "install the module again from its folder or bundle, which stores its files anew",
                )
        active = {name for name, one in new.modules.items() if one.state is ModuleState.ACTIVE}
        unconfigured = self._unconfigured(new)
        given = {name: one for name, one in new.configurations.items() if name not in unconfigured}
        settings = OperatorSettings(self.blocks(new), given)
        proved = ModuleSet(
            {folders[name]: one.digest for name, one in new.modules.items() if name not in unconfigured},
            self.site_file(new),
            settings,
            [folders[name] for name in active],
        )
        configuration, report = self._proofs.prove(proved)
        require_dependencies(configuration)
        return configuration, report


def require_dependencies(configuration: Configuration) -> None:
    """Require that what each active module needs is active.

    Args:
        configuration: a proved configuration.

    Raises:
        UserError: a module needs one that is not active.
    """
    for name, ecm in configuration.modules.items():
        for needed in ecm.required_modules:
            if needed not in configuration.modules:
                raise refusal(
                    "AE964",
                    f"`{name}` needs `{needed}`, which is not active",
                    f"`aeros activate {needed}` first, or `aeros deactivate {name}`",
                )
        for capability, specifier in ecm.required_capabilities.items():
            if not active_providers(capability, specifier, configuration.modules.values()):
                raise refusal(
                    "AE964",
                    f"`{name}` needs the capability `{capability}` {specifier}, and no active module has it",
                    f"activate a module that `aeros list` shows with it, or `aeros deactivate {name}`",
                )


def active_providers(capability: str, specifier: str, modules: Iterable[Ecm]) -> list[str]:
    """List the modules that provide a capability in a version that suits.

    Args:
        capability: name of the capability.
        specifier: version range.
        modules: the modules to look at.

    Returns:
        Their names.
    """
    return [
        ecm.id
        for ecm in modules
        if capability in ecm.capability_versions
        and is_compatible_version(specifier, ecm.capability_versions[capability])
    ]


def load_module(site: Site, folder: Path, installed: Iterable[Path]) -> Ecm:
    """Load a module without proving it.

    Args:
        site: the policy that it is read under.
        folder: the module's folder.
        installed: folders of the modules among which it finds those that it requires.

    Returns:
        The module.

    Raises:
        UserError: it cannot be read.
    """
    diagnostics = Diagnostics()
    loaded = load_ecm(folder, site, diagnostics, Surroundings(tuple(installed)))
    diagnostics.raise_if_errors()
    if loaded is None:
        raise refusal("AE961", f"`{folder}` holds no module")
    return loaded.ecm
