"""Inspecting a table by a picture: dirt by its colour, what stands on it by depth, the sponge by both.

Nothing is asked of the simulator or of how the table was wiped: this is the second opinion.
Units: m.  Frame: W; the table's top is z = 0.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.bullet.world import Image
from aeros.sim.geometry import Camera, Triple
from aeros.sim.layouts.dirt import CELL
from aeros.sim.layouts.table import AREA, BIN, BIN_INNER, SPONGE
from aeros.sim.perception.detection import FACE, PIXELS_MIN, is_yellow, points_of

DARK: Final = 0.7
"""Share of the bare table's brightness, in the same light, below which a pixel of it shows dirt."""

STANDS_OUT: Final = (0.012, 0.30)
"""Heights between which something stands on the table, m: beneath is its top, above is the arm."""

LOOKED_AT: Final = ((0.22, -0.62), (0.75, 0.50))
"""Lowest and highest corner (x, y) of what is inspected, m: all of the table that the arm works on."""

BIN_MARGIN: Final = 0.015
"""What is this near to the inside of the bin is bin, m: its walls are 5 mm, and depth is a pixel off."""

SPONGE_REACH: Final = 0.08
"""What is this near to the sponge's middle belongs to it, m."""

Mask = NDArray[np.bool_]


class Inspection(NamedTuple):
    """What a picture of the table shows.

    sponge: where its middle is; None where none is seen lying flat.
    clean: share of the area's cells that are seen to be clean; what is hidden is not.
    others: pixels of whatever else stands on the table, outside the bin.
    """

    sponge: Triple | None
    clean: float
    others: int


def inspect_table(image: Image, camera: Camera) -> Inspection:
    """Inspect a picture in which the arm hides nothing."""
    points = points_of(image.depth, camera)
    x, y, z = (points[:, :, axis] for axis in range(3))
    rgb = image.rgb.astype(np.float64)
    standing = _within(x, y, *LOOKED_AT) & (z > STANDS_OUT[0]) & (z < STANDS_OUT[1])
    sponge = _sponge(points[standing & is_yellow(rgb)])
    others = standing & ~_in_bin(x, y)
    if sponge is not None:
        others &= np.hypot(x - sponge[0], y - sponge[1]) > SPONGE_REACH
    top = _within(x, y, *LOOKED_AT) & (np.abs(z) < STANDS_OUT[0])
    return Inspection(sponge, _clean(x, y, rgb[:, :, 0], top), int(others.sum()))


def _sponge(foam: NDArray[np.float64]) -> Triple | None:
    """The middle of a sponge that lies flat, by the points of its foam's top."""
    if len(foam) < PIXELS_MIN:
        return None
    face = foam[foam[:, 2] > foam[:, 2].max() - FACE]
    x, y = (face[:, :2].min(axis=0) + face[:, :2].max(axis=0)) / 2.0
    return (float(x), float(y), float(np.median(face[:, 2])) - SPONGE[2] / 2.0)


def _clean(x: NDArray[np.float64], y: NDArray[np.float64], red: NDArray[np.float64], top: Mask) -> float:
    """Share of the area's cells most of whose pixels are as bright as the table around it."""
    low, high = AREA
    inside = top & _within(x, y, low, high)
    outside = top & ~inside
    if not outside.any():
        return 0.0
    bright = red > DARK * np.median(red[outside])
    columns, rows = (round((b - a) / CELL) for a, b in zip(low, high, strict=True))
    column = np.clip(((x[inside] - low[0]) / CELL).astype(np.intp), 0, columns - 1)
    row = np.clip(((y[inside] - low[1]) / CELL).astype(np.intp), 0, rows - 1)
    cell = row * columns + column
    seen = np.bincount(cell, minlength=rows * columns)
    bright_ones = np.bincount(cell, weights=bright[inside], minlength=rows * columns)
    return float((bright_ones * 2.0 > seen).mean())


def _within(
    x: NDArray[np.float64], y: NDArray[np.float64], low: tuple[float, float], high: tuple[float, float]
) -> Mask:
    return (low[0] < x) & (x < high[0]) & (low[1] < y) & (y < high[1])


def _in_bin(x: NDArray[np.float64], y: NDArray[np.float64]) -> Mask:
    half = (BIN_INNER[0] / 2.0 + BIN_MARGIN, BIN_INNER[1] / 2.0 + BIN_MARGIN)
    return (np.abs(x - BIN[0]) < half[0]) & (np.abs(y - BIN[1]) < half[1])
