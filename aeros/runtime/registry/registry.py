"""Registry of one robot: installed modules, and the changes an operator can make to them.

Every change is proved before it is made. The new set of modules is verified as a whole, under the policy and
the operator's overrides; a refused change has no effect. Then the stored record is replaced in one
transaction, and the change returns once no action of the old configuration is active. So after `deactivate`,
`remove` or `block` has returned, no further action of that skill is executed.

Executors are notified before the record is replaced, and begin no action until it is. So there is no instant
at which a change is stored and an executor does not know of it, whichever process is killed.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

from aeros.files import replace_durably
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.proving import ProveConfiguration, prove_configuration
from aeros.runtime.registry.bundle_store import bundle_digest, module_files, remove_unreferenced, store_bundle
from aeros.runtime.registry.change_log import record_change, recorded_configurations
from aeros.runtime.registry.control_page import ControlPage, MotionTimeoutError
from aeros.runtime.registry.lifecycle import LifecycleAction, ModuleState, allowed_states, next_state
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot, RegistryStore
from aeros.spec.diagnostics.codes import Diagnostic, Diagnostics, did_you_mean
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.load import load_ecm, load_site
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.site import Site
from aeros.spec.text.digests import file_digest
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.reports import Report

_FOLDER: Final = "registry"
_LOCK: Final = "change.lock"
_WAIT_TIMEOUT_S: Final = 30.0  # s that a change waits for motions of the old configuration to end


class Registry:
    """Registry in the state folder of one robot.

    Args:
        state: the robot's state folder.
        prove: proves the modules at each change, as `proving.prove_configuration` does.
    """

    def __init__(self, state: Path, prove: ProveConfiguration = prove_configuration) -> None:
        self._prove = prove
        self.folder = state / _FOLDER
        self._key = state / "audit.key"
        self._records = RegistryStore(self.folder)

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
            name: tuple(sorted(_load_module(site, folder).capabilities))
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
        return {name: _load_module(site, folders[name]) for name in idle}

    def committed_snapshot(self, live: ControlPage) -> RegistrySnapshot | None:
        """Read the registry unless a change is in progress.

        If the process that made a change died before storing it, its announcement is withdrawn.

        Args:
            live: control page of this registry.

        Returns:
            The content; None while executors know of a change that is not stored.

        Raises:
            UserError: it cannot be read.
        """
        snapshot = self.snapshot()
        if snapshot.generation == live.generation:
            return snapshot
        with suppress(BlockingIOError), _locked(self.folder / _LOCK, fcntl.LOCK_NB):
            live.publish(self.snapshot().generation)
        return None

    # Changes of an operator.

    def install(self, source: Path, pinned: str | None = None) -> InstalledModule:
        """Install a module; if another version is installed, replace it and keep its state.

        Args:
            source: the module's folder.
            pinned: digest that its files must have; None to accept any.

        Returns:
            The installed module.

        Raises:
            UserError: the module cannot be read, proved or recorded, differs from `pinned`, or is installed
                with the same version and other contents.
        """
        with self._change_lock() as old:
            files = module_files(source)
            digest = bundle_digest(files)
            if pinned is not None and pinned.removeprefix("sha256:") != digest:
                name, found = source.name, f"sha256:{digest}"
                raise _refusal("AE963", f"`{name}` does not have the pinned digest: its digest is {found}")
            site = self._policy_of(old)
            ecm = _load_module(site, source)
            kept = old.modules.get(ecm.id)
            if kept is not None and kept.version == ecm.version and kept.digest != digest:
                raise _refusal(
                    "AE962",
                    f"`{ecm.id}` {ecm.version} is already installed with other contents",
                    "raise the version of the changed module",
                )
            state = self._next_state(old, ecm.id, LifecycleAction.INSTALL)
            one = InstalledModule.from_digest(ecm.id, ecm.version, digest, state)
            new = _with_module(old, one)
            configuration, _ = self._prove_snapshot(new, {ecm.id: source})
            folder = store_bundle(files, self.folder / "modules", ecm.id)
            if _digests(_load_module(site, folder)) != _digests(ecm):
                raise _refusal("AE961", f"`{source}` changed while it was being proved")
            self._commit(old, new, f"install {ecm.id} {ecm.version} sha256:{digest}", configuration)
            return one

    def configure(self, name: str) -> InstalledModule:
        """Configure a module: check that each of its dependencies is installed.

        Args:
            name: id of the module.

        Returns:
            The module in its new state.

        Raises:
            UserError: unknown module, wrong state, or the change cannot be proved or recorded.
        """
        return self._change_state(name, LifecycleAction.CONFIGURE)

    def activate(self, name: str) -> InstalledModule:
        """Activate a module, so that its skills can be run. Its dependencies must be active.

        Args:
            name: id of the module.

        Returns:
            The module in its new state.

        Raises:
            UserError: unknown module, wrong state, or the change cannot be proved or recorded.
        """
        return self._change_state(name, LifecycleAction.ACTIVATE)

    def deactivate(self, name: str) -> InstalledModule:
        """Deactivate a module. When this returns, none of its skills acts any more.

        Args:
            name: id of the module.

        Returns:
            The module in its new state.

        Raises:
            UserError: unknown module, wrong state, or the change cannot be proved or recorded.
        """
        return self._change_state(name, LifecycleAction.DEACTIVATE)

    def remove(self, name: str) -> InstalledModule:
        """Remove a module that is not active.

        Args:
            name: id of the module.

        Returns:
            The module, with state ABSENT.

        Raises:
            UserError: unknown module, wrong state, or the change cannot be proved or recorded.
        """
        return self._change_state(name, LifecycleAction.REMOVE)

    def add_override(self, block: OperatorOverride) -> None:
        """Add an operator override. When this returns, nothing that it blocks acts any more.

        Args:
            block: the override, with an id that is not in use.

        Raises:
            UserError: the id is in use, the action kind is unknown, or the change cannot be proved or
                recorded.
        """
        with self._change_lock() as old:
            if block.id in old.blocks:
                raise _refusal("AE960", f"there is a block `{block.id}` already", "choose another name")
            kinds = self._policy_of(old).kinds
            if block.action is not None and block.action not in kinds:
                raise _unknown_name_error("action kind", block.action, kinds)
            # Sorted, as they are read back, so that the digest is that of the configuration in force.
            blocks = dict(sorted({**old.blocks, block.id: block}.items()))
            self._change(old, replace(old, blocks=blocks), f"block {block.id}")

    def remove_override(self, block: str) -> None:
        """Remove an operator override.

        Args:
            block: id of the override.

        Raises:
            UserError: there is no such override, or the change cannot be proved or recorded.
        """
        with self._change_lock() as old:
            if block not in old.blocks:
                raise _unknown_name_error("block", block, old.blocks)
            left = {name: one for name, one in old.blocks.items() if name != block}
            self._change(old, replace(old, blocks=left), f"unblock {block}")

    def set_policy(self, site: Path) -> Report:
        """Put a site file in force for all installed modules.

        Args:
            site: the site file.

        Returns:
            Report of the proof under the new policy.

        Raises:
            UserError: the file cannot be read, or the change cannot be proved or recorded.
        """
        with self._change_lock() as old:
            content = _read_bytes(site)
            new = replace(old, site=f"policies/{file_digest(content)}.yaml")
            configuration, report = self._prove_snapshot(new, {}, site)
            self._store_policy(new, content)
            description = f"policy {site.name} sha256:{file_digest(content)}"
            self._commit(old, new, description, configuration)
            return report

    def _change_state(self, name: str, verb: LifecycleAction) -> InstalledModule:
        with self._change_lock() as old:
            if name not in old.modules:
                raise _unknown_name_error("module", name, old.modules)
            state = self._next_state(old, name, verb)
            one = replace(old.modules[name], state=state)
            self._change(old, _with_module(old, one), f"{verb.value} {name}")
            return one

    def _next_state(self, old: RegistrySnapshot, name: str, verb: LifecycleAction) -> ModuleState:
        state = old.modules[name].state if name in old.modules else ModuleState.ABSENT
        reached = next_state(state, verb)
        if reached is None:
            possible = " or ".join(one.value for one in allowed_states(verb))
            cure = f"`aeros {verb.value}` is for a module that is {possible}"
            raise _refusal("AE960", f"`{name}` is {state.value}", cure)
        return reached

    def _change(self, old: RegistrySnapshot, new: RegistrySnapshot, description: str) -> None:
        configuration, _ = self._prove_snapshot(new, {})
        self._commit(old, new, description, configuration)

    def _policy_of(self, snapshot: RegistrySnapshot) -> Site:
        """Load the site in force."""
        diagnostics = Diagnostics()
        site = load_site(self._site(snapshot), diagnostics)
        diagnostics.raise_if_errors()
        if site is None:
            raise _refusal("AE965", f"the policy `{snapshot.site}` cannot be read")
        return site

    def _prove_snapshot(
        self, new: RegistrySnapshot, sources: Mapping[str, Path], site: Path | None = None
    ) -> tuple[Configuration, Report]:
        """Prove the configuration of `new`; `sources` has the folders of modules that are not stored yet."""
        folders = {**self._folders(new), **sources}
        policy = self._site(new) if site is None else site
        blocks = tuple(new.blocks.values())
        for one in new.modules.values():
            if one.name not in sources and bundle_digest(module_files(folders[one.name])) != one.digest:
                raise _refusal("AE965", f"the stored files of `{one.name}` differ from the installed ones")
        active = {name for name, one in new.modules.items() if one.state is ModuleState.ACTIVE}
        configuration, report = self._prove(
            folders.values(), policy, certified=False, blocks=blocks, active=active.__contains__
        )
        for name, ecm in configuration.modules.items():
            for needed in ecm.required_modules:
                if needed not in active:
                    raise _refusal(
                        "AE964",
                        f"`{name}` needs `{needed}`, which is not active",
                        f"`aeros activate {needed}` first",
                    )
        return configuration, report

    def _folders(self, snapshot: RegistrySnapshot) -> dict[str, Path]:
        return {name: self.folder / one.folder for name, one in snapshot.modules.items()}

    def _site(self, snapshot: RegistrySnapshot) -> Path:
        return self.folder / snapshot.site if snapshot.site else reference_site_path()

    def _commit(
        self, old: RegistrySnapshot, new: RegistrySnapshot, description: str, configuration: Configuration
    ) -> None:
        if not new.site:
            content = reference_site_path().read_bytes()
            new = replace(new, site=f"policies/{file_digest(content)}.yaml")
            self._store_policy(new, content)
        new = replace(new, generation=old.generation + 1)
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        record_change(self.folder, self._key, old, new, description, configuration.digest)
        with ControlPage(self.folder) as live:
            # If the last change was killed, or gave up waiting, an action older than `old` may still be
            # active.  Its lock is also that of the new generation.
            is_older_still = live.is_idle(new.generation)
            live.publish(new.generation)
            try:
                self._records.replace(new)
            except BaseException:
                live.publish(self.snapshot().generation)
                raise
            try:
                live.wait_until_idle(old.generation, _WAIT_TIMEOUT_S)
                if not is_older_still:
                    live.wait_until_idle(new.generation, _WAIT_TIMEOUT_S)
            except MotionTimeoutError as late:
                raise _refusal(
                    "AE966",
                    f"the change is made, but an action of the old configuration still moves {late}",
                    "stop the robot",
                ) from late
        # Modules of past configurations stay, so that decisions under them can be replayed.
        kept = [
            one
            for snapshot in recorded_configurations(self.folder).values()
            for one in snapshot.modules.values()
        ]
        remove_unreferenced(self.folder / "modules", {self.folder / one.folder for one in kept})

    def _store_policy(self, new: RegistrySnapshot, content: bytes) -> None:
        path = self.folder / new.site
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        replace_durably(path, content)

    @contextmanager
    def _change_lock(self) -> Iterator[RegistrySnapshot]:
        """Serialize changes; if a first change is refused, remove the folder that it created."""
        was_there = self.folder.exists()
        with _locked(self.folder / _LOCK):
            try:
                yield self.snapshot()
            except BaseException:
                if not was_there:
                    (self.folder / _LOCK).unlink(missing_ok=True)
                    _remove_if_empty(self.folder)
                raise


@contextmanager
def _locked(path: Path, how: int = 0) -> Iterator[None]:
    """Hold the lock file at `path`; its folder is created if needed.

    A refused first change deletes the file. A lock on a deleted file protects nothing, so it is taken again.
    """
    while (lock := _locked_file(path, how)) is None:
        pass
    try:
        yield
    finally:
        os.close(lock)


def _locked_file(path: Path, how: int) -> int | None:
    """Open and lock the file at `path`; return None if it was deleted before it was locked."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    try:
        lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except FileNotFoundError:
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | how)
        if _is_same_file(path, lock):
            return lock
    except BaseException:
        os.close(lock)
        raise
    os.close(lock)
    return None


