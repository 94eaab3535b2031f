"""Registry as the governor of an executor: configuration in force, revocations and operator commands."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Final, Self

from aeros.runtime.execution.governor import OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.control_page import ControlPage
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.run_modules import LoadedModules, RunModules
from aeros.runtime.registry.store import RegistrySnapshot
from aeros.spec.model.ecm import Ecm
from aeros.spec.verification.reports import Report

_POLL_INTERVAL_S: Final = 0.002  # s, while a change is being made


class OperatorCommands:
    """Operator commands to a run, from any terminal; close it when the run ends.

    Args:
        folder: the registry's folder.
        resumed: the run continues after a crash, so a stop requested meanwhile applies to it.
    """

    def __init__(self, folder: Path, *, resumed: bool) -> None:
        self._live = ControlPage(folder)
        # A stop ended an earlier run; a pause applies to any run.
        if self._live.command is OperatorCommand.STOP and not resumed:
            self._live.request_command(OperatorCommand.RUN)

    @property
    def command(self) -> OperatorCommand:
        """Implement `Governor.command`."""
        return self._live.command

    def close(self) -> None:
        """Release the resources shared with other processes; safe to call twice."""
        self._live.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class RegistryGovernor(OperatorCommands):
    """Implement `Governor` for a run on one robot, whatever modules it uses.

    Args:
        registry: the robot's registry; need not exist yet.
        modules: source of the run's modules; None for those that are active in the registry.
        resumed: the run continues after a crash, so a stop requested meanwhile applies to it.

    Raises:
        UserError: registry or modules cannot be read or proved.
    """

    def __init__(
        self, registry: Registry, modules: RunModules | None = None, *, resumed: bool = False
    ) -> None:
        self._registry = registry
        self._modules = registry if modules is None else modules
        # Without a registry nobody can command yet, and modules that are refused leave no folder.
        early = None if registry.folder.exists() else self._modules.load(registry.snapshot())
        super().__init__(registry.folder, resumed=resumed)
        try:
            is_current = early is not None and registry.committed_snapshot(self._live) == early.snapshot
            self._loaded = early if early is not None and is_current else self._load_modules()
        except BaseException:
            self.close()
            raise
        self._latest_read = self._loaded.snapshot

    @property
    def generation(self) -> int:
        """Implement `Governor.generation`."""
        return self._live.generation

    def configuration(self) -> tuple[int, Configuration]:
        """Implement `Governor.configuration`; proves each generation once."""
        if self._loaded.snapshot.generation != self._live.generation:
            self._loaded = self._load_modules()
        return self._loaded.snapshot.generation, self._loaded.configuration

    @property
    def report(self) -> Report:
        """Report of the proof of the configuration."""
        return self._loaded.report

    @property
    def withheld(self) -> Mapping[str, str]:
        """Reason of each module that the run has and the operator does not let it use, by name."""
        return self._loaded.withheld

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        """Implement `Governor.hold_generation`."""
        return self._live.hold_generation(generation)

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        """Implement `Governor.revocation_reason`; the policy counts as changed if its file is another."""
        return self._loaded.revocation_reason(self._latest_snapshot(), module, skill, kind)

    def inactive_modules(self) -> Mapping[str, Ecm]:
        """Load the modules that the run could use if they were activated.

        Returns:
            Modules by name, not proved.
        """
        return self._registry.inactive_modules()

    def _load_modules(self) -> LoadedModules:
        """Load the modules under the registry in force; wait while a change is in progress."""
        while (snapshot := self._registry.committed_snapshot(self._live)) is None or (
            snapshot != self._registry.snapshot()
        ):
            time.sleep(_POLL_INTERVAL_S)
        return self._modules.load(snapshot)

    def _latest_snapshot(self) -> RegistrySnapshot:
        """Read the registry once per generation, and repeatedly while a change is in progress."""
        if self._latest_read.generation != self._live.generation:
            self._latest_read = self._registry.committed_snapshot(self._live) or self._latest_read
        return self._latest_read
