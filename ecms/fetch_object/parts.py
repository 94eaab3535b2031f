"""Parts of a picture that have the colour of an object. All lengths in metres.

Seen from the side, one of two things of a kind may cover a part of the other, so that both are one part of
the picture: they are told apart by where their points are.
"""

import numpy as np

from aeros.perception import Mask, Points, connected_components, separate_parts

APART_CELL, APART_STEPS = 0.012, 2.0
"""Least edge of the squares by which things are told apart that a picture shows as one, m, and in distances
of neighbouring points: so far apart they stand at least."""

MIN_PIXELS = 25
"""Least number of pixels of the object: fewer are noise, or an object that is mostly hidden."""

LARGEST_SCALE = 1.5
"""Greatest size of a part of a picture over that of the object that it may be."""


def parts_of(mask: Mask, points: Points, diagonal: float) -> tuple[Mask | None, Mask]:
    """Find the part that may be an object of a size, and those that are larger.

    Args:
        mask: pixels of its colour (height, width).
        points: the point of each pixel (height, width, 3), m.
        diagonal: of the object, m.

    Returns:
        The largest part that is not larger than the object, None without any; and all pixels of larger ones.
    """
    larger = np.zeros_like(mask)
    fitting: list[Mask] = []
    for part in separate_parts(mask, MIN_PIXELS):
        alone = [part] if _is_within(points[part], diagonal) else _standing_apart(part, points)
        found = len(fitting)
        for one in alone:
            if _is_within(points[one], diagonal):
                fitting.append(one)
            else:
                larger |= one
        if len(fitting) == found:
            larger |= part
    return max(fitting, key=np.count_nonzero, default=None), larger


def _is_within(points: Points, diagonal: float) -> bool:
    low, high = np.percentile(points, (2.0, 98.0), axis=0)
    return float(np.linalg.norm(high - low)) <= LARGEST_SCALE * diagonal


def _step(part: Mask, points: Points) -> float:
    """Return the usual level distance of points of a part that are neighbours in a column of it, m."""
    both = part[1:] & part[:-1]
    off = (points[1:] - points[:-1])[both][:, :2]
    return float(np.median(np.hypot(off[:, 0], off[:, 1]))) if both.any() else 0.0


def _standing_apart(part: Mask, points: Points) -> list[Mask]:
    """Take a part apart by the squares of the ground that its points are over."""
    edge = max(APART_CELL, APART_STEPS * _step(part, points))
    cells = np.floor(points[part][:, :2] / edge).astype(np.intp)
    cells -= cells.min(axis=0)
    rows, columns = (cells.max(axis=0) + 1).tolist()
    at = cells[:, 0] * columns + cells[:, 1]
    labels, _ = connected_components(np.bincount(at, minlength=rows * columns).reshape(rows, columns) > 0)
    found = labels.ravel()[at]
    alone: list[Mask] = []
    for number in np.flatnonzero(np.bincount(found) >= MIN_PIXELS).tolist():
        one = np.zeros_like(part)
        one[part] = found == number
        alone.append(one)
    return alone
