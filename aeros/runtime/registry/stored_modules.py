"""Content of a robot's registry as it is stored: modules, policy and blocks, read and not proved."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from aeros.files import open_regular
from aeros.runtime.registry.change_log import LOG, anchor_of
from aeros.runtime.registry.operator_block import ModuleIdentity
from aeros.runtime.registry.run_modules import blocks_in_force
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.runtime.registry.transaction import RegistryTransactions
from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import decode_manifest, load_site
from aeros.spec.elaborate.module.needs import module_settings
from aeros.spec.elaborate.module.settings import Setting
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.site import Site
from aeros.spec.text.digests import file_digest
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.text.files import MAX_BYTES
from aeros.spec.text.site_layers import site_content

_FOLDER: Final = "registry"


class StoredModules:
    """Installed modules of one robot, as they are stored.

    Args:
        state: the robot's state folder.
    """

    def __init__(self, state: Path) -> None:
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

    # Parts.

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

    def _folders(self, snapshot: RegistrySnapshot) -> dict[str, Path]:
        """Return the folder of each stored module; none is reached through a link."""
        folders = {name: self.folder / one.folder for name, one in snapshot.modules.items()}
        for name, folder in folders.items():
            if _leads_elsewhere(self.folder, snapshot.modules[name].folder):
                raise refusal("AE965", f"the files of `{name}` are not in `{folder}`, but outside of it")
        return folders


def _leads_elsewhere(folder: Path, below: str) -> bool:
    """Say if a path below a folder goes through a link or upwards; `Path.resolve` takes ten times as long."""
    path = str(folder)
    for part in below.split("/"):
        path = f"{path}/{part}"
        if part in ("", ".", "..") or os.path.islink(path):
            return True
    return False


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


def read_policy(site: Path) -> bytes:
    """Read a site file as a registry stores it.

    Args:
        site: the file.

    Returns:
        Its content, with everything that it is based on if it is an overlay; of a file that is too large,
        one byte more than any site may have.

    Raises:
        UserError: it cannot be read, or is not a regular file.
    """
    try:
        with open_regular(site) as file:
            return site_content(site, file.read(MAX_BYTES + 1))
    except OSError as failure:
        raise refusal("AE961", f"`{site}` cannot be read: {failure.strerror}") from failure


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
