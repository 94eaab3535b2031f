"""Encoding of obstacles for the record of a decision."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

from aeros.runtime.ports import Obstacle, Vec3


def obstacles_to_json(obstacles: Sequence[Obstacle]) -> list[dict[str, Any]]:
    """Encode obstacles for a record.

    Args:
        obstacles: the obstacles, in order.

    Returns:
        A JSON object for each.
    """
    return [{**one._asdict(), "lower": list(one.lower), "upper": list(one.upper)} for one in obstacles]


def obstacles_from_json(encoded: Any) -> tuple[Obstacle, ...]:
    """Decode what `obstacles_to_json` encoded.

    Args:
        encoded: parsed JSON.

    Returns:
        The obstacles.

    Raises:
        TypeError: `encoded` is not such an encoding.
        KeyError: an obstacle has no corner.
        ValueError: a corner does not have three finite numbers.
    """
    return tuple(
        Obstacle(**{**one, "lower": _corner(one["lower"]), "upper": _corner(one["upper"])}) for one in encoded
    )


def _corner(numbers: Any) -> Vec3:
    x, y, z = map(float, numbers)
    if not (isfinite(x) and isfinite(y) and isfinite(z)):
        raise ValueError("a corner of an obstacle is not finite")
    return (x, y, z)
