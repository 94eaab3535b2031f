"""Coatings: which cells of a rectangle a body has wiped, and their picture."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Pose, Vector3, to_world
from aeros.spec.model.scene import Coating


class CoatingMap:
    """Wiped and coated cells of a rectangle at z = 0 of W.

    Args:
        coating: the declaration.

    Attributes:
        coating: the declaration.
        wiped: True for wiped cells; rows from the least y, columns from the least x.
    """

    def __init__(self, coating: Coating) -> None:
        self.coating = coating
        self._x, self._y = (
            np.arange(low + coating.cell / 2, high, coating.cell)
            for low, high in zip(coating.low, coating.high, strict=True)
        )
        self.wiped: NDArray[np.bool_] = np.zeros((len(self._y), len(self._x)), dtype=np.bool_)
        self._colours = [
            np.array([round(255 * share) for share in colour], dtype=np.uint8)
            for colour in (coating.under, coating.colour)
        ]

    @property
    def wiped_share(self) -> float:
        """Share of wiped cells, in [0, 1]."""
        return int(np.count_nonzero(self.wiped)) / self.wiped.size

    def wiped_share_where(self, contains: Callable[[Vector3], bool]) -> float:
        """Measure a part of the coating.

        Args:
            contains: true for points, m in W, of the part.

        Returns:
            Share of wiped cells among those whose centres are in the part; 0 if it has none.
        """
        inside = np.array([[contains((float(x), float(y), 0.0)) for x in self._x] for y in self._y])
        return float(self.wiped[inside].mean()) if inside.any() else 0.0

    def wipe(self, pose: Pose) -> None:
        """Wipe the cells whose centres are under the wiping face, nearer than the gap.

        Args:
            pose: of the wiping body's frame in W, within 45° of upright.
        """
        width, depth, height = (edge / 2.0 for edge in self.coating.face)
        mx, my, mz = to_world(pose, (0.0, 0.0, -height))
        ahead, aside = to_world(pose, (1.0, 0.0, -height)), to_world(pose, (0.0, 1.0, -height))
        ax, ay, az = ahead[0] - mx, ahead[1] - my, ahead[2] - mz
        bx, by, bz = aside[0] - mx, aside[1] - my, aside[2] - mz
        # Coordinates of each cell in the face: the cell is middle + a·ahead + b·aside in x and y.
        x, y, turn = self._x - mx, (self._y - my)[:, None], ax * by - ay * bx
        a = (by / turn) * x - (bx / turn) * y
        b = (ax / turn) * y - (ay / turn) * x
        near = mz + az * a + bz * b < self.coating.gap
        self.wiped |= (np.abs(a) < width) & (np.abs(b) < depth) & near

    def picture(self) -> NDArray[np.uint8]:
        """Draw the rectangle as cameras see it.

        Returns:
            A pixel for each cell (rows, columns, 3), 0 to 255.
        """
        picture: NDArray[np.uint8] = np.where(self.wiped[:, :, None], *self._colours)
        return picture
