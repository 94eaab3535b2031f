"""Modules of a run that are given, for tests of commands that change none of them."""

from __future__ import annotations

from typing import Any, cast

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.operator_block import UNKNOWN_DIGEST, ModuleIdentity
from aeros.runtime.registry.run_modules import LoadedModules
from aeros.runtime.registry.store import RegistrySnapshot


class FixedModules:
    """Implement `RunModules` with one configuration."""

    def __init__(self, configuration: Configuration) -> None:
        self._configuration = configuration

    def load(self, snapshot: RegistrySnapshot) -> LoadedModules:
        modules = self._configuration.modules
        identities = {name: ModuleIdentity(one.version, UNKNOWN_DIGEST) for name, one in modules.items()}
        report = cast(Any, None)
        return LoadedModules(snapshot, "", identities, self._configuration, report, {}, is_installed=False)
