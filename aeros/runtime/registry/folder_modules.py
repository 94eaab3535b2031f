"""Modules of folders, for a run on a robot whose operator has the same word as over installed modules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import ProveConfiguration, prove_configuration
from aeros.runtime.registry.bundle_store import bundle_digest, module_files
from aeros.runtime.registry.installed import InstalledModules, require_dependencies
from aeros.runtime.registry.operator_block import UNKNOWN_DIGEST, ModuleIdentity
from aeros.runtime.registry.run_modules import (
    LoadedModules,
    blocks_in_force,
    policy_in_force,
    withdrawal_reason,
)
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.runtime.registry.stored_modules import policy_file, read_policy, refusal
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.diagnostics.errors import InternalError, UserError
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.elaborate.required_folders import with_required_folders
from aeros.spec.model.configured import ModuleConfiguration
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.operator_settings import OperatorSettings
from aeros.spec.model.site import Site
from aeros.spec.text.digests import code_digest, text_digest
from aeros.spec.text.discovery import (
    MANIFEST,
    Surroundings,
    all_module_folders,
    module_folders,
    reference_modules_path,
)
from aeros.spec.verification.modules_with_settings import absent_module_problems
from aeros.spec.verification.reports import Report

_OWN_MODULES: Final = Path("ecms")


def default_modules() -> tuple[Path, ...]:
    """Find the modules of a run that names none, on a robot on which none was ever installed.

    Returns:
        The folder `ecms`, or else the folder of the modules that come with AEROS.
    """
    reference = reference_modules_path()
    return (_OWN_MODULES if _OWN_MODULES.is_dir() or not reference.is_dir() else reference,)


class FolderModules:
    """Modules of folders, and those that they require and that lie next to them; implements `RunModules`.

    At first each module needs the certificate that its proof results in.  Afterwards they are proved again
    under each change of policy and blocks, and their manifests and code must stay as they were.

    Args:
        folders: folders, each of a module or of modules.
        site: site file of the run; None for the policy in force on the robot, or else the reference site.
        installed: the robot's own modules and policy.
        needs_certificates: each module must have a current certificate when it is first loaded.
        prove: proves a set of modules, as `proving.prove_configuration` does.
        configurations: settings of the modules, by module.
    """

    def __init__(
        self,
        folders: Sequence[Path],
        site: Path | None,
        installed: InstalledModules,
        *,
        needs_certificates: bool = True,
        prove: ProveConfiguration = prove_configuration,
        configurations: Mapping[str, ModuleConfiguration] = MappingProxyType({}),
    ) -> None:
        self._configurations = configurations
        self._given = tuple(folders)
        self._site = site
        self._installed = installed
        self._prove = prove
        self._needs_certificates = needs_certificates
        self._contents: dict[str, tuple[str, str]] | None = None

    def load(self, snapshot: RegistrySnapshot) -> LoadedModules:
        """Implement `RunModules.load`."""
        site, policy = self._site_file(snapshot)
        configuration, report = self._prove_unblocked(site)
        require_dependencies(configuration)
        unblocked = configuration.site
        if f"policies/{unblocked.digest}.yaml" != policy:
            raise refusal("AE961", f"`{site}` changed while it was being read")
        self._require_same_contents(configuration)
        identities = _identities(configuration, report)
        withheld = _withheld(snapshot, identities)
        blocks = blocks_in_force(snapshot, identities, unblocked.kinds)
        if blocks or withheld:
            configuration, report = self._prove(
                self._folders(),
                site,
                certified=False,
                settings=OperatorSettings(blocks, self._configurations),
                active=lambda name: name not in withheld,
            )
            if configuration.site.digest != unblocked.with_overrides(blocks).digest:
                raise refusal("AE961", f"`{site}` changed while it was being read")
            self._require_same_contents(configuration)
            require_dependencies(configuration)
        return LoadedModules(
            snapshot, policy, identities, configuration, report, withheld, is_installed=False
        )

    def load_unproved(self, snapshot: RegistrySnapshot) -> tuple[Site, Mapping[str, Ecm], Mapping[str, str]]:
        """Load the modules without proving them, for uses that move nothing.

        Args:
            snapshot: content of the registry.

        Returns:
            The site with the blocks in force; the modules that may be used, by name; and the reason of each
            module that the operator does not let a run use, by name.

        Raises:
            UserError: a file is rejected, or the policy in force is another than the given site.
            InternalError: a fault of AEROS: the site was refused without a diagnostic.
        """
        diagnostics = Diagnostics()
        site = load_site(self._site_file(snapshot)[0], diagnostics)
        folders = [] if site is None else self._found_folders(diagnostics)
        if site is not None:
            site = site.with_configurations(self._configurations)
        around = Surroundings(named=tuple(folders))
        loaded = [load_ecm(one, site, diagnostics, around) for one in folders if site is not None]
        for problem in absent_module_problems(self._configurations, folders):
            diagnostics.report(problem)
        diagnostics.raise_if_errors()
        if site is None:
            raise InternalError("a site that was not read was not reported")
        found = [one.ecm for one in loaded if one is not None]
        paths = dict(zip((one.id for one in found), folders, strict=True))
        identities = {ecm.id: _identity(ecm, paths[ecm.id]) for ecm in found}
        withheld = _withheld(snapshot, identities)
        modules = {ecm.id: ecm for ecm in found if ecm.id not in withheld}
        site = site.with_overrides(blocks_in_force(snapshot, identities, site.kinds))
        return site.with_modules(modules.values()), modules, withheld

    def _folders(self) -> list[Path]:
        """Return the folders to prove; with those given that hold no module, so that the proof says so."""
        empty = [one for one in self._given if not module_folders(one, Diagnostics())]
        return [*self._found_folders(Diagnostics()), *empty]

    def _found_folders(self, diagnostics: Diagnostics) -> list[Path]:
        """Return the folders of the modules; report each given folder that holds none."""
        return with_required_folders(all_module_folders(self._given, diagnostics))

    def _prove_unblocked(self, site: Path) -> tuple[Configuration, Report]:
        """Prove all modules without blocks, as their certificates are written.

        Raises:
            UserError: a module is refused, or its certificate is not current.
        """
        certified = self._needs_certificates and self._contents is None
        settings = OperatorSettings(configurations=self._configurations)
        return self._prove(self._folders(), site, certified=certified, settings=settings)

    def _site_file(self, snapshot: RegistrySnapshot) -> tuple[Path, str]:
        """Return the site file of the run, and its name as a policy of the registry."""
        if self._site is None:
            path = self._installed.site_file(snapshot)
            return path, snapshot.site or policy_file(path.read_bytes())
        policy = policy_file(read_policy(self._site))
        if policy_in_force(snapshot, policy) != policy:
            raise refusal(
                "AE960",
                f"`{self._site}` is not the policy that is in force on this robot",
                f"`aeros policy {self._site}` puts it in force",
                "without --site, the policy in force governs the run",
            )
        return self._site, policy

    def _require_same_contents(self, configuration: Configuration) -> None:
        contents = {name: _digests(ecm) for name, ecm in configuration.modules.items()}
        known = contents if self._contents is None else self._contents
        if any(known.get(name) != digests for name, digests in contents.items()):
            folders = " and ".join(f"`{one}`" for one in self._given)
            raise refusal(
                "AE961", f"the modules in {folders} changed since the run began", "start the run again"
            )
        self._contents = known


def uses_installed_modules(registry: InstalledModules) -> bool:
    """Say if a run for which no modules are named uses the installed ones.

    Args:
        registry: the robot's registry.

    Returns:
        True if a module was ever installed, or there is a registry and no folder `ecms`.

    Raises:
        UserError: the registry cannot be read.
    """
    if not registry.exists:
        return False
    snapshot = registry.snapshot()
    return bool(snapshot.modules or snapshot.withdrawn) or not _OWN_MODULES.is_dir()


def _withheld(snapshot: RegistrySnapshot, identities: Mapping[str, ModuleIdentity]) -> dict[str, str]:
    """Return the reason of each module that the operator does not let a run use, by name."""
    return {
        name: reason
        for name, identity in identities.items()
        if (reason := withdrawal_reason(snapshot, name, identity, is_installed=False)) is not None
    }


def _digests(ecm: Ecm) -> tuple[str, str]:
    return ecm.manifest_digest, ecm.code_digest


def _identities(configuration: Configuration, report: Report) -> dict[str, ModuleIdentity]:
    folders = {module.name: module.path for module in report.modules}
    return {name: _identity(ecm, folders[name]) for name, ecm in configuration.modules.items()}


def _identity(ecm: Ecm, folder: Path) -> ModuleIdentity:
    return ModuleIdentity(ecm.version, _bundle_digest(folder, ecm), ecm.requested_access.compute)


def _bundle_digest(folder: Path, ecm: Ecm) -> str:
    """Return the digest over all files of a module; UNKNOWN_DIGEST unless they are those that were loaded."""
    try:
        files = module_files(folder)
        manifest = text_digest(files[MANIFEST].decode())
    except (UserError, KeyError, UnicodeDecodeError):
        return UNKNOWN_DIGEST
    code = code_digest({name: content for name, content in files.items() if name.endswith(".py")})
    return bundle_digest(files) if (manifest, code) == _digests(ecm) else UNKNOWN_DIGEST
