"""Planes through points: by least squares, and where most points are in none.

Units: m. Frame: that of the points.
"""

from __future__ import annotations

from math import sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.points import Vector3

Points = NDArray[np.float64]

_SEED: Final = 20250707
"""Seed of the random choice of points, the same in every call: equal points give equal planes."""


class Plane(NamedTuple):
    """A plane through points.

    Attributes:
        middle: middle of its points, which lies in it, m.
        normal: unit vector across it; its z is not negative.
        spread: root mean square distance of its points from it, m.
    """

    middle: Vector3
    normal: Vector3
    spread: float

    def height_at(self, x: float, y: float) -> float:
        """Compute the height of the plane.

        Args:
            x: m.
            y: m.

        Returns:
            Its z at (x, y), m; bounded by a slope of 10 where it is steeper.
        """
        return float(
            self.middle[2]
            - (self.normal[0] * (x - self.middle[0]) + self.normal[1] * (y - self.middle[1]))
            / max(self.normal[2], 0.1)
        )


def fit_plane(points: Points) -> Plane:
    """Fit a plane to points: the sum of squared distances is least.

    Its normal is the eigenvector of the least eigenvalue of the points' scatter matrix.
    Args:
        points: (n, 3), n ≥ 3, m.

    Returns:
        The plane.
    """
    middle = (
        np.ones(len(points)) @ points / len(points)
    )  # `mean` of a long, narrow array takes ten times as long
    centred = points - middle
    normal = np.linalg.eigh(centred.T @ centred).eigenvectors[:, 0]  # eigenvalues ascend
    off = centred @ normal
    normal = normal if normal[2] > 0.0 else -normal
    return Plane(
        (float(middle[0]), float(middle[1]), float(middle[2])),
        (float(normal[0]), float(normal[1]), float(normal[2])),
        sqrt(float(off @ off) / len(points)),
    )


def trim_to_plane(points: Points, tolerance: float, least: int, rounds: int = 2) -> tuple[Plane, Points]:
    """Fit a plane to a face, and drop the points off it, such as those on an object's sides.

    Most points must be on the face; `find_plane` does without that.

    Args:
        points: (n, 3), n ≥ 3, m.
        tolerance: greatest distance of the face's points from the plane, m.
        least: least number of points to go on with; points are not dropped below it.
        rounds: number of fits.

    Returns:
        The plane of the last fit, and the points (m, 3) that were not dropped.
    """
    plane = fit_plane(points)
    for further in reversed(range(rounds)):
        near = np.abs((points - np.array(plane.middle)) @ np.array(plane.normal)) < tolerance
        if int(near.sum()) < least:
            break
        points = points[near]
        if further:
            plane = fit_plane(points)
    return plane, points


def find_plane(points: Points, tolerance: float, tries: int = 100) -> tuple[Plane, NDArray[np.bool_]] | None:
    """Find the plane near which most points are (RANSAC), then fit it to those points.

    Equal points give equal results, as the choice of points has a fixed seed.
    Source: Fischler and Bolles, Random sample consensus, CACM 24(6), 1981.

    Args:
        points: (n, 3), m.
        tolerance: greatest distance of a plane's points from it, m.
        tries: number of planes to try.

    Returns:
        The plane and the mask (n,) of its points; None if no three points span a plane.
    """
    if len(points) < 3:
        return None
    chance = np.random.default_rng(_SEED)
    best: NDArray[np.bool_] | None = None
    most = 0
    for _ in range(tries):
        a, b, c = points[chance.choice(len(points), 3, replace=False)]
        across = np.cross(b - a, c - a)
        size = float(np.linalg.norm(across))
        if size <= 1e-12:
            continue  # the three are in a line
        normal = across / size
        near = np.abs(points @ normal - a @ normal) <= tolerance
        count = int(near.sum())
        if count > most:
            best, most = near, count
    if best is None:
        return None
    plane = fit_plane(points[best])
    off = np.abs((points - np.array(plane.middle)) @ np.array(plane.normal))
    return plane, off <= tolerance
