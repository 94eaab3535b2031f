"""Circles through points: position and size of discs and of round edges."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Circle(NamedTuple):
    """A circle in the x, y plane.

    Attributes:
        x: of its middle, m.
        y: of its middle, m.
        radius: m.
        spread: root mean square distance of the points from it, m.
    """

    x: float
    y: float
    radius: float
    spread: float


def fit_circle(edge: NDArray[np.float64]) -> Circle | None:
    """Fit a circle to points on its edge: x² + y² + a·x + b·y + c = 0 by least squares.

    Source: Kåsa, A circle fitting procedure and its error analysis, IEEE Trans. Instrum. Meas. 25, 1976. For
    a filled disc, take `min_area_rectangle`, or the points at its edge.

    Args:
        edge: x and y (n, 2), m.

    Returns:
        The circle; None if the points are fewer than three or in one line.
    """
    if len(edge) < 3:
        return None
    middle = edge.mean(axis=0)
    # Around their middle the sums are well conditioned.
    x, y = (edge - middle).T
    system = np.column_stack((x, y, np.ones(len(edge))))
    (a, b, c), _, rank, _ = np.linalg.lstsq(system, -(x * x + y * y), rcond=1e-9)
    square = (a * a + b * b) / 4.0 - c
    if rank < 3 or square <= 0.0:
        return None
    radius = sqrt(square)
    off = np.hypot(x + a / 2.0, y + b / 2.0) - radius
    return Circle(
        float(middle[0] - a / 2.0), float(middle[1] - b / 2.0), radius, sqrt(float(off @ off) / len(edge))
    )
