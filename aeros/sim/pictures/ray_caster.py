"""Colour and depth of a camera, by a ray for each pixel: light from everywhere and from above, no shadows.

A pixel shows what the ray through its lower left corner meets, as in all pictures of the project. A ray
enters a convex solid where it has entered the half-space of every face. Units: m. Frame: W.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import hypot, radians, tan
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.geometry import Camera, Pose, Quaternion, Vector3, compose, to_world
from aeros.sim.pictures.solids import Array, Solid

_AMBIENT: Final = 0.6
"""Share of light that comes from everywhere; the rest comes from the light, as it falls on a surface."""

_LIGHT: Final = np.array((0.35, -0.25, 0.9)) / hypot(0.35, -0.25, 0.9)
"""Direction to the light."""

_BACKGROUND: Final = (255, 255, 255)

_PARALLEL: Final = 1e-12
"""Least cosine between a ray and a face's normal at which the ray meets its plane."""


class PlacedSolid(NamedTuple):
    """A solid in W.

    Attributes:
        solid: the solid.
        middle: position of its middle, m.
        axes: its axes (3, 3), one in each column.
    """

    solid: Solid
    middle: Vector3
    axes: Array


def place(solid: Solid, body: Pose) -> PlacedSolid:
    """Place a solid with its body.

    Args:
        solid: the solid.
        body: pose of its body in W.

    Returns:
        The solid in W.
    """
    at = compose(body, solid.place)
    return PlacedSolid(solid, at.position, axes_of(at.orientation))


def axes_of(orientation: Quaternion) -> Array:
    """Compute the rotation matrix of an orientation.

    Args:
        orientation: unit quaternion (x, y, z, w).

    Returns:
        The axes of the turned frame (3, 3), one in each column.
    """
    frame = Pose((0.0, 0.0, 0.0), orientation)
    ends: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return np.array([to_world(frame, end) for end in ends]).T


class Decal(NamedTuple):
    """A picture on a level rectangle.

    Attributes:
        low: corner with the least x and y in W, m.
        high: corner with the greatest x and y in W, m.
        height: of the rectangle in W, m.
        pixels: (rows, columns, 3), 0 to 255; rows from the least y, columns from the least x.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    height: float
    pixels: NDArray[np.uint8]


_DECAL_TOLERANCE: Final = 1e-4
"""Greatest distance of a point from a decal's plane at which it is on it, m."""


