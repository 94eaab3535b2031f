"""A map of dirt on a level surface at z = 0 of W, in square cells."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Pose, Vector3, to_world

CELL_SIZE: Final = 0.01
"""Edge of a cell, m."""

WIPING_GAP: Final = 0.0015
"""Greatest distance of the wiping face from a cell that it wipes, m."""


class DirtMap:
    """Wiped and dirty cells of a rectangle.

    Args:
        low: corner with the least x and y in W, m.
        high: corner with the greatest x and y in W, m.
    """

    def __init__(self, low: tuple[float, float], high: tuple[float, float]) -> None:
        self._x, self._y = (
            np.arange(a + CELL_SIZE / 2, b, CELL_SIZE) for a, b in zip(low, high, strict=True)
        )
        self.wiped: NDArray[np.bool_] = np.zeros((len(self._y), len(self._x)), dtype=np.bool_)
        """True for wiped cells; rows from the least y, columns from the least x."""

    @property
    def wiped_fraction(self) -> float:
        """Share of wiped cells, in [0, 1]."""
        return int(np.count_nonzero(self.wiped)) / self.wiped.size

    def wipe(self, pose: Pose, size: Vector3) -> None:
        """Wipe the cells whose centres are under a box's bottom face, nearer than `WIPING_GAP`.

        Args:
            pose: of the box's middle in W, within 45° of upright.
            size: length, width and height of the box, m.
        """
        width, depth, height = (edge / 2.0 for edge in size)
        mx, my, mz = to_world(pose, (0.0, 0.0, -height))
        ahead, aside = to_world(pose, (1.0, 0.0, -height)), to_world(pose, (0.0, 1.0, -height))
        ax, ay, az = ahead[0] - mx, ahead[1] - my, ahead[2] - mz
        bx, by, bz = aside[0] - mx, aside[1] - my, aside[2] - mz
        # Coordinates of each cell in the face: the cell is middle + a·ahead + b·aside in x and y.
        x, y, turn = self._x - mx, (self._y - my)[:, None], ax * by - ay * bx
        a = (by / turn) * x - (bx / turn) * y
        b = (ax / turn) * y - (ay / turn) * x
        self.wiped |= (np.abs(a) < width) & (np.abs(b) < depth) & (mz + az * a + bz * b < WIPING_GAP)
