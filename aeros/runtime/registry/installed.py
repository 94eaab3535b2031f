"""Modules installed on one robot, as its registry's folder holds them, and the proof of those in force."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import ProveConfiguration, prove_configuration
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.change_log import LOG, anchor_of
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import ModuleIdentity
from aeros.runtime.registry.run_modules import LoadedModules, blocks_in_force
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.runtime.registry.transaction import RegistryTransactions
from aeros.runtime.registry.waiting_modules import WaitingModule, find_waiting, require_configured
from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import decode_manifest, load_ecm, load_site
from aeros.spec.elaborate.module.needs import module_settings
from aeros.spec.elaborate.module.settings import Setting
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.site import Site
from aeros.spec.text.digests import file_digest
from aeros.spec.text.discovery import Surroundings, reference_site_path
from aeros.spec.text.versions import is_compatible_version
from aeros.spec.verification.reports import Report

_FOLDER: Final = "registry"


class InstalledModules:
    """Installed modules of one robot, to read; implements `RunModules`.

    Args:
        state: the robot's state folder.
        prove: proves a set of modules, as `proving.prove_configuration` does.
    """

    def __init__(self, state: Path, prove: ProveConfiguration = prove_configuration) -> None:
        self._prove = prove
        self.folder = state / _FOLDER
        self._transactions = RegistryTransactions(self.folder, state / "audit.key")

    @property
    def exists(self) -> bool:
        """True if anything was ever changed in it, also if all of it was deleted since."""
        traces = (self.folder / LOG, self._transactions.database, anchor_of(self.folder))
        return any(trace.exists() for trace in traces)

    def snapshot(self) -> RegistrySnapshot:
        """Read the registry.

        Returns:
            Its content now.

        Raises:
            UserError: it cannot be read, or database and record of changes disagree.
        """
        return self._transactions.snapshot()

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

    def identities(self, snapshot: RegistrySnapshot) -> dict[str, ModuleIdentity]:
        """List what identifies each installed module, as blocks name it.

        Args:
            snapshot: content of the registry.

        Returns:
            Version, digest and computing devices by module; devices are unknown where the manifest is lost.

        Raises:
            UserError: the files of a module are not where the registry keeps them.
        """
        folders = self._folders(snapshot)
        return {
            name: ModuleIdentity(one.version, one.digest, _requested_devices(folders[name]))
            for name, one in snapshot.modules.items()
        }

    def blocks(self, snapshot: RegistrySnapshot) -> tuple[OperatorOverride, ...]:
        """Translate the operator's blocks into overrides of the site.

        Args:
            snapshot: content of the registry.

        Returns:
            The overrides for the installed modules, in the order of the blocks' ids.

        Raises:
            UserError: the stored policy cannot be read, or the files of a module are not in their place.
        """
        if not snapshot.blocks:
            return ()
        return blocks_in_force(snapshot, self.identities(snapshot), self._site_of(snapshot).kinds)

    def capabilities(self, snapshot: RegistrySnapshot) -> dict[str, tuple[str, ...]]:
        """List the capabilities of the installed modules.

        Args:
            snapshot: content of the registry.

        Returns:
            Sorted capabilities that each module provides, by module.

        Raises:
            UserError: a module cannot be read.
        """
        return {
            name: tuple(sorted(one.value for one, _ in self._declared(folder).capabilities))
            for name, folder in self._folders(snapshot).items()
        }

    def skills(self, name: str) -> tuple[str, ...]:
        """List the skills of an installed module.

        Args:
            name: id of the module.

        Returns:
            Sorted names of its skills; none if it is not installed.

        Raises:
            UserError: it cannot be read.
        """
        snapshot = self.snapshot()
        if name not in snapshot.modules:
            return ()
        return tuple(sorted(one.value for one, _ in self._declared(self._folders(snapshot)[name]).skills))

    def settings(self, name: str) -> tuple[Setting, ...]:
        """List the needs and parameters of an installed module, with what each is bound or set to.

        Args:
            name: id of the module.

        Returns:
            The settings in the order of the manifest; none if it is not installed.

        Raises:
            UserError: it cannot be read.
        """
        snapshot = self.snapshot()
        if name not in snapshot.modules:
            return ()
        return module_settings(self._declared(self._folders(snapshot)[name]), self._policy_of(snapshot))

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

    def _policy_of(self, snapshot: RegistrySnapshot) -> Site:
        """Load the site in force, with the operator's settings of modules.

        Raises:
            UserError: the stored policy cannot be read.
        """
        return self._site_of(snapshot).with_configurations(snapshot.configurations)

    def _site_of(self, snapshot: RegistrySnapshot) -> Site:
        """Load the site in force.

        Raises:
            UserError: the stored policy cannot be read.
        """
        diagnostics = Diagnostics()
        site = load_site(self.site_file(snapshot), diagnostics)
        diagnostics.raise_if_errors()
        if site is None:
            raise refusal("AE965", f"the policy `{snapshot.site}` cannot be read")
        return site

    def _declared(self, folder: Path) -> declared_ecm.Ecm:
        """Read the manifest of an installed module."""
        declared = decode_manifest(folder)
        if declared is None:
            raise refusal("AE965", f"the manifest in `{folder}` cannot be read")
        return declared

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
        """Prove the configuration of `new`, whose files are stored.

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
        configuration, report = self._prove(
            [folder for name, folder in folders.items() if name not in unconfigured],
            self.site_file(new),
            certified=False,
            settings=settings,
            active=active.__contains__,
            active_folders=[folders[name] for name in active],
        )
        require_dependencies(configuration)
        return configuration, report

    def _folders(self, snapshot: RegistrySnapshot) -> dict[str, Path]:
        """Return the folder of each stored module; none is reached through a link."""
        folders = {name: self.folder / one.folder for name, one in snapshot.modules.items()}
        top = self.folder.resolve()
        for name, folder in folders.items():
            if folder.resolve() != top / snapshot.modules[name].folder:
                raise refusal("AE965", f"the files of `{name}` are not in `{folder}`, but outside of it")
        return folders

    def site_file(self, snapshot: RegistrySnapshot) -> Path:
        """Return the file of the policy in force; its name is the digest of its content.

        Args:
            snapshot: content of the registry.

        Returns:
            The file.

        Raises:
            UserError: it cannot be read, or was changed.
        """
        if not snapshot.site:
            return reference_site_path()
        path = self.folder / snapshot.site
        try:
            content = path.read_bytes()
        except OSError as failure:
            raise refusal("AE965", f"the policy `{path}` cannot be read: {failure.strerror}") from failure
        if snapshot.site != policy_file(content):
            raise refusal("AE965", f"the policy `{path}` differs from the one that was put in force")
        return path


def _requested_devices(folder: Path) -> frozenset[str] | None:
    declared = decode_manifest(folder)
    return None if declared is None else frozenset(one.value for one in declared.permissions.compute)


def policy_file(content: bytes) -> str:
    """Return the name under which a registry stores a policy.

    Args:
        content: content of the site file.

    Returns:
        The path, relative to the registry's folder.
    """
    return f"policies/{file_digest(content)}.yaml"


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
