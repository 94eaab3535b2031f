"""Who says which configuration governs: one for good, or a registry that an operator changes meanwhile."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from enum import Enum
from typing import Final, Protocol

from aeros.runtime.configuration import Configuration

_FOR_GOOD: Final = nullcontext(True)


class Command(Enum):
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
    def command(self) -> Command:
        """What is asked of the executor now; quick to ask."""

    def configuration(self) -> tuple[int, Configuration]:
        """The configuration in force, proved, and its generation.  Raises `UserError`."""

    def acting(self, generation: int) -> AbstractContextManager[bool]:
        """Whether `generation` is still in force; while the block runs, no change of it is complete."""

    def objection(self, module: str, skill: str, kind: str) -> str | None:
        """Why an action of `kind` that this skill began may not go on, or None."""


class Fixed:
    """One configuration for good, and nobody who asks for a pause."""

    def __init__(self, configuration: Configuration) -> None:
        self._configuration = configuration

    @property
    def generation(self) -> int:
        """See `Governor`."""
        return 0

    @property
    def command(self) -> Command:
        """See `Governor`."""
        return Command.RUN

    def configuration(self) -> tuple[int, Configuration]:
        """See `Governor`."""
        return 0, self._configuration

    def acting(self, generation: int) -> AbstractContextManager[bool]:
        """See `Governor`."""
        return _FOR_GOOD if generation == 0 else nullcontext(False)

    def objection(self, module: str, skill: str, kind: str) -> str | None:
        """See `Governor`."""
        return None
