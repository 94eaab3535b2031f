"""Action parameters read strictly: what is missing, unknown, not a number or out of range is refused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.geometry import Vector3


class ActionRejectedError(Exception):
    """The plant cannot do this action; the message says why.  Raised before any motion."""


class ActionParameters:
    """The parameters of one action; each is read once, and `reject_unread` refuses those never read."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    def number(self, name: str, low: float, high: float) -> float:
        """A number in [low, high], SI; both ends are finite."""
        return self._check(name, self._take(name), low, high)

    def position(self, name: str, limit: float = 10.0) -> Vector3:
        """A position in W, m, each coordinate within ±`limit`."""
        value = self._take(name)
        if not isinstance(value, tuple) or len(value) != 3:
            raise ActionRejectedError(f"bad parameter: `{name}` is not a 3-tuple")
        x, y, z = (self._check(name, part, -limit, limit) for part in value)
        return (x, y, z)

    def string(self, name: str) -> str:
        """A string."""
        value = self._take(name)
        if not isinstance(value, str):
            raise ActionRejectedError(f"bad parameter: `{name}` is not a string")
        return value

    def reject_unread(self) -> None:
        """Refuse what nobody read."""
        if self._values:
            raise ActionRejectedError(f"unknown parameter: `{min(self._values)}`")

    def _take(self, name: str) -> Any:
        if name not in self._values:
            raise ActionRejectedError(f"missing parameter: `{name}`")
        return self._values.pop(name)

    @staticmethod
    def _check(name: str, value: Any, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
            raise ActionRejectedError(f"bad parameter: `{name}` is not a number")
        if not low <= value <= high:
            raise ActionRejectedError(f"out of range: `{name}` is outside [{low:g}, {high:g}]")
        return float(value)