def cast(
    camera: Camera, solids: Iterable[PlacedSolid], decals: Sequence[Decal] = ()
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Take a picture.

    Args:
        camera: in W.
        solids: what there is to see.
        decals: pictures on surfaces.

    Returns:
        Colours (height, width, 3), 0 to 255, and depth along the optical axis (height, width), m; the
        camera's `far` where nothing is.
    """
    rays, axes, spans = _rays(camera)
    depth = np.full((camera.height, camera.width), camera.far)
    colours = np.full((camera.height, camera.width, 3), _BACKGROUND, dtype=np.uint8)
    eye = np.array(camera.eye)
    for placed in solids:
        window = _window(placed, eye, axes, spans, camera)
        if window is None:
            continue
        seen = rays[window]
        entry, shade = _meet(placed, eye, seen)
        nearer = (entry > camera.near) & (entry < depth[window])
        depth[window] = np.where(nearer, entry, depth[window])
        colour = np.array(placed.solid.colour) * 255.0
        lit = (shade[nearer][:, None] * colour).round().astype(np.uint8)
        colours[window][nearer] = lit
    for decal in decals:
        _paint(decal, eye, rays, depth, colours)
    return colours, depth.astype(np.float32)


def _rays(camera: Camera) -> tuple[Array, Array, tuple[float, float]]:
    """Return each pixel's ray, of depth 1; the camera's axes; and half its width and height at depth 1."""
    forward = np.array(camera.target) - np.array(camera.eye)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.array(camera.up))
    right /= np.linalg.norm(right)
    upward = np.cross(right, forward)
    half = tan(radians(camera.field_of_view) / 2.0)
    wide = half * camera.width / camera.height
    x = (2.0 * np.arange(camera.width) / camera.width - 1.0) * wide
    y = (1.0 - 2.0 * (np.arange(camera.height) + 1.0) / camera.height) * half
    rays = forward + x[None, :, None] * right + y[:, None, None] * upward
    return rays, np.array((forward, right, upward)), (wide, half)


def _window(
    placed: PlacedSolid, eye: Array, axes: Array, spans: tuple[float, float], camera: Camera
) -> tuple[slice, slice] | None:
    """Return rows and columns in which the solid may be seen; None if it is behind the camera."""
    middle = np.array(placed.middle) - eye
    along, x, y = (float(part) for part in axes @ middle)
    radius = placed.solid.radius
    if along + radius <= camera.near or along - radius >= camera.far:
        return None
    if along - radius <= camera.near:
        return slice(0, camera.height), slice(0, camera.width)
    # The ball is between the planes at its nearest and farthest depth.
    depths = (along - radius, along + radius)
    (left, *_, right), (low, *_, high) = (
        sorted((at + side * radius) / depth for side in (-1, 1) for depth in depths) for at in (x, y)
    )
    wide, half = spans
    columns = [round((at / wide + 1.0) / 2.0 * camera.width) for at in (left, right)]
    rows = [round((1.0 - at / half) / 2.0 * camera.height) for at in (high, low)]
    first_column, end_column = max(0, columns[0] - 1), min(camera.width, columns[1] + 2)
    first_row, end_row = max(0, rows[0] - 2), min(camera.height, rows[1] + 2)
    if first_column >= end_column or first_row >= end_row:
        return None
    return slice(first_row, end_row), slice(first_column, end_column)


def _meet(placed: PlacedSolid, eye: Array, rays: Array) -> tuple[Array, Array]:
    """Return the depth at which each ray enters a solid, infinite where it does not, and its light there."""
    solid, turn = placed.solid, placed.axes
    origin, ways = (eye - np.array(placed.middle)) @ turn, rays @ turn
    if not len(solid.normals):
        return _meet_sphere(solid.radius, origin, ways, turn)
    entry = np.full(rays.shape[:2], -np.inf)
    leave = np.full(rays.shape[:2], np.inf)
    face = np.zeros(rays.shape[:2], dtype=np.intp)
    for number, (normal, offset) in enumerate(zip(solid.normals, solid.offsets, strict=True)):
        towards = ways @ normal
        outside = float(origin @ normal - offset)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = -outside / towards
        enters, leaves = towards < -_PARALLEL, towards > _PARALLEL
        later = enters & (at > entry)
        entry, face = np.where(later, at, entry), np.where(later, number, face)
        leave = np.where(leaves & (at < leave), at, leave)
        if outside > 0.0:
            leave = np.where(~enters & ~leaves, -np.inf, leave)
    light = _AMBIENT + (1.0 - _AMBIENT) * np.maximum(0.0, (solid.normals @ turn.T) @ _LIGHT)
    return np.where((entry <= leave) & (entry > -np.inf), entry, np.inf), light[face]


def _meet_sphere(radius: float, origin: Array, ways: Array, turn: Array) -> tuple[Array, Array]:
    squared, half = (ways**2).sum(axis=2), ways @ origin
    root = half**2 - squared * float(origin @ origin - radius**2)
    with np.errstate(invalid="ignore"):
        at = (-half - np.sqrt(root)) / squared
    entry = np.where(root >= 0.0, at, np.inf)
    normals = (origin + np.where(np.isfinite(entry), entry, 0.0)[:, :, None] * ways) / radius
    light = _AMBIENT + (1.0 - _AMBIENT) * np.clip((normals @ turn.T) @ _LIGHT, 0.0, 1.0)
    return entry, light


def _paint(decal: Decal, eye: Array, rays: Array, depth: Array, colours: NDArray[np.uint8]) -> None:
    points = eye + depth[:, :, None] * rays
    rows, columns = decal.pixels.shape[:2]
    (x0, y0), (x1, y1) = decal.low, decal.high
    column = np.floor((points[:, :, 0] - x0) / (x1 - x0) * columns)
    row = np.floor((points[:, :, 1] - y0) / (y1 - y0) * rows)
    on = (np.abs(points[:, :, 2] - decal.height) < _DECAL_TOLERANCE) & (column >= 0) & (column < columns)
    on &= (row >= 0) & (row < rows)
    light = _AMBIENT + (1.0 - _AMBIENT) * float(_LIGHT[2])
    lit = (decal.pixels.astype(np.float64) * light).round().astype(np.uint8)
    colours[on] = lit[row[on].astype(np.intp), column[on].astype(np.intp)]
