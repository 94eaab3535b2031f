"""Obstacles as a reading: what pictures show in the cell, and neither robot nor module explains.

The reading is one of the runtime's own. Whole motions keep off obstacles as they keep off barriers.
"""

from __future__ import annotations

from math import isfinite
from typing import Any, Final, NamedTuple

from aeros.runtime.motion.swept_volume import BarrierBox
from aeros.runtime.ports import Readings, Vec3

OBSTACLES: Final = "obstacles"
"""Name of the reading; no state variable of a site or a module may have it."""


class Obstacle(NamedTuple):
    """Something that pictures show and nobody declared.

    Attributes:
        name: stays the same while it is seen at the same place, as in `unknown-object-1`.
        lower: corner with the least coordinates in W, m; with the uncertainty of the pictures.
        upper: corner with the greatest coordinates, m.
        seen: plant time of the latest picture that shows it, s.
        camera: camera that took it.
        volume: volume of the site that it is in.
    """

    name: str
    lower: Vec3
    upper: Vec3
    seen: float
    camera: str
    volume: str

    def __str__(self) -> str:
        """As in `unknown-object-1 at (0.45, -0.10) m in bench_area, 60 x 80 x 120 mm`."""
        x, y, _ = ((a + b) / 2.0 for a, b in zip(self.lower, self.upper, strict=True))
        edges = [round(1000.0 * (b - a)) for a, b in zip(self.lower, self.upper, strict=True)]
        return f"{self.name} at ({x:.2f}, {y:.2f}) m in {self.volume}, {' x '.join(map(str, edges))} mm"

    def as_barrier(self) -> BarrierBox:
        """Return the space that every link keeps out of.

        Returns:
            A barrier in W.
        """
        return BarrierBox(self.name, self.lower, self.upper, False, False, None)


def obstacles_in(readings: Readings) -> list[Obstacle]:
    """Read the obstacles that are known.

    Args:
        readings: readings of the runtime.

    Returns:
        The obstacles, oldest first; empty if no camera has looked for any.

    Raises:
        ValueError: the reading is not a tuple of obstacles.
    """
    reading = readings.get(OBSTACLES)
    if reading is None:
        return []
    try:
        return [_obstacle(*parts) for parts in reading.value]
    except TypeError as fault:
        raise ValueError(f"`{OBSTACLES}` is not a tuple of obstacles") from fault


def _obstacle(name: Any, lower: Any, upper: Any, seen: Any, camera: Any, volume: Any) -> Obstacle:
    numbers = [*lower, *upper, seen]
    if len(lower) != 3 or len(upper) != 3 or set(map(type, numbers)) != {float}:
        raise ValueError(f"an obstacle of `{OBSTACLES}` does not have two corners and a time")
    if not all(map(isfinite, numbers)) or {*map(type, (name, camera, volume))} != {str}:
        raise ValueError(f"an obstacle of `{OBSTACLES}` has a number that is not finite, or no name")
    return Obstacle(
        name, (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2]), seen, camera, volume
    )
