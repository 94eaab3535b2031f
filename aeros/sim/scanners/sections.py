"""Level sections of solids, and rays in their plane that meet them. Frame: W. Units: m."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.pictures.ray_caster import PlacedSolid
from aeros.sim.scanners.ray_fan import Array, RayFan

_PARALLEL: Final = 1e-12
"""Least cosine between a ray and an edge's normal at which the ray meets its line."""

_LEVEL: Final = 1e-9
"""Length of a normal's level part up to which its face is level."""


class Disc(NamedTuple):
    """A disc.

    Attributes:
        x: position of its middle, m.
        y: position of its middle, m.
        radius: m.
    """

    x: float
    y: float
    radius: float


class Polygon(NamedTuple):
    """A convex polygon as the half-planes n·p <= offset.

    Attributes:
        x: position of the middle of a disc that encloses it, m.
        y: position of that middle, m.
        radius: of that disc, m.
        normals: outward unit normals of its edges (k, 2).
        offsets: distance of each edge from the origin of W along its normal (k,), m.
    """

    x: float
    y: float
    radius: float
    normals: Array
    offsets: Array


Section = Disc | Polygon


def rectangle(low: tuple[float, float], high: tuple[float, float]) -> Polygon:
    """Make a rectangle along the axes of W.

    Args:
        low: its corner with the least x and y, m.
        high: its corner with the greatest x and y, m.

    Returns:
        The rectangle.
    """
    (x0, y0), (x1, y1) = low, high
    normals = np.array(((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)))
    middle = ((x0 + x1) / 2.0, (y0 + y1) / 2.0)
    return Polygon(*middle, hypot(x1 - x0, y1 - y0) / 2.0, normals, np.array((x1, -x0, y1, -y0)))


def cut(placed: PlacedSolid, height: float) -> Section | None:
    """Cut a solid with a level plane.

    Args:
        placed: the solid in W.
        height: of the plane in W, m.

    Returns:
        The section; None if the plane does not meet the ball that encloses the solid, or passes above or
        below all of its level faces.
    """
    x, y, z = placed.middle
    solid, above = placed.solid, height - z
    if abs(above) >= solid.radius:
        return None
    radius = sqrt(solid.radius**2 - above**2)
    if not len(solid.normals):
        return Disc(x, y, radius)
    normals = solid.normals @ placed.axes.T
    offsets = solid.offsets - normals[:, 2] * above
    lengths = np.hypot(normals[:, 0], normals[:, 1])
    level = lengths < _LEVEL
    if (offsets[level] <= 0.0).any():
        return None
    edges = normals[~level, :2] / lengths[~level, None]
    return Polygon(x, y, radius, edges, offsets[~level] / lengths[~level] + edges @ np.array((x, y)))


def cast(fan: RayFan, ranges: Array, sections: Iterable[Section]) -> Array:
    """Shorten rays to where they enter something.

    A ray that starts inside a section is not shortened by it.

    Args:
        fan: the rays.
        ranges: length of each ray (n,), m.
        sections: what there is in the plane.

    Returns:
        The shortened lengths (n,), m.
    """
    ranges = ranges.copy()
    dx, dy = fan.directions.T
    for section in sections:
        x, y, radius, *_ = section
        across = x * dy - y * dx - fan.cross_products
        near = np.flatnonzero(np.abs(across) <= radius)
        along = x * dx[near] + y * dy[near] - fan.dot_products[near]
        ahead = (along > -radius) & (along - radius < ranges[near])
        near, along = near[ahead], along[ahead]
        if not len(near):
            continue
        entry = along - np.sqrt(np.maximum(radius**2 - across[near] ** 2, 0.0))
        if isinstance(section, Polygon):
            entry = _enter(fan, near, section)
        hit = (entry > 0.0) & (entry < ranges[near])
        ranges[near[hit]] = entry[hit]
    return ranges


def _enter(fan: RayFan, rays: NDArray[np.intp], polygon: Polygon) -> Array:
    """Return the way to where each ray enters a polygon; infinite where it does not."""
    towards = polygon.normals @ fan.directions[rays].T
    outside = polygon.normals @ fan.origins[rays].T - polygon.offsets[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -outside / towards
    entry = np.where(towards < -_PARALLEL, at, -np.inf).max(axis=0)
    leave = np.where(towards > _PARALLEL, at, np.inf).min(axis=0)
    missed = ((np.abs(towards) <= _PARALLEL) & (outside > 0.0)).any(axis=0)
    found: Array = np.where((entry <= leave) & ~missed, entry, np.inf)
    return found
