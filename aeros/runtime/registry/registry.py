"""The registry of one robot: what is installed, and how that may change.

Every change is proved before it is made.  The new set of modules is verified whole, under the
policy and the operator's blocks; what is refused has changed nothing.  Then the record is replaced
in one transaction, and the change returns when no action of the old configuration moves any more.
So after `deactivate`, `remove` or `block` has returned, no further action of that skill is executed.

Executors are told before the record is replaced, and begin nothing until it is: so there is no
instant at which a change is kept and an executor does not know of it, whoever is killed.
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
from aeros.spec.model.model import Ecm, OperatorOverride, Site
from aeros.spec.text.digests import file_digest
from aeros.spec.text.discovery import reference_site_path
from aeros.spec.verification.reports import Report

_FOLDER: Final = "registry"
_LOCK: Final = "change.lock"
_WAIT_TIMEOUT_S: Final = 30.0  # s that a change waits for motions of the old configuration to end


class Registry:
    """The registry in the state folder `state` of one robot.

    prove: proves its modules at each change, as `proving.prove` does.
    """

    def __init__(self, state: Path, prove: ProveConfiguration = prove_configuration) -> None:
        self._prove = prove
        self.folder = state / _FOLDER
        self._key = state / "audit.key"
        self._records = RegistryStore(self.folder)

    @property
    def exists(self) -> bool:
        """Whether anything was ever kept in it."""
        return self._records.path.exists()

    def snapshot(self) -> RegistrySnapshot:
        """What it says now.  Raises `UserError`."""
        return self._records.read()

    def configuration(self, snapshot: RegistrySnapshot | None = None) -> tuple[Configuration, Report]:
        """The configuration of the active modules, as `proving.prove` makes it.  Raises `UserError`."""
        return self._prove_snapshot(self.snapshot() if snapshot is None else snapshot, {})

    def capabilities(self, snapshot: RegistrySnapshot) -> dict[str, tuple[str, ...]]:
        """By module, what its skills provide.  Raises `UserError`."""
        site = self._policy_of(snapshot)
        return {
            name: tuple(sorted(_load_module(site, folder).capabilities))
            for name, folder in self._folders(snapshot).items()
        }

    def inactive_modules(self) -> dict[str, Ecm]:
        """The modules that are kept and not active, by name.  Raises `UserError`."""
        snapshot = self.snapshot()
        site, folders = self._policy_of(snapshot), self._folders(snapshot)
        idle = [name for name, one in snapshot.modules.items() if one.state is not ModuleState.ACTIVE]
        return {name: _load_module(site, folders[name]) for name in idle}

    def committed_snapshot(self, live: ControlPage) -> RegistrySnapshot | None:
        """What is kept, or None while executors were told of a change that is not kept.

        Where whoever made that change is no more, they are told otherwise.  Raises `UserError`.
        """
        snapshot = self.snapshot()
        if snapshot.generation == live.generation:
            return snapshot
        with suppress(BlockingIOError), _locked(self.folder / _LOCK, fcntl.LOCK_NB):
            live.publish(self.snapshot().generation)
        return None

    # Changes.

    def install(self, source: Path, pinned: str | None = None) -> InstalledModule:
        """Keep the module in the folder `source`; over another version of it, keep its state.

        pinned: the digest that its files must have.
        """
        with self._change_lock() as old:
            files = module_files(source)
            digest = bundle_digest(files)
            if pinned is not None and pinned.removeprefix("sha256:") != digest:
                name, found = source.name, f"sha256:{digest}"
                raise _refusal("AE963", f"`{name}` is not what was pinned: its digest is {found}")
            site = self._policy_of(old)
            ecm = _load_module(site, source)
            kept = old.modules.get(ecm.id)
            if kept is not None and kept.version == ecm.version and kept.digest != digest:
                raise _refusal(
                    "AE962",
                    f"`{ecm.id}` {ecm.version} is installed with other contents",
                    "give what has changed a version of its own",
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
        """Settle what a module needs around it: each of its dependencies is installed."""
        return self._change_state(name, LifecycleAction.CONFIGURE)

    def activate(self, name: str) -> InstalledModule:
        """Let the skills of a module be dispatched; those that it depends on are active already."""
        return self._change_state(name, LifecycleAction.ACTIVATE)

    def deactivate(self, name: str) -> InstalledModule:
        """Withdraw the skills of a module: when this returns, none of them acts any more."""
        return self._change_state(name, LifecycleAction.DEACTIVATE)

    def remove(self, name: str) -> InstalledModule:
        """Forget a module that is not active."""
        return self._change_state(name, LifecycleAction.REMOVE)

    def add_override(self, block: OperatorOverride) -> None:
        """Lay down an operator override: when this returns, nothing that it matches acts any more."""
        with self._change_lock() as old:
            if block.id in old.blocks:
                raise _refusal("AE960", f"there is a block `{block.id}` already", "name it otherwise")
            kinds = self._policy_of(old).kinds
            if block.action is not None and block.action not in kinds:
                raise _unknown_name_error("action kind", block.action, kinds)
            # In the order in which they are read back, so that the digest is that of what will be in force.
            blocks = dict(sorted({**old.blocks, block.id: block}.items()))
            self._change(old, replace(old, blocks=blocks), f"block {block.id}")

    def remove_override(self, block: str) -> None:
        """Take an operator override back."""
        with self._change_lock() as old:
            if block not in old.blocks:
                raise _unknown_name_error("block", block, old.blocks)
            left = {name: one for name, one in old.blocks.items() if name != block}
            self._change(old, replace(old, blocks=left), f"unblock {block}")

    def set_policy(self, site: Path) -> Report:
        """Put the site file `site` in force, for everything that is installed."""
        with self._change_lock() as old:
            content = _read_bytes(site)
            new = replace(old, site=f"policies/{file_digest(content)}.yaml")
            configuration, report = self._prove_snapshot(new, {}, site)
            self._store_policy(new, content)
            said = f"policy {site.name} sha256:{file_digest(content)}"
            self._commit(old, new, said, configuration)
            return report

    # Inside.

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

    def _change(self, old: RegistrySnapshot, new: RegistrySnapshot, said: str) -> None:
        configuration, _ = self._prove_snapshot(new, {})
        self._commit(old, new, said, configuration)

    def _policy_of(self, snapshot: RegistrySnapshot) -> Site:
        """The site that is in force, as its file says."""
        sink = Diagnostics()
        site = load_site(self._site(snapshot), sink)
        sink.raise_if_errors()
        if site is None:
            raise _refusal("AE965", f"the policy `{snapshot.site}` cannot be read")
        return site

    def _prove_snapshot(
        self, new: RegistrySnapshot, sources: Mapping[str, Path], site: Path | None = None
    ) -> tuple[Configuration, Report]:
        """The configuration that `new` stands for; `sources` says where modules are that are not kept yet."""
        folders = {**self._folders(new), **sources}
        policy = self._site(new) if site is None else site
        blocks = tuple(new.blocks.values())
        for one in new.modules.values():
            if one.name not in sources and bundle_digest(module_files(folders[one.name])) != one.digest:
                raise _refusal("AE965", f"the kept files of `{one.name}` are not what was installed")
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
        self, old: RegistrySnapshot, new: RegistrySnapshot, said: str, configuration: Configuration
    ) -> None:
        if not new.site:
            content = reference_site_path().read_bytes()
            new = replace(new, site=f"policies/{file_digest(content)}.yaml")
            self._store_policy(new, content)
        new = replace(new, generation=old.generation + 1)
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        record_change(self.folder, self._key, old, new, said, configuration.digest)
        with ControlPage(self.folder) as live:
            # Where the last change was killed, or gave up waiting, an action may move that is older than
            # `old`.  Its lock is also that of the new generation.
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
        # What was in force once stays, so that what was decided under it can be decided again.
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
        """One change at a time; what stood in the folder before stays if it is refused."""
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
    """Hold the lock that the file at `path` is, in a folder that is made for it.

    Whoever made the file and was refused has removed it: a lock on what is no longer there is none.
    """
    while (lock := _locked_file(path, how)) is None:
        pass
    try:
        yield
    finally:
        os.close(lock)


def _locked_file(path: Path, how: int) -> int | None:
    """The file at `path`, locked; None where that was removed before it could be."""
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
    """Whether the open file is the one that is found there."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _with_module(old: RegistrySnapshot, module: InstalledModule) -> RegistrySnapshot:
    """`old` with the module as it is now; without it where it is absent."""
    modules = {name: kept for name, kept in old.modules.items() if name != module.name}
    if module.state is not ModuleState.ABSENT:
        modules[module.name] = module
    return replace(old, modules=dict(sorted(modules.items())))


def _load_module(site: Site, folder: Path) -> Ecm:
    """The module in `folder`, read under the policy `site` and not proved."""
    sink = Diagnostics()
    found = load_ecm(folder, site, sink)
    sink.raise_if_errors()
    if found is None:
        raise _refusal("AE961", f"`{folder}` holds no module")
    return found.ecm


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
