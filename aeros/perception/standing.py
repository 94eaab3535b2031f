"""Things that stand on a plane, in a picture with depth: heights above it, and the parts of a mask.

Units: m. Frame: that of the points.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from aeros.perception.components import connected_components
from aeros.perception.planes import Plane, trim_to_plane
from aeros.perception.points import Mask, Points


def find_ground(points: Points, tolerance: float, least: int) -> Plane | None:
    """Fit the plane that things stand on, such as a table's top.

    Args:
        points: (n, 3) near the plane; most of them on it, m.
        tolerance: greatest distance of the plane's points from it, m.
        least: least number of points that show a plane.

    Returns:
        The plane; None if there are fewer points.
    """
    return None if len(points) < max(least, 3) else trim_to_plane(points, tolerance, least)[0]


def heights_above(points: Points, plane: Plane) -> NDArray[np.float64]:
    """Compute the distances of points from a plane.

    Args:
        points: (..., 3), m.
        plane: the plane.

    Returns:
        Distances (...), m; positive on the side that its normal points to.
    """
    heights: NDArray[np.float64] = (points - np.array(plane.middle)) @ np.array(plane.normal)
    return heights


def separate_parts(mask: Mask, least: int) -> Iterator[Mask]:
    """Separate the connected components of a mask.

    Args:
        mask: (height, width).
        least: least number of pixels of a component: fewer are noise.

    Yields:
        The mask of each component (height, width), in the order of their first pixels.
    """
    labels, count = connected_components(mask)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    for number in range(1, count + 1):
        if sizes[number] >= least:
            yield labels == number


def erode(mask: Mask) -> Mask:
    """Remove the outermost pixels of a mask, and with them all that is less than three pixels wide.

    Args:
        mask: (height, width).

    Returns:
        The pixels whose eight neighbours are in the mask, too (height, width).
    """
    padded = np.pad(mask, 1)
    height, width = mask.shape
    inner = mask.copy()
    for row in range(3):
        for column in range(3):
            inner &= padded[row : row + height, column : column + width]
    return inner
