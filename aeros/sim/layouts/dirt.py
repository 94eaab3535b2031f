"""A map of dirt on a level surface at z = 0 of W, in square cells."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Pose, Triple, of_frame

CELL: Final = 0.01
"""Edge of a cell, m."""

GAP: Final = 0.0015
"""Distance of the wiping face below which a cell under it is wiped, m."""


class DirtMap:
    """Which cells of a rectangle (corners in m, x and y of W) have been wiped."""

    def __init__(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        columns, rows = (np.arange(a + CELL / 2, b, CELL) for a, b in zip(low, high, strict=True))
        self._shape = (len(rows), len(columns))
        self._centres = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        self._wiped = np.zeros(len(self._centres), dtype=np.bool_)

    @property
    def wiped(self) -> NDArray[np.bool_]:
        """Whether each cell is wiped; rows from the least y, columns from the least x."""
        return self._wiped.reshape(self._shape)

    @property
    def wiped_fraction(self) -> float:
        """Share of wiped cells, in [0, 1]."""
        return float(self._wiped.mean())

    def wipe(self, pose: Pose, size: Triple) -> None:
        """Wipe the cells whose centres are under a box's bottom face, nearer than `GAP`.

        pose: of the box's middle in W; size: its edges, m.  The box lies within 45° of upright.
        """
        half = np.array(size) / 2.0
        middle = np.array(of_frame(pose, (0.0, 0.0, -half[2])))
        ahead = np.array(of_frame(pose, (1.0, 0.0, -half[2]))) - middle
        aside = np.array(of_frame(pose, (0.0, 1.0, -half[2]))) - middle
        # Where the face is above a cell: solve centre = middle + a·ahead + b·aside in x and y.
        plane = np.stack((ahead[:2], aside[:2]), axis=1)
        a, b = np.linalg.solve(plane, (self._centres - middle[:2]).T)
        height = middle[2] + a * ahead[2] + b * aside[2]
        self._wiped |= (np.abs(a) < half[0]) & (np.abs(b) < half[1]) & (height < GAP)
