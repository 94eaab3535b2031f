"""Installed modules that wait to be configured.

A need or parameter of theirs is open, or a module that they need waits. They are stored and not proved.
`configure` proves them; until then they cannot be activated.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from aeros.runtime.registry.lifecycle import LifecycleAction, next_state
from aeros.runtime.registry.requirements import provides
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.spec.declared import ecm as declared
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.elaborate.module.needs import module_settings
from aeros.spec.elaborate.module.settings import Setting, configure_command
from aeros.spec.model.site import Site


@dataclass(frozen=True)
class WaitingModule:
    """A module that cannot be proved before it, or a module that it needs, is configured.

    Attributes:
        name: id of the module.
        version: its version.
        settings: its needs and parameters.
        needs: modules that it needs and that wait, too.
        command: command that configures it.
    """

    name: str
    version: str
    settings: tuple[Setting, ...]
    needs: tuple[str, ...]
    command: str

    @property
    def reason(self) -> str:
        """Clause that names what is open, such as ``open: `surface` ``."""
        names = [f"`{one.name}`" for one in self.settings if one.is_open]
        if names:
            return f"open: {', '.join(names)}"
        return f"needs {', '.join(f'`{one}`' for one in self.needs)}, which waits to be configured"


def find_waiting(
    snapshot: RegistrySnapshot, modules: Mapping[str, declared.Ecm], site: Site
) -> dict[str, WaitingModule]:
    """Find the modules that cannot be proved before they are configured, in any state.

    Args:
        snapshot: content of the registry.
        modules: its modules as they declare themselves, by name.
        site: the site in force, without the settings of the registry.

    Returns:
        The modules by name; each after those that it needs.
    """
    chosen = site.with_configurations(snapshot.configurations)
    settings = {name: module_settings(one, chosen) for name, one in modules.items()}
    waiting = {name for name, listed in settings.items() if any(one.is_open for one in listed)}
    while more := {
        name for name, one in modules.items() if name not in waiting and needs_one_of(one, modules, waiting)
    }:
        waiting |= more
    needs = {name: _needed(modules[name], modules) & waiting for name in waiting}
    found = {}
    for name in _dependencies_first(needs):
        command = _command(modules[name], settings[name], site)
        version = snapshot.modules[name].version
        found[name] = WaitingModule(name, version, settings[name], tuple(sorted(needs[name])), command)
    return found


def needs_one_of(one: declared.Ecm, modules: Mapping[str, declared.Ecm], waiting: Collection[str]) -> bool:
    """Say if a module needs a module that waits, or a capability that only modules that wait provide.

    Args:
        one: the module, as it declares itself.
        modules: the installed modules, as they declare themselves, by name.
        waiting: names of those that wait.

    Returns:
        True if it does, so that it waits, too.
    """
    if any(name.value in waiting for name, _ in one.dependencies.modules):
        return True
    for name, capability in one.dependencies.required_capabilities:
        providers = _providers(modules, name.value, capability.version.value)
        if providers and all(provider in waiting for provider in providers):
            return True
    return False


def _needed(one: declared.Ecm, modules: Mapping[str, declared.Ecm]) -> set[str]:
    """Return the installed modules that a module needs, also for a capability."""
    needed = {name.value for name, _ in one.dependencies.modules}
    for name, capability in one.dependencies.required_capabilities:
        needed |= _providers(modules, name.value, capability.version.value)
    return needed - {one.id.value}


def _providers(modules: Mapping[str, declared.Ecm], capability: str, specifier: str) -> set[str]:
    return {name for name, one in modules.items() if provides(one, capability, specifier)}


def _dependencies_first(needs: Mapping[str, set[str]]) -> list[str]:
    """Sort modules so that each comes after those that it needs; a cycle, which no proof accepts, by name."""
    ordered: list[str] = []
    left = sorted(needs)
    while left:
        ready = [name for name in left if needs[name] <= set(ordered)] or left
        ordered += ready
        left = [name for name in left if name not in ready]
    return ordered


def _command(module: declared.Ecm, settings: tuple[Setting, ...], site: Site) -> str:
    """Write the command that configures a module, with what the site chooses before any other choice."""
    of_site = {one.name: one.value for one in module_settings(module, site) if not one.is_open}
    preferred = [
        replace(one, choices=(of_site[one.name],))
        if one.is_open and not one.is_parameter and one.name in of_site
        else one
        for one in settings
    ]
    name = module.id.value
    return configure_command(name, preferred) or f"aeros configure {name}"


def require_configured(snapshot: RegistrySnapshot, waiting: Mapping[str, WaitingModule]) -> None:
    """Require that no configured or active module needs one that waits.

    A module that is itself not bound is left to its own proof, which names its need.

    Args:
        snapshot: content of the registry.
        waiting: modules that wait, as `find_waiting` returns them.

    Raises:
        UserError: a module needs one that waits.
    """
    for one in waiting.values():
        is_bound = not any(setting.is_open for setting in one.settings)
        if is_bound and _after_reset(snapshot.modules[one.name]) != snapshot.modules[one.name]:
            headline = f"`{one.name}` {one.reason}"
            cures = [f"`{waiting[name].command}` binds `{name}`" for name in one.needs]
            raise UserError([Diagnostic("AE964", headline, help=(*cures, f"or `aeros remove {one.name}`"))])


def reset_waiting(
    snapshot: RegistrySnapshot, waiting: Mapping[str, WaitingModule], policy: str
) -> RegistrySnapshot:
    """Return each configured module that waits under a new policy to the state `installed`.

    Args:
        snapshot: content of the registry, with the new policy.
        waiting: modules that wait under it.
        policy: path of the new policy, for messages.

    Returns:
        The registry with these modules in their new state.

    Raises:
        UserError: an active module would wait; the commands that move it are named.
    """
    after = {name: _after_reset(snapshot.modules[name]) for name in waiting}
    active = [name for name, one in after.items() if one is None]
    if active:
        reasons = ", ".join(f"`{name}` ({waiting[name].reason})" for name in active)
        commands = [
            *(f"aeros deactivate {name}" for name in reversed(active)),
            f"aeros policy {policy}",
            *(waiting[name].command for name in active),
            *(f"aeros activate {name}" for name in active),
        ]
        cures = ("run these commands, or others in place of the choices:", *(f"`{one}`" for one in commands))
        headline = f"under `{policy}`, active modules would wait to be configured: {reasons}"
        raise UserError([Diagnostic("AE960", headline, help=cures)])
    changed = {name: one for name, one in after.items() if one is not None}
    return replace(snapshot, modules={**snapshot.modules, **changed})


def _after_reset(module: InstalledModule) -> InstalledModule | None:
    """Return a module as it waits to be configured; None if its state does not allow that."""
    state = next_state(module.state, LifecycleAction.RESET)
    return None if state is None else replace(module, state=state)
