"""The configuration in force: who names it, and how the executor follows it.

A governor has one configuration for good, or it is a registry that an operator changes meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from enum import Enum
from typing import Final, Protocol

from aeros.runtime.gate.configuration import Configuration
from aeros.spec.model.model import Ecm

_ALWAYS_IN_FORCE: Final = nullcontext(True)


class OperatorCommand(Enum):
    """What the operator asks of whoever executes."""

    RUN = 0
    PAUSE = 1  # nothing begins until RUN
    STOP = 2  # what moves is stopped, and nothing begins


class Governor(Protocol):
    """What an executor asks before every action and at every control tick."""

    @property
    def generation(self) -> int:
        """Changes with the configuration; quick to ask."""

    @property
    def command(self) -> OperatorCommand:
        """What is asked of the executor now; quick to ask."""

    def configuration(self) -> tuple[int, Configuration]:
        """The configuration in force, proved, and its generation.  Raises `UserError`."""

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        """Whether `generation` is still in force; while the block runs, no change of it is complete."""

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        """Why an action of `kind` that this skill began may not go on, or None."""


class FixedGovernor:
    """One configuration for good, and nobody who asks for a pause."""

    def __init__(self, configuration: Configuration) -> None:
        self._configuration = configuration

    @property
    def generation(self) -> int:
        """See `Governor`."""
        return 0

    @property
    def command(self) -> OperatorCommand:
        """See `Governor`."""
        return OperatorCommand.RUN

    def configuration(self) -> tuple[int, Configuration]:
        """See `Governor`."""
        return 0, self._configuration

    def hold_generation(self, generation: int) -> AbstractContextManager[bool]:
        """See `Governor`."""
        return _ALWAYS_IN_FORCE if generation == 0 else nullcontext(False)

    def revocation_reason(self, module: str, skill: str, kind: str) -> str | None:
        """See `Governor`."""
        return None


class FollowedConfiguration:
    """The configuration that an executor follows: another is taken over only while nothing moves.

    Args:
        configuration: the one at first.
        governor: names the one in force.
        is_moving: says whether any action is under way.
        switch: has everything decided under the configuration that it is given, from then on.
        record: records a configuration that was taken over.
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
        # Of no generation yet: what was loaded before may have changed since, so the first look follows.
        self.generation: int | None = None
        self._governor = governor
        self._is_moving = is_moving
        self._switch = switch
        self._record = record
        # Entered while anything moves: until it is left no change of the configuration is complete.
        self._held: AbstractContextManager[bool] | None = None

    def follow(self) -> int:
        """Take over the configuration that is in force, unless something moves.

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
        """Follow, and say whether it is the configuration in force that is followed then."""
        return self.follow() == self._governor.generation

    def is_active(self, ecm: Ecm) -> bool:
        """Say whether the same module, with the same manifest and code, is active now."""
        now = self.configuration.modules.get(ecm.id)
        if now is ecm:
            return True
        was = (ecm.manifest_digest, ecm.code_digest)
        return now is not None and (now.manifest_digest, now.code_digest) == was

    def hold(self) -> bool:
        """Let no change of the configuration be complete until `release`, where nothing moves yet.

        Returns:
            Whether the configuration that is followed is in force.
        """
        if self._is_moving():
            return self.is_latest()
        acting = self._governor.hold_generation(self.follow())
        in_force, self._held = acting.__enter__(), acting
        return in_force

    def release(self) -> None:
        """Let changes of the configuration be complete, once nothing moves."""
        if self._held is not None and not self._is_moving():
            acting, self._held = self._held, None
            acting.__exit__(None, None, None)
