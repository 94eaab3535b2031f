"""Registry of one robot: installed modules, and the changes an operator can make to them.

Every change is proved before it is made. The new set of modules is verified as a whole, under the policy and
the operator's overrides; a refused change has no effect. Then the stored record is replaced in one
transaction (`transaction`), and the change returns once no action of the old configuration is active. So
after `deactivate`, `remove` or `block` has returned, no further action of that skill is executed.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from aeros.runtime.registry.bundle_store import bundle_digest, module_files, stored_bundle
from aeros.runtime.registry.control_page import ControlPage
from aeros.runtime.registry.installed import InstalledModules, load_module
from aeros.runtime.registry.lifecycle import (
    LifecycleAction,
    ModuleState,
    allowed_states,
    next_state,
    preceding_action,
)
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.requirements import require_installed
from aeros.runtime.registry.shown_paths import shown_as
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.runtime.registry.stored_modules import policy_file, read_policy, refusal
from aeros.runtime.registry.waiting_modules import WaitingModule, needs_one_of, reset_waiting
from aeros.spec.declared import ecm as declared_ecm
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean, quoted
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.diagnostics.source import Source
from aeros.spec.elaborate.load import decode_manifest, decode_manifest_text, load_ecm
from aeros.spec.elaborate.module.needs import module_settings
from aeros.spec.elaborate.module.settings import configure_command
from aeros.spec.model.configured import UNCONFIGURED, ModuleConfiguration
from aeros.spec.model.site import Site
from aeros.spec.text.digests import file_digest
from aeros.spec.text.discovery import MANIFEST
from aeros.spec.text.files import decode_source
from aeros.spec.text.versions import parse_version
from aeros.spec.verification.reports import Report

_CURES_OF_NONE: Final = {
    "block": "nothing is blocked",
    "module": "no module is installed; `aeros activate --install FOLDER` installs one",
}
"""Cure for a name of a kind of which nothing is there, by that kind."""


class Registry(InstalledModules):
    """Registry in the state folder of one robot: its installed modules, to read and to change.

    Args:
        state: the robot's state folder.
    """

    def committed_snapshot(self, live: ControlPage) -> RegistrySnapshot | None:
        """Read the registry unless a change is in progress.

        If the process that made a change died before storing it, it is stored now if it is recorded.

        Args:
            live: control page of this registry.

        Returns:
            The content, not yet compared with the record; None while executors know of a change that is not
            stored.

        Raises:
            UserError: it cannot be read, or database and record of changes disagree.
        """
        return self._transactions.committed_snapshot(live)

    def install(
        self,
        source: Path,
        pinned: str | None = None,
        *,
        allows_downgrade: bool = False,
        active: ModuleConfiguration | None = None,
    ) -> InstalledModule:
        """Install a module; if another version is installed, replace it and keep its state.

        A version with an open need or parameter waits to be configured; it cannot replace an active one.
        The source is read once. What was read is stored, and the stored files are proved.

        Args:
            source: the module's folder.
            pinned: digest that its files must have; None to accept any.
            allows_downgrade: accept a version below the installed one.
            active: settings with which the module is also configured and activated, in the same change; they
                replace those of the same names. None to keep its state.

        Returns:
            The installed module.

        Raises:
            UserError: the module cannot be read, proved, recorded or activated, differs from `pinned`, is
                installed with the same version and other contents, or in a newer version, or is active and
                would wait. Nothing has changed.
        """
        with self._transactions.change_lock() as old:
            files = module_files(source)
            digest = bundle_digest(files)
            _require_digest(digest, pinned, source)
            store = self.folder / "modules"
            id_ = _declared_id(files, store / digest / source.name, source, self._site_of(old))
            with stored_bundle(files, store, id_) as folder:
                with shown_as(folder, source):
                    declared, settings, command = _read_stored(
                        self._site_of(old),
                        old.configurations,
                        folder,
                        source,
                        self._folders(old),
                        self._find_waiting(old),
                        active or UNCONFIGURED,
                    )
                version, kept = declared.version.value, old.modules.get(id_)
                _require_upgrade(kept, id_, version, digest, allows_downgrade=allows_downgrade)
                state = _next_state(old, id_, LifecycleAction.INSTALL)
                one = InstalledModule(id_, version, digest, state, settings)
                new = _installed(old, one, source, command, active)
                with shown_as(folder, source):
                    configuration, _ = self._prove_snapshot(new)
                verbs = "install" if active is None else "install and activate"
                description = f"{verbs} {id_} {version} sha256:{digest} {active or ''}".rstrip()
                self._transactions.commit(old, new, description, configuration)
            return new.modules[id_]

    def repair(self) -> RegistrySnapshot | None:
        """Put the last recorded change in force again, after the database was lost, damaged or replaced.

        Returns:
            The registry now; None if database and record of changes agree.

        Raises:
            UserError: the record cannot be relied on, or its state cannot be proved or recorded.
        """
        with self._transactions.repair_lock() as old:
            if old is None:
                return None
            configuration, _ = self._prove_snapshot(old)
            self._transactions.set_aside_database()
            self._transactions.commit(old, old, f"repair to change {old.generation}", configuration)
        return self.snapshot()

    def configure(
        self,
        name: str,
        settings: ModuleConfiguration = UNCONFIGURED,
        *,
        resets: bool = False,
    ) -> InstalledModule:
        """Configure a module: bind what it needs, set its parameters, and prove it as bound.

        Args:
            name: id of the module.
            settings: bindings and parameters; they replace those of the same names.
            resets: forget the earlier settings. If `settings` is empty and a need or parameter is open
                then, the module is installed and waits to be configured.

        Returns:
            The module in its new state: CONFIGURED, or INSTALLED if it waits.

        Raises:
            UserError: unknown module, wrong state, or the change cannot be proved or recorded.
        """
        return self._change_state(name, LifecycleAction.CONFIGURE, settings, resets=resets)

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

        Refused while an active module needs it, or a capability that no other active module provides.

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

    def add_block(self, block: OperatorBlock) -> None:
        """Add an operator's block. When this returns, nothing that it blocks acts any more, in any run.

        Args:
            block: the block, with an id that is not in use.

        Raises:
            UserError: the id is in use, the site knows no such action kind, channel or device, or the change
                cannot be proved or recorded.
        """
        with self._transactions.change_lock() as old:
            if block.id in old.blocks:
                raise refusal("AE960", f"there is a block `{block.id}` already", "choose another name")
            _require_known_names(block, self._policy_of(old), is_policy_set=old.is_policy_set)
            # Sorted, as they are read back, so that the digest is that of the configuration in force.
            blocks = dict(sorted({**old.blocks, block.id: block}.items()))
            self._change(old, replace(old, blocks=blocks), f"block {block.id}")

    def remove_block(self, block: str) -> None:
        """Remove an operator's block.

        Args:
            block: id of the block.

        Raises:
            UserError: there is no such block, or the change cannot be proved or recorded.
        """
        with self._transactions.change_lock() as old:
            if block not in old.blocks:
                raise _unknown_name_error("block", block, old.blocks)
            left = {name: one for name, one in old.blocks.items() if name != block}
            self._change(old, replace(old, blocks=left), f"unblock {block}")

    def set_policy(self, site: Path) -> Report:
        """Put a site file in force for all installed modules.

        Args:
            site: the site file.

        Returns:
            Report of the proof under the new policy. A configured module of which a need or parameter is
            open under it is installed again, and waits to be configured.

        Raises:
            UserError: the file cannot be read, an active module would wait, or the change cannot be proved or
                recorded.
        """
        with self._transactions.change_lock() as old:
            content = read_policy(site)
            new = replace(old, site=policy_file(content), is_policy_set=True)
            with self._transactions.stored_policy(new, content) as path:
                with shown_as(path, site):
                    new = reset_waiting(new, self._find_waiting(new), str(site))
                    configuration, report = self._prove_snapshot(new)
                description = f"policy {site.name} sha256:{file_digest(content)}"
                self._transactions.commit(old, new, description, configuration)
            return report

    def _change_state(
        self,
        name: str,
        verb: LifecycleAction,
        settings: ModuleConfiguration = UNCONFIGURED,
        *,
        resets: bool = False,
    ) -> InstalledModule:
        with self._transactions.change_lock() as old:
            if name not in old.modules:
                cure = f"if a run has it from a folder, `aeros block --module {name}` reaches it there"
                raise _unknown_name_error("module", name, old.modules, cure)
            state = _next_state(old, name, verb)
            if verb in (LifecycleAction.DEACTIVATE, LifecycleAction.REMOVE):
                _require_not_needed(name, verb, old, self._modules_that_need(name, old))
            before = UNCONFIGURED if resets else old.modules[name].configuration
            one = replace(old.modules[name], state=state, configuration=before.updated(settings))
            if resets and not settings and name in self._find_waiting(_with_module(old, one)):
                verb = LifecycleAction.RESET
                one = replace(one, state=_next_state(old, name, verb))
            new = replace(_with_module(old, one), withdrawn=_withdrawn(old.withdrawn, name, verb))
            self._change(old, new, f"{verb.value} {name} {settings}".rstrip())
            return one

    def _change(self, old: RegistrySnapshot, new: RegistrySnapshot, description: str) -> None:
        configuration, _ = self._prove_snapshot(new)
        self._transactions.commit(old, new, description, configuration)


def _require_known_names(block: OperatorBlock, site: Site, *, is_policy_set: bool) -> None:
    """Require that a block names an action kind, channel and device of the site, if any."""
    cures = () if is_policy_set else ("for runs with --site: `aeros policy SITE` first",)
    granted = (site.access, *site.grants.values())
    used = (kind.channels for kind in site.kinds.values())
    channels = frozenset[str]().union(*(one.channels for one in granted), *used)
    for words, name, known in (
        ("action kind", block.action, site.kinds),
        ("channel", block.channel, channels),
        ("computing device", block.device, site.devices),
    ):
        if name is not None and name not in known:
            raise _unknown_name_error(words, name, known, *cures)


def _require_not_needed(
    name: str, verb: LifecycleAction, old: RegistrySnapshot, needing: Sequence[str]
) -> None:
    """Refuse to withdraw a module that others need, as far as these stay as they are."""
    if verb is LifecycleAction.DEACTIVATE:
        needing = [other for other in needing if old.modules[other].state is ModuleState.ACTIVE]
    if needing:
        cures = (f"`aeros {verb.value} {other}` first" for other in needing)
        raise refusal("AE964", f"`{needing[0]}` needs `{name}`", *cures)


def _next_state(old: RegistrySnapshot, name: str, verb: LifecycleAction) -> ModuleState:
    """Return the state of a module after an act; refuse an act that its state does not allow."""
    state = old.modules[name].state if name in old.modules else ModuleState.ABSENT
    reached = next_state(state, verb)
    if reached is None:
        possible = " or ".join(one.value for one in allowed_states(verb))
        cures = [f"`aeros {verb.value}` is for a module that is {possible}"]
        first = preceding_action(state, verb)
        if first is not None:
            again = state is ModuleState.ACTIVE and verb is LifecycleAction.CONFIGURE
            after = f", and `aeros activate {name}` afterwards" if again else ""
            cures.append(f"`aeros {first.value} {name}` first{after}")
        raise refusal("AE960", f"`{name}` is {state.value}", *cures)
    return reached


def _with_module(old: RegistrySnapshot, module: InstalledModule) -> RegistrySnapshot:
    """Return `old` with the module in its new state, or without it if it is absent now."""
    modules = {name: kept for name, kept in old.modules.items() if name != module.name}
    if module.state is not ModuleState.ABSENT:
        modules[module.name] = module
    return replace(old, modules=dict(sorted(modules.items())))


def _withdrawn(before: frozenset[str], name: str, verb: LifecycleAction) -> frozenset[str]:
    """Return the modules that no run may use: deactivated or removed, and not activated since."""
    if verb in (LifecycleAction.DEACTIVATE, LifecycleAction.REMOVE):
        return before | {name}
    return before - {name} if verb is LifecycleAction.ACTIVATE else before


def _declared_id(files: Mapping[str, bytes], stored: Path, source: Path, site: Site) -> str:
    """Read the id of a module from the bytes that were read of it, which are going to be in `stored`.

    Raises:
        UserError: the manifest is missing or has a fault; all of them are reported.
    """
    path = str(source / MANIFEST)
    if MANIFEST not in files:
        is_folder = any(name.startswith(f"{MANIFEST}/") for name in files)
        reason = "it is a directory" if is_folder else os.strerror(errno.ENOENT).lower()
        raise refusal("AE002", f"{quoted(path)} cannot be read: {reason}")
    manifest = decode_source(path, files[MANIFEST])
    # Under this path the stored manifest, which has the same text, need not be decoded again.
    declared = decode_manifest_text(Source(str(stored / MANIFEST), manifest.text))
    if declared is None:
        diagnostics = Diagnostics()
        load_ecm(source, site, diagnostics, manifest=manifest)
        diagnostics.raise_if_errors()
        raise refusal("AE961", f"`{source}` holds no module")
    return declared.id.value


def _read_stored(
    site: Site,
    configurations: Mapping[str, ModuleConfiguration],
    folder: Path,
    source: Path,
    folders: Mapping[str, Path],
    waiting: Mapping[str, WaitingModule],
    given: ModuleConfiguration,
) -> tuple[declared_ecm.Ecm, ModuleConfiguration, str]:
    """Read a module that was stored, with those earlier settings that it still declares, and those given.

    A module that waits to be configured is not resolved yet. The third value is the command that configures
    it; empty if it does not wait. One that needs one of `waiting`, and nothing else, cannot be read before.
    """
    installed = folders.values()
    declared = decode_manifest(folder)
    if declared is None:
        raise refusal("AE961", f"`{source}` holds no module")
    require_installed(declared, installed, source)
    earlier = _still_declared(configurations.get(declared.id.value, UNCONFIGURED), declared)
    settings = earlier.updated(given)
    site = site.with_configurations({**configurations, declared.id.value: settings})
    command = configure_command(declared.id.value, module_settings(declared, site))
    others = {name: one for name, path in folders.items() if (one := decode_manifest(path)) is not None}
    if not command and needs_one_of(declared, others, waiting):
        raise _waits_for(declared.id.value, waiting)
    if not command:
        load_module(site, folder, installed)
    return declared, settings, command


def _waits_for(id_: str, waiting: Mapping[str, WaitingModule]) -> UserError:
    """Make the error for a module that needs one that waits, without which it cannot be read."""
    names = ", ".join(f"`{name}`" for name in waiting)
    cures = (f"`{one.command}` first, or with other choices" for one in waiting.values())
    return refusal(
        "AE964", f"`{id_}` needs a module that waits to be configured; these wait: {names}", *cures
    )


def _require_digest(digest: str, pinned: str | None, source: Path) -> None:
    """Refuse files that do not have the expected digest, if there is one."""
    if pinned is not None and pinned.removeprefix("sha256:") != digest:
        headline = f"`{source.name}` does not have the pinned digest: its digest is sha256:{digest}"
        raise refusal("AE963", headline)


def _installed(
    old: RegistrySnapshot,
    one: InstalledModule,
    source: Path,
    command: str,
    active: ModuleConfiguration | None,
) -> RegistrySnapshot:
    """Return `old` with a module that is installed, and activated if settings `active` are given for that.

    A module that `command` has to configure waits instead.
    """
    new = _with_module(old, one)
    if active is not None:
        return _activated(new, one, active, source, command)
    return _with_module(old, replace(one, state=_state_to_wait(one, source, command))) if command else new


def _activated(
    new: RegistrySnapshot, one: InstalledModule, settings: ModuleConfiguration, source: Path, command: str
) -> RegistrySnapshot:
    """Return `new` with its module `one` configured and active; refuse it if `command` must configure it."""
    if command:
        if one.state is ModuleState.ACTIVE:
            raise _active_would_wait(one, source, command)
        options = command.removeprefix(f"aeros configure {one.name} ")
        cures = (f"add `{options}`, or other choices", "`aeros install` without activation lists all choices")
        raise refusal("AE960", f"`{one.name}` has open needs or parameters", *cures)
    if settings or one.state is not ModuleState.ACTIVE:
        configured = replace(one, state=_next_state(new, one.name, LifecycleAction.CONFIGURE))
        new = _with_module(new, configured)
        new = _with_module(new, replace(one, state=_next_state(new, one.name, LifecycleAction.ACTIVATE)))
    return replace(new, withdrawn=_withdrawn(new.withdrawn, one.name, LifecycleAction.ACTIVATE))


def _state_to_wait(one: InstalledModule, source: Path, command: str) -> ModuleState:
    """Return the state in which a new version waits to be configured; refuse it in place of an active one."""
    reached = next_state(one.state, LifecycleAction.RESET)
    if reached is None:
        raise _active_would_wait(one, source, command)
    return reached


def _active_would_wait(one: InstalledModule, source: Path, command: str) -> UserError:
    """Make the error for a new version in place of an active one, which `command` would have to configure."""
    id_ = one.name
    commands = (f"aeros deactivate {id_}", f"aeros install {source}", command, f"aeros activate {id_}")
    cures = ("run these commands, or others in place of the choices:", *(f"`{one}`" for one in commands))
    return refusal("AE960", f"`{id_}` is active, and the new version would wait to be configured", *cures)


def _still_declared(settings: ModuleConfiguration, declared: declared_ecm.Ecm) -> ModuleConfiguration:
    """Return those settings that another version of the module still has."""
    needs = {name.value for name, _ in declared.needs}
    parameters = {name.value for name, _ in declared.parameters}
    return ModuleConfiguration(
        {name: one for name, one in settings.bindings.items() if name in needs},
        {name: one for name, one in settings.parameters.items() if name in parameters},
    )


def _require_upgrade(
    kept: InstalledModule | None, id_: str, version: str, digest: str, *, allows_downgrade: bool
) -> None:
    """Refuse other contents of the installed version, and a version below it unless that is allowed."""
    if kept is None:
        return
    new, installed = parse_version(version), parse_version(kept.version)
    if new == installed and kept.digest != digest:
        raise refusal(
            "AE962",
            f"`{id_}` {version} is already installed with other contents",
            "raise the version of the changed module",
        )
    if new < installed and not allows_downgrade:
        raise refusal(
            "AE967",
            f"`{id_}` {version} is older than the installed {kept.version}",
            "to install it all the same, give --allow-downgrade",
        )


def _unknown_name_error(what: str, name: str, known: Iterable[str], *cures: str) -> UserError:
    near = did_you_mean(name, known)
    names = ", ".join(f"`{one}`" for one in known)
    verb = "is" if len(list(known)) == 1 else "are"
    listed = f"there {verb} {names}" if names else _CURES_OF_NONE.get(what, "there is none")
    cure = f"did you mean `{near}`?" if near else listed
    return refusal("AE960", f"there is no {what} `{name}` here", cure, *cures)
