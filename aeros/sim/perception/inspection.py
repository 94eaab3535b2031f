"""Inspect a table in a picture: dirt by colour, standing objects by depth, the sponge by both.

Neither the simulator's state nor the wiping is used: this is a second opinion.
Units: m. Frame: W; the table's top is z = 0.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.rectangles import top_points
from aeros.sim.bullet.renderer import Image
from aeros.sim.geometry import Camera, Vector3
from aeros.sim.layouts.table import BIN, BIN_INNER, CELL_SIZE, SPONGE_SIZE, WIPING_AREA
from aeros.sim.perception.detection import MIN_PIXELS, camera_points, is_yellow

DIRT_BRIGHTNESS: Final = 0.7
"""Share of the bare table's brightness below which a pixel shows dirt."""

OBJECT_HEIGHTS: Final = (0.012, 0.30)
"""Height range of objects on the table, m: below is its top, above is the arm."""

INSPECTED_AREA: Final = ((0.22, -0.62), (0.75, 0.50))
"""Lowest and highest corner (x, y) of the inspected area, m: all of the table that the arm works on."""

BIN_MARGIN: Final = 0.015
"""Margin around the inside of the bin that belongs to the bin, m: its walls are 5 mm, and depth is a pixel
off."""

SPONGE_RADIUS: Final = 0.08
"""Radius around the sponge's middle that belongs to the sponge, m."""

Mask = NDArray[np.bool_]


class Inspection(NamedTuple):
    """Result of inspecting a picture of the table.

    Attributes:
        sponge: its middle in W, m; None if none is visible lying flat.
        clean_share: share of the area's cells that are visibly clean, in [0, 1]; hidden cells do not count
            as clean.
        other_pixels: pixels of any other object on the table, outside the bin.
    """

    sponge: Vector3 | None
    clean_share: float
    other_pixels: int


def inspect_table(image: Image, camera: Camera) -> Inspection:
    """Inspect a picture in which the arm hides nothing.

    Args:
        image: the picture.
        camera: that took it.

    Returns:
        The result.
    """
    points = camera_points(image.depth, camera)
    x, y, z = (points[:, :, axis] for axis in range(3))
    rgb = image.rgb.astype(np.float64)
    standing = _in_rectangle(x, y, *INSPECTED_AREA) & (z > OBJECT_HEIGHTS[0]) & (z < OBJECT_HEIGHTS[1])
    sponge = _sponge(points[standing & is_yellow(rgb)])
    other_objects = standing & ~_in_bin(x, y)
    if sponge is not None:
        other_objects &= np.hypot(x - sponge[0], y - sponge[1]) > SPONGE_RADIUS
    top = _in_rectangle(x, y, *INSPECTED_AREA) & (np.abs(z) < OBJECT_HEIGHTS[0])
    return Inspection(sponge, _clean(x, y, rgb[:, :, 0], top), int(other_objects.sum()))


def _sponge(foam: NDArray[np.float64]) -> Vector3 | None:
    """Return the middle of a sponge that lies flat, from the points on its foam's top."""
    if len(foam) < MIN_PIXELS:
        return None
    face = top_points(foam)
    x, y = (face[:, :2].min(axis=0) + face[:, :2].max(axis=0)) / 2.0
    return (float(x), float(y), float(np.median(face[:, 2])) - SPONGE_SIZE[2] / 2.0)


def _clean(x: NDArray[np.float64], y: NDArray[np.float64], red: NDArray[np.float64], top: Mask) -> float:
    """Return the share of the area's cells with most pixels as bright as the table around the area."""
    low, high = WIPING_AREA
    inside = top & _in_rectangle(x, y, low, high)
    outside = top & ~inside
    if not outside.any():
        return 0.0
    bright = red > DIRT_BRIGHTNESS * np.median(red[outside])
    columns, rows = (round((b - a) / CELL_SIZE) for a, b in zip(low, high, strict=True))
    column = np.clip(((x[inside] - low[0]) / CELL_SIZE).astype(np.intp), 0, columns - 1)
    row = np.clip(((y[inside] - low[1]) / CELL_SIZE).astype(np.intp), 0, rows - 1)
    cell = row * columns + column
    seen = np.bincount(cell, minlength=rows * columns)
    bright_ones = np.bincount(cell, weights=bright[inside], minlength=rows * columns)
    return float((bright_ones * 2.0 > seen).mean())


def _in_rectangle(
    x: NDArray[np.float64], y: NDArray[np.float64], low: tuple[float, float], high: tuple[float, float]
) -> Mask:
    return (low[0] < x) & (x < high[0]) & (low[1] < y) & (y < high[1])


def _in_bin(x: NDArray[np.float64], y: NDArray[np.float64]) -> Mask:
    half = (BIN_INNER[0] / 2.0 + BIN_MARGIN, BIN_INNER[1] / 2.0 + BIN_MARGIN)
    return (np.abs(x - BIN[0]) < half[0]) & (np.abs(y - BIN[1]) < half[1])
