"""Coverage: which part of a region pictures have shown, and how much lies in it.

What no picture has shown is unknown: it is outside of the view, or behind an arm or another object.
Units: m. Frame: that of the points.
"""

from __future__ import annotations

import numpy as np

from aeros.perception.components import connected_components
from aeros.perception.points import Mask, Points

Corner = tuple[float, float]


def seen_cells(points: Points, low: Corner, high: Corner, cell: float) -> Mask:
    """Find the cells of a rectangle in which a picture shows something.

    Args:
        points: on what is in the cell below or above them (n, 3), m; none on an arm above it.
        low: corner of the rectangle with the least x and y, m.
        high: corner with the greatest x and y, m.
        cell: edge of a cell, m.

    Returns:
        Mask of the cells (along x, along y).
    """
    columns, rows = (max(1, round((b - a) / cell)) for a, b in zip(low, high, strict=True))
    seen = np.zeros((columns, rows), np.bool_)
    x, y = ((points[:, axis] - low[axis]) / (high[axis] - low[axis]) for axis in range(2))
    inside = (x >= 0.0) & (x < 1.0) & (y >= 0.0) & (y < 1.0)
    seen[(x[inside] * columns).astype(np.intp), (y[inside] * rows).astype(np.intp)] = True
    return seen


def largest_gap(seen: Mask) -> int:
    """Measure the largest patch that was not seen, in which an object may hide.

    Args:
        seen: mask of cells.

    Returns:
        Number of its cells; 0 if all were seen.
    """
    labels, count = connected_components(~seen)
    return int(np.bincount(labels.ravel(), minlength=count + 1)[1:].max(initial=0))


def heap_volume(points: Points, cell: float) -> float:
    """Estimate the volume of things on a ground at z = 0, as seen from above.

    Args:
        points: on them (n, 3), m.
        cell: edge of the cells whose heights are summed up, m; not much less than a pixel.

    Returns:
        The volume below their upper sides, m³.
    """
    if len(points) == 0:
        return 0.0
    low = points[:, :2].min(axis=0)
    column, row = ((points[:, :2] - low) / cell).astype(np.intp).T
    number = column * (int(row.max()) + 1) + row
    order = np.lexsort((points[:, 2], number))
    is_highest = np.append(np.diff(number[order]) > 0, [True])
    return float(points[order[is_highest], 2].sum()) * cell * cell
