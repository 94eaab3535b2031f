"""Action parameters read strictly: what is missing, unknown, not a number or out of range is refused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.geometry import Triple


class RefusedError(Exception):
    """The plant cannot do this action; the message says why.  Raised before any motion."""


class Parameters:
    """The parameters of one action; each is read once, and `done` refuses those never read."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    def number(self, name: str, low: float, high: float) -> float:
        """A number in [low, high], SI; both ends are finite."""
        return self._check(name, self._take(name), low, high)

    def triple(self, name: str, reach: float = 10.0) -> Triple:
        """A position in W, m, each coordinate within ±`reach`."""
        value = self._take(name)
        if not isinstance(value, tuple) or len(value) != 3:
            raise RefusedError(f"bad parameter: `{name}` is not a 3-tuple")
        x, y, z = (self._check(name, part, -reach, reach) for part in value)
        return (x, y, z)

    def word(self, name: str) -> str:
        """A string."""
        value = self._take(name)
        if not isinstance(value, str):
            raise RefusedError(f"bad parameter: `{name}` is not a string")
        return value

    def done(self) -> None:
        """Refuse what nobody read."""
        if self._values:
            raise RefusedError(f"unknown parameter: `{min(self._values)}`")

    def _take(self, name: str) -> Any:
        if name not in self._values:
            raise RefusedError(f"missing parameter: `{name}`")
        return self._values.pop(name)

    @staticmethod
    def _check(name: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
            raise RefusedError(f"bad parameter: `{name}` is not a number")
        if not low <= value <= high:
            raise RefusedError(f"out of range: `{name}` is outside [{low:g}, {high:g}]")
        return float(value)
