"""Obstacle check of a base that drives: its own box keeps off what pictures show, all along a straight way.

A box that moves along a line comes within d of another box iff the line of its origin meets the other box,
enlarged by d and by the extent of the first (Minkowski sum of boxes; distances along the axes). The line is
cut with the enlarged box by the slab method (T. Kay, J. Kajiya, SIGGRAPH 1986).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from aeros.runtime.motion.swept_volume import BarrierBreach
from aeros.runtime.ports import Obstacle, Vec3
from aeros.spec.expr.scope import AxisAlignedBox

BASE: Final = "base"
"""Name by which reasons call the base itself."""


class BaseTravel(NamedTuple):
    """A base that drives along a straight line, and does not turn.

    Attributes:
        box: lower and upper corner of what it takes up, in its own frame, m.
        start: its position in W, m.
        path: its displacement, m; all zeros if it rests.
    """

    box: tuple[Vec3, Vec3]
    start: Vec3
    path: Vec3

    def at_end(self) -> BaseTravel:
        """Return the base at rest where it arrives.

        Returns:
            A travel without a path.
        """
        x, y, z = (a + b for a, b in zip(self.start, self.path, strict=True))
        return BaseTravel(self.box, (x, y, z), (0.0, 0.0, 0.0))


def box_corners(box: AxisAlignedBox) -> tuple[Vec3, Vec3]:
    """Return the corners of a declared box as floats.

    Args:
        box: the box.

    Returns:
        Its lower and upper corner, m.
    """
    (ax, ay, az), (bx, by, bz) = box.lower, box.upper
    return (float(ax), float(ay), float(az)), (float(bx), float(by), float(bz))


def find_base_contact(
    travel: BaseTravel, obstacles: Sequence[Obstacle], clearance: float
) -> BarrierBreach | None:
    """Search for an obstacle that the base comes near to.

    Args:
        travel: the way of the base, from now on.
        obstacles: the obstacles.
        clearance: distance to keep from each along the axes, m.

    Returns:
        The contact that comes first on the way; None if the base is clear of all obstacles throughout.
    """
    contacts = [
        (share, one.name)
        for one in obstacles
        if (share := _first_contact(travel, one, clearance)) is not None
    ]
    if not contacts:
        return None
    share, name = min(contacts)
    return BarrierBreach(name, BASE, share)


def _first_contact(travel: BaseTravel, obstacle: Obstacle, clearance: float) -> float | None:
    """Return the share of the way at which the base is near first, or None."""
    enter, leave = 0.0, 1.0
    lower, upper = enlarged_obstacle(travel.box, obstacle, clearance)
    for start, path, low, high in zip(travel.start, travel.path, lower, upper, strict=True):
        if path == 0.0:
            if not low <= start <= high:
                return None
            continue
        first, last = sorted(((low - start) / path, (high - start) / path))
        enter, leave = max(enter, first), min(leave, last)
    return enter if enter <= leave else None


def enlarged_obstacle(box: tuple[Vec3, Vec3], obstacle: Obstacle, clearance: float) -> tuple[Vec3, Vec3]:
    """Return the positions of a base at which it is near an obstacle.

    Args:
        box: lower and upper corner of what the base takes up, in its own frame, m.
        obstacle: the obstacle.
        clearance: distance to keep along the axes, m.

    Returns:
        Lower and upper corner of these positions in W, m.
    """
    own_lower, own_upper = box
    ax, ay, az = (a - b - clearance for a, b in zip(obstacle.lower, own_upper, strict=True))
    bx, by, bz = (a - b + clearance for a, b in zip(obstacle.upper, own_lower, strict=True))
    return (ax, ay, az), (bx, by, bz)
