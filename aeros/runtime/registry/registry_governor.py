"""Registry as the governor of an executor: configuration in force, revocations and operator commands."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Final, Self

from aeros.runtime.execution.governor import FixedGovernor, OperatorCommand
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.control_page import ControlPage
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.store import RegistrySnapshot
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
        """Implements `Governor.command`."""
        return self._live.command

    def close(self) -> None:
        """Release the resources shared with other processes; safe to call twice."""
        self._live.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class RegistryGovernor(OperatorCommands):
    """Implements `Governor` over a registry."""

    def __init__(self, registry: Registry, *, resumed: bool = False) -> None:
        super().__init__(registry.folder, resumed=resumed)
        self._registry = registry
        self._loaded, self._current = self._load_configuration()
        self._latest_read = self._loaded

    @property
    def generation(self) -> int:
        """Implements `Governor.generation`."""
        return self._live.generation

    def configuration(self) -> tuple[int, Configuration]:
        """Implements `Governor.configuration`; proves each generation once."""
        if self._current[0] != self._live.generation:
            self._loaded, self._current = self._load_configuration()
        generation, configuration, _ = self._current
        return generation, configuration

    @property
    def report(self) -> Report:
        """Report of the proof of the configuration."""
        return self._current[2]

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        """Implements `Governor.hold_generation`."""
        return self._live.hold_generation(generation)

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        """Implements `Governor.revocation_reason`; the policy counts as changed if its file is another."""
        now, was = self._latest_snapshot(), self._loaded
        one = now.modules.get(module)
        if one is None or one.state is not ModuleState.ACTIVE:
            return f"`{module}` is no longer active"
        if one.digest != was.modules[module].digest:
            return f"`{module}` now has another version"
        if now.site != was.site:
            return "another policy is in force"
        for block in now.blocks.values():
            if block.matches(module, skill, kind):
                return f"the operator blocks it: {block.reason}"
        return None

    def _load_configuration(self) -> tuple[RegistrySnapshot, tuple[int, Configuration, Report]]:
        """Load the configuration in force; wait while a change is in progress."""
        while (snapshot := self._registry.committed_snapshot(self._live)) is None:
            time.sleep(_POLL_INTERVAL_S)
        return snapshot, (snapshot.generation, *self._registry.configuration(snapshot))

    def _latest_snapshot(self) -> RegistrySnapshot:
        """Read the registry once per generation, and repeatedly while a change is in progress."""
        if self._latest_read.generation != self._live.generation:
            self._latest_read = self._registry.committed_snapshot(self._live) or self._latest_read
        return self._latest_read


class CommandableGovernor(OperatorCommands, FixedGovernor):
    """Governor with a fixed set of modules, from no registry, that obeys pause and stop."""

    def __init__(self, configuration: Configuration, registry: Registry, *, resumed: bool = False) -> None:
        OperatorCommands.__init__(self, registry.folder, resumed=resumed)
        FixedGovernor.__init__(self, configuration)

    @contextmanager
    def hold_generation(self, generation: int) -> Iterator[bool]:
        """Implements `Governor.hold_generation`."""
        with self._live.hold_generation(self._live.generation):
            yield generation == self.generation
