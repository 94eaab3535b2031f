"""Obstacles in a picture with depth: what stands in a volume, and no known thing explains.

Units: m. Frame: W.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, radians, tan
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.components import connected_components
from aeros.perception.planes import Plane
from aeros.perception.points import Mask, Points, Vector3, point_cloud
from aeros.perception.standing import erode, find_ground, heights_above, separate_parts

_SURFACE_WITHIN: Final = 0.05
"""Greatest distance of a surface from its declared height, m: a table that was set up otherwise."""

_SURFACE_TOLERANCE: Final = 0.012
"""Greatest distance of points on a surface from its plane, m: noise of 4 standard deviations at 3 mm."""

_LEAST_LEVEL: Final = 0.95
"""Least z of the normal of a surface that is level."""

_LEAST_SURFACE: Final = 500
"""Least number of pixels that show a surface."""

_OFF_SURFACE: Final = 0.03
"""Height over the surface from which a point is of something that stands there, m."""

_DEPTH_STEP: Final = 0.04
"""Difference in depth of neighbouring pixels that belong to two things, m."""

_LEAST_PIXELS: Final = 12
"""Least number of pixels of a thing, without its outermost ones: fewer are noise."""

_BEHIND: Final = 0.03
"""Distance behind a place from which what a picture shows is not at that place, m."""

_SHARES: Final = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
"""Places inside a box along x and y, as shares of its edge."""

_UPPER_SHARES: Final = np.array([0.5, 0.7, 0.9])
"""Places along z: lower ones are as near to the surface as depth is uncertain."""


class SpaceBox(NamedTuple):
    """A box along the axes of W.

    Attributes:
        lower: corner with the least coordinates, m.
        upper: corner with the greatest coordinates, m.
    """

    lower: Vector3
    upper: Vector3

    def grown(self, by: float) -> SpaceBox:
        """Enlarge the box.

        Args:
            by: distance by which each side moves out, m.

        Returns:
            The larger box.
        """
        (ax, ay, az), (bx, by_, bz) = self.lower, self.upper
        return SpaceBox((ax - by, ay - by, az - by), (bx + by, by_ + by, bz + by))

    def meets(self, other: SpaceBox) -> bool:
        """Compare with another box.

        Args:
            other: the other box.

        Returns:
            True if they have a point in common.
        """
        return all(
            a <= d and c <= b
            for a, b, c, d in zip(self.lower, self.upper, other.lower, other.upper, strict=True)
        )

    def joined(self, other: SpaceBox) -> SpaceBox:
        """Enclose two boxes.

        Args:
            other: the other box.

        Returns:
            The least box that holds both.
        """
        (ax, ay, az), (bx, by, bz) = self.lower, self.upper
        (cx, cy, cz), (dx, dy, dz) = other.lower, other.upper
        return SpaceBox((min(ax, cx), min(ay, cy), min(az, cz)), (max(bx, dx), max(by, dy), max(bz, dz)))


class KnownThings(NamedTuple):
    """Known things, which a picture may show and which are no obstacles.

    Attributes:
        objects: spaces that known objects take up.
        own: spaces that the robot, and what it holds, takes up.
        balls: centre and radius of balls that enclose its links, m.
        within: distance from a box or a ball within which a point belongs to it, m.
    """

    objects: Sequence[SpaceBox]
    own: Sequence[SpaceBox]
    balls: Sequence[tuple[Vector3, float]]
    within: float


class WatchedSpace(NamedTuple):
    """Volume to look in.

    Attributes:
        box: its corners.
        surface: height on which things stand there, m.
        least_height: height over the surface below which things are no obstacles, m.
        greatest_height: height over the surface above which things are no obstacles, m.
    """

    box: SpaceBox
    surface: float
    least_height: float
    greatest_height: float = inf


class DepthPicture(NamedTuple):
    """Depth of a picture, and the place from which it was taken.

    Attributes:
        depth: along the optical axis (height, width), m.
        eye: position of the camera, m.
        target: point that it looks at, m.
        up: direction that is up in the picture.
        field_of_view: vertical, degrees.
    """

    depth: NDArray[np.floating]
    eye: Vector3
    target: Vector3
    up: Vector3
    field_of_view: float


def depth_picture(
    depth: bytes,
    size: tuple[int, int],
    place: tuple[Vector3, Vector3, Vector3, float],
) -> DepthPicture:
    """Read a depth picture.

    Args:
        depth: of each pixel, row by row, m, as float32 in the machine's byte order.
        size: number of columns and rows, pixels.
        place: eye, target, up and field of view of the camera.

    Returns:
        The picture.
    """
    return DepthPicture(np.frombuffer(depth, np.float32).reshape(size[1], size[0]), *place)


def find_obstacles(
    picture: DepthPicture, spaces: Sequence[WatchedSpace], known: KnownThings
) -> list[SpaceBox]:
    """Find what stands in volumes and is not known.

    A box encloses each connected part of the picture, from its highest point down to the surface, as nobody
    sees through it. The surface is fitted where the picture shows it, so that neither a table at another
    height nor a camera that is turned a little makes an obstacle of it.

    Args:
        picture: the picture.
        spaces: the volumes.
        known: known things.

    Returns:
        The boxes, in the order of the volumes and of their first pixels; the uncertainty of the picture is
        not in them.
    """
    points, steps = point_cloud(*picture), _has_depth_step(picture.depth)
    return [box for space in spaces for box in _find_in(points, steps, space, known)]


def share_seen_free(picture: DepthPicture, box: SpaceBox) -> tuple[float, float]:
    """Look at the space of a box that held something before.

    Args:
        picture: the picture.
        box: the space.

    Returns:
        Share of the space that the picture shows, and share of that in which nothing is: the picture shows
        something behind it.
    """
    shares = (_SHARES, _SHARES, _UPPER_SHARES)
    axes = [a + (b - a) * one for a, b, one in zip(box.lower, box.upper, shares, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    rows, columns, distance = _project(picture, places)
    height, width = picture.depth.shape
    inside = (distance > 0.0) & (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    if not inside.any():
        return 0.0, 0.0
    beyond = picture.depth[rows[inside], columns[inside]] - distance[inside]
    # A thing that is nearer to the camera by more than the box is thick hides the space.
    thick = float(np.linalg.norm(np.subtract(box.upper, box.lower)))
    shown = beyond > -thick
    if not shown.any():
        return 0.0, 0.0
    return float(shown.sum()) / len(places), float((beyond[shown] > _BEHIND).mean())


def _find_in(points: Points, steps: Mask, space: WatchedSpace, known: KnownThings) -> Iterator[SpaceBox]:
    z = points[:, :, 2]
    over = np.ones(z.shape, np.bool_)
    for axis in (0, 1):
        place = points[:, :, axis]
        over &= (place >= space.box.lower[axis]) & (place <= space.box.upper[axis])
    plane = _find_surface(points[over & (np.abs(z - space.surface) <= _SURFACE_WITHIN)], space.surface)
    heights = heights_above(points, plane)
    mask = over & (heights > _OFF_SURFACE) & (z <= space.box.upper[2])
    mask[mask] = ~_is_own(points[mask], known)
    mask &= ~steps
    unknown = mask.copy()
    unknown[mask] = ~_is_in_any(points[mask], known.objects, known.within)
    for core in separate_parts(erode(unknown), _LEAST_PIXELS):
        top = float(heights[core].max())
        if not space.least_height <= top <= space.greatest_height:
            continue
        part = _whole(core, mask & (heights >= max(top / 2.0, float(heights[core].min()))))
        of_part = points[part]
        (ax, ay, _), (bx, by, bz) = of_part.min(axis=0).tolist(), of_part.max(axis=0).tolist()
        yield SpaceBox(
            (ax, ay, min(space.surface, plane.height_at((ax + bx) / 2, (ay + by) / 2))), (bx, by, bz)
        )


def _whole(core: Mask, high: Mask) -> Mask:
    """Add to the unknown part of a thing what is connected with it and about as high.

    A known object beside it is smaller than its declared space, and must hide nothing of the thing.
    """
    labels, _ = connected_components(core | high)
    return np.isin(labels, np.unique(labels[core]))


def _find_surface(near: Points, height: float) -> Plane:
    """Fit the surface to the points near its declared height; the declared one if they show none."""
    declared = Plane((0.0, 0.0, height), (0.0, 0.0, 1.0), 0.0)
    found = find_ground(near, _SURFACE_TOLERANCE, _LEAST_SURFACE)
    return declared if found is None or found.normal[2] < _LEAST_LEVEL else found


def _is_own(points: Points, known: KnownThings) -> Mask:
    """Return the mask (n,) of the points that are of the robot."""
    found = _is_in_any(points, known.own, known.within)
    for centre, radius in known.balls:
        off = points - np.array(centre)
        found |= np.einsum("ij,ij->i", off, off) <= (radius + known.within) ** 2
    return found


def _is_in_any(points: Points, boxes: Sequence[SpaceBox], within: float) -> Mask:
    """Return the mask (n,) of the points that are near one of the boxes."""
    found = np.zeros(len(points), np.bool_)
    for box in boxes:
        lower, upper = box.grown(within)
        found |= ((points >= lower) & (points <= upper)).all(axis=1)
    return found


def _has_depth_step(depth: NDArray[np.floating]) -> Mask:
    """Return the pixels beside which something else is nearer or farther."""
    steps = np.zeros(depth.shape, np.bool_)
    down = np.abs(np.diff(depth, axis=0)) > _DEPTH_STEP
    right = np.abs(np.diff(depth, axis=1)) > _DEPTH_STEP
    steps[1:] |= down
    steps[:, 1:] |= right
    return steps


def _project(
    picture: DepthPicture, places: Points
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Return row, column and depth of places (n, 3); the inverse of `point_cloud`."""
    height, width = picture.depth.shape
    forward = np.subtract(picture.target, picture.eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, picture.up)
    right = right / np.linalg.norm(right)
    off = places - np.array(picture.eye)
    distance = off @ forward
    ahead = np.maximum(distance, 1e-6)
    half = tan(radians(picture.field_of_view) / 2.0)
    x, y = off @ right / ahead / half, off @ np.cross(right, forward) / ahead / half
    columns = np.rint((x * height / width + 1.0) * width / 2.0)
    rows = np.rint((1.0 - y) * height / 2.0 - 1.0)
    return rows.astype(np.intp), columns.astype(np.intp), distance
