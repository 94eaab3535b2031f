"""A governor that passes on what another says: for those that add to it."""

from __future__ import annotations

from contextlib import AbstractContextManager

from aeros.runtime.configuration import Configuration
from aeros.runtime.governor import Command, Governor


class Relay:
    """Implements `Governor` by another."""

    def __init__(self, governor: Governor) -> None:
        self._governor = governor

    @property
    def generation(self) -> int:
        """See `Governor`."""
        return self._governor.generation

    @property
    def command(self) -> Command:
        """See `Governor`."""
        return self._governor.command

    def configuration(self) -> tuple[int, Configuration]:
        """See `Governor`."""
        return self._governor.configuration()

    def acting(self, generation: int) -> AbstractContextManager[bool]:
        """See `Governor`."""
        return self._governor.acting(generation)

    def objection(self, module: str, skill: str, kind: str) -> str | None:
        """See `Governor`."""
        return self._governor.objection(module, skill, kind)
