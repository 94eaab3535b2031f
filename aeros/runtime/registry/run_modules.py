"""Modules of a run, from a robot's registry or a folder, as far as the operator lets the run use them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import ModuleIdentity
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.spec.model.policy import OperatorOverride
from aeros.spec.model.rules import ActionKind
from aeros.spec.verification.reports import Report


@dataclass(frozen=True)
class LoadedModules:
    """Modules of a run, proved under the policy and the operator's blocks in force.

    Attributes:
        snapshot: content of the registry that they were loaded under.
        policy: file of the policy in force, as `RegistrySnapshot.site` names it.
        identities: version and digest of every loaded module, by name, also of those that are withheld.
        configuration: configuration of the modules that may be used.
        report: report of its proof.
        withheld: reason of each module that the operator does not let the run use, by name.
        is_installed: True if they are the registry's own; False if they are of a folder.
    """

    snapshot: RegistrySnapshot
    policy: str
    identities: Mapping[str, ModuleIdentity]
    configuration: Configuration
    report: Report
    withheld: Mapping[str, str]
    is_installed: bool

    def revocation_reason(self, now: RegistrySnapshot, module: str, skill: str, kind: str) -> str | None:
        """Say why an action that began under these modules may not go on.

        Args:
            now: content of the registry now.
            module: id of the module that began it.
            skill: id of the skill.
            kind: action kind.

        Returns:
            The reason in words, or None if the action may go on.
        """
        identity = self.identities.get(module)
        if identity is None:
            return f"`{module}` is no longer active"
        withdrawn = withdrawal_reason(now, module, identity, is_installed=self.is_installed)
        if withdrawn is not None:
            return withdrawn
        if self.policy != policy_in_force(now, self.policy):
            return "another policy is in force"
        declared = self.configuration.site.kinds.get(kind)
        channels = frozenset() if declared is None else declared.channels
        for block in now.blocks.values():
            if block.matches(module, identity, skill, kind, channels):
                return f"the operator blocks it: {block.reason}"
        return None


class RunModules(Protocol):
    """Source of the modules of a run."""

    def load(self, snapshot: RegistrySnapshot) -> LoadedModules:
        """Load and prove the modules.

        Args:
            snapshot: content of the registry.

        Returns:
            The modules that may be used under it.

        Raises:
            UserError: they cannot be read or proved, or the policy in force is not the one of the run.
        """


def withdrawal_reason(
    now: RegistrySnapshot, module: str, identity: ModuleIdentity, *, is_installed: bool
) -> str | None:
    """Say why no skill of a module may act on this robot.

    A module of a folder need not be installed. But one that the operator deactivated or removed is not used,
    wherever its files are, until it is activated again; and while a version is active, no other is used.

    Args:
        now: content of the registry.
        module: id of the module.
        identity: version and digest that the run has loaded.
        is_installed: True if the run uses the registry's own modules.

    Returns:
        The reason in words; None if its skills may act.
    """
    one = now.modules.get(module)
    is_active = one is not None and one.state is ModuleState.ACTIVE
    if module in now.withdrawn or (is_installed and not is_active):
        return f"`{module}` is no longer active"
    if one is not None and is_active and one.digest != identity.digest:
        return f"`{module}` now has another version"
    return None


def policy_in_force(now: RegistrySnapshot, otherwise: str) -> str:
    """Return the file of the policy in force.

    Args:
        now: content of the registry.
        otherwise: file of the policy of a run, which holds while the operator has set none.

    Returns:
        The file, as `RegistrySnapshot.site` names it.
    """
    return now.site if now.is_policy_set else otherwise


def blocks_in_force(
    now: RegistrySnapshot, modules: Mapping[str, ModuleIdentity], kinds: Mapping[str, ActionKind]
) -> tuple[OperatorOverride, ...]:
    """Translate the operator's blocks into overrides of the site, for a set of modules.

    Args:
        now: content of the registry.
        modules: identity of each loaded module, by name.
        kinds: action kinds of the site, by name.

    Returns:
        The overrides, in the order of their ids.
    """
    channels = {name: kind.channels for name, kind in kinds.items()}
    return tuple(one for block in now.blocks.values() for one in block.overrides(modules, channels))
