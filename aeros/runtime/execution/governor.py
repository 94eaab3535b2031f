"""Governor of an executor: names the configuration in force, and rules for when the executor follows it.

A governor has one fixed configuration, or it is a registry that an operator changes during the run.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from enum import Enum
from typing import Final, Protocol

from aeros.runtime.gate.configuration import Configuration
from aeros.spec.model.ecm import Ecm

_ALWAYS_IN_FORCE: Final = nullcontext(True)


class OperatorCommand(Enum):
    """Command of the operator to a running executor."""

    RUN = 0
    PAUSE = 1  # no action begins until RUN
    STOP = 2  # all motions are stopped, and no action begins


class Governor(Protocol):
    """Source of the configuration in force; asked before every action and at every control tick."""

    @property
    def generation(self) -> int:
        """Number of the configuration in force; changes with it. Must be quick."""

    @property
    def command(self) -> OperatorCommand:
        """Current command of the operator. Must be quick."""

    def configuration(self) -> tuple[int, Configuration]:
        """Return the configuration in force, proved.

        Returns:
            The generation, and its configuration.

        Raises:
            UserError: the configuration cannot be read or proved.
        """

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        """Keep a change of the configuration from completing while a block runs.

        Args:
            generation: the generation that the caller is about to act under.

        Returns:
            Context manager whose value is True if `generation` is still in force.
        """

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        """Say why an active action may not go on.

        Args:
            module: id of the module that began it.
            skill: id of the skill.
            kind: action kind.

        Returns:
            The reason in words, or None if the action may go on.
        """


class FixedGovernor:
    """Governor with one fixed configuration and no operator commands."""

    def __init__(self, configuration: Configuration) -> None:
        self._configuration = configuration

    @property
    def generation(self) -> int:
        """Implement `Governor.generation`."""
        return 0

    @property
    def command(self) -> OperatorCommand:
        """Implement `Governor.command`."""
        return OperatorCommand.RUN

    def configuration(self) -> tuple[int, Configuration]:
        """Implement `Governor.configuration`."""
        return 0, self._configuration

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        """Implement `Governor.hold_generation`."""
        return _ALWAYS_IN_FORCE if generation == 0 else nullcontext(False)

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        """Implement `Governor.revocation_reason`."""
        return None


class FollowedConfiguration:
    """The configuration that an executor follows: it changes only while no motion is active.

    Args:
        configuration: the one at first.
        governor: names the one in force.
        is_moving: returns True while any motion is active.
        switch: called with a new configuration, to decide everything under it from then on.
        record: called with a new configuration, to record it.
    """

    def __init__(
        self,
        configuration: Configuration,
        governor: Governor,
        is_moving: Callable[[], bool],
        switch: Callable[[Configuration], None],
        record: Callable[[Configuration], None],
    ) -> None:
        self.configuration = configuration
        # None, so that the first `follow` reads it: it may have changed since it was loaded.
        self.generation: int | None = None
        self._governor = governor
        self._is_moving = is_moving
        self._switch = switch
        self._record = record
        # Entered while a motion is active; until it is exited, no change of the configuration completes.
        self._held: AbstractContextManager[bool] | None = None

    def follow(self) -> int:
        """Switch to the configuration in force, unless a motion is active.

        Returns:
            The generation that is followed.
        """
        followed = self.generation
        if followed is not None and (followed == self._governor.generation or self._is_moving()):
            return followed
        generation, configuration = self._governor.configuration()
        self.generation = generation
        if configuration.digest == self.configuration.digest:
            return generation
        self._switch(configuration)
        self.configuration = configuration
        self._record(configuration)
        return generation

    def is_latest(self) -> bool:
        """Follow the governor's configuration, unless a motion is active.

        Returns:
            True if the followed configuration is the one in force.
        """
        return self.follow() == self._governor.generation

    def is_active(self, ecm: Ecm) -> bool:
        """Compare a module with the active ones.

        Args:
            ecm: the module as it was when its step started.

        Returns:
            True if the same module, with the same manifest, code and configuration, is active now.
        """
        now = self.configuration.modules.get(ecm.id)
        if now is ecm:
            return True
        was = (ecm.manifest_digest, ecm.code_digest, ecm.configuration)
        return now is not None and (now.manifest_digest, now.code_digest, now.configuration) == was

    def hold(self) -> bool:
        """Keep changes of the configuration from completing until `release`.

        While a motion is active, an earlier `hold` does so already.

        Returns:
            True if the followed configuration is the one in force.
        """
        if self._is_moving():
            return self.is_latest()
        acting = self._governor.hold_generation(self.follow())
        in_force, self._held = acting.__enter__(), acting
        return in_force

    def release(self) -> None:
        """Let changes of the configuration complete, if no motion is active."""
        if self._held is not None and not self._is_moving():
            acting, self._held = self._held, None
            acting.__exit__(None, None, None)
