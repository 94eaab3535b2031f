"""Strict access to action parameters: missing, unknown, mistyped and out-of-range ones are refused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.geometry import Vector3


class ActionRejectedError(Exception):
    """The plant cannot do this action; the message says why. Raised before any motion."""


class ActionParameters:
    """The parameters of one action; each is read once, and `reject_unread` refuses the rest."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    def number(self, name: str, low: float, high: float) -> float:
        """Read a number.

        Args:
            name: of the parameter.
            low: least allowed value, SI.
            high: greatest allowed value, SI.

        Returns:
            The number, in [low, high].

        Raises:
            ActionRejectedError: it is missing, no number or out of range.
        """
        return self._check(name, self._take(name), low, high)

    def position(self, name: str, limit: float = 10.0) -> Vector3:
        """Read a position in W.

        Args:
            name: of the parameter.
            limit: greatest absolute value of a coordinate, m.

        Returns:
            The position, m.

        Raises:
            ActionRejectedError: it is missing, no 3-tuple of numbers or out of range.
        """
        value = self._take(name)
        if not isinstance(value, tuple) or len(value) != 3:
            raise ActionRejectedError(f"bad parameter: `{name}` is not a 3-tuple")
        x, y, z = (self._check(name, part, -limit, limit) for part in value)
        return (x, y, z)

    def string(self, name: str) -> str:
        """Read a string.

        Args:
            name: of the parameter.

        Returns:
            The string.

        Raises:
            ActionRejectedError: it is missing or no string.
        """
        value = self._take(name)
        if not isinstance(value, str):
            raise ActionRejectedError(f"bad parameter: `{name}` is not a string")
        return value

    def reject_unread(self) -> None:
        """Refuse parameters that were not read.

        Raises:
            ActionRejectedError: there is one.
        """
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