def _is_same_file(path: Path, descriptor: int) -> bool:
    """Return True if the open file is the file at `path`."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _with_module(old: RegistrySnapshot, module: InstalledModule) -> RegistrySnapshot:
    """Return `old` with the module in its new state, or without it if it is absent now."""
    modules = {name: kept for name, kept in old.modules.items() if name != module.name}
    if module.state is not ModuleState.ABSENT:
        modules[module.name] = module
    return replace(old, modules=dict(sorted(modules.items())))


def _load_module(site: Site, folder: Path) -> Ecm:
    """Load the module in `folder` under the policy `site`, without proving it."""
    diagnostics = Diagnostics()
    loaded = load_ecm(folder, site, diagnostics)
    diagnostics.raise_if_errors()
    if loaded is None:
        raise _refusal("AE961", f"`{folder}` holds no module")
    return loaded.ecm


def _digests(ecm: Ecm) -> tuple[str, str]:
    return ecm.manifest_digest, ecm.code_digest


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as failure:
        raise _refusal("AE961", f"`{path}` cannot be read: {failure.strerror}") from failure


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()
        folder.parent.rmdir()


def _refusal(code: str, headline: str, *cures: str) -> UserError:
    return UserError([Diagnostic(code, headline, help=cures)])


def _unknown_name_error(what: str, name: str, known: Iterable[str]) -> UserError:
    near = did_you_mean(name, known)
    names = ", ".join(f"`{one}`" for one in known)
    cure = f"did you mean `{near}`?" if near else f"there is {names}" if names else "there is none"
    return _refusal("AE960", f"there is no {what} `{name}` here", cure)
