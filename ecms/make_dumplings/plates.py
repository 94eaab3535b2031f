"""Plates of a wrapper: the plane through its points, the rectangle around them, and the wrapper of both.

The fold is the angle of the planes of both plates.
"""

from math import acos, atan2, cos, dist, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from aeros.perception import Points, Rectangle, min_area_rectangle, trim_to_plane, wrap_heading

from .measures import CLOSED_HEIGHT, HINGE_TO_PLATE, MIN_PIXELS, PLATE_HALF, SAME_SIZE
from .wrappers import Wrapper

SIZES = (0.8, 1.3)
"""Least and greatest size of a wrapper over the usual one."""

SQUARELY = 0.12
"""Greatest difference of the ratio of its sides from that of a plate, as a share, where all of it shows."""

LEVEL = 0.95
"""Least vertical part of the normal of a plate that does not look too short."""

MIN_VISIBLE_AREA = 0.6
"""Least visible share of a plate's area at which its rectangle locates the plate."""

EDGE_ON_WIDTH = 0.015
"""Width of a plate's rectangle below which it stands on its edge, m."""

PLANE_TOLERANCE = 0.003
"""Greatest distance of a plate's points from its plane, m; farther ones are on its sides."""


class Plate(NamedTuple):
    """A plate: its points, the rectangle around them, the height of its middle, and its normal."""

    points: Points
    rectangle: Rectangle
    height: float
    normal: tuple[float, float, float]

    @property
    def is_mostly_visible(self) -> bool:
        """True if its rectangle locates it."""
        whole = 4.0 * PLATE_HALF[0] * PLATE_HALF[1]
        return self.rectangle.length * self.rectangle.width > MIN_VISIBLE_AREA * whole

    @property
    def scale(self) -> float | None:
        """Its size over the usual one; None unless all of it shows."""
        sides = (self.rectangle.length, self.rectangle.width)
        length, width = max(sides) / (2.0 * PLATE_HALF[1]), min(sides) / (2.0 * PLATE_HALF[0])
        if abs(self.normal[2]) < LEVEL or not 1.0 - SQUARELY < width / length < 1.0 + SQUARELY:
            return None
        scale = sqrt(length * width)
        if not SIZES[0] < scale < SIZES[1]:
            return None
        return 1.0 if abs(scale - 1.0) < SAME_SIZE else scale

    @property
    def is_on_edge(self) -> bool:
        """True if it stands on its edge."""
        return min(self.rectangle.length, self.rectangle.width) < EDGE_ON_WIDTH


def fit_plate(points: Points) -> Plate | None:
    """Fit a plate to points, without the points on its sides."""
    if len(points) < MIN_PIXELS:
        return None
    plane, face = trim_to_plane(points, PLANE_TOLERANCE, MIN_PIXELS)
    around = min_area_rectangle(face[:, :2])
    return Plate(face, around, plane.height_at(around.x, around.y), plane.normal)


def wrapper_of_plates(a: Plate | None, b: Plate | None) -> Wrapper | None:
    """Estimate a wrapper from what shows of its plates: of a plate that is hidden, its size is not known."""
    scales = [one.scale for one in (a, b) if one is not None and one.scale is not None]
    scale = sum(scales) / len(scales) if scales else None
    wrapper = _wrapper_of_size(a, b, scale or 1.0)
    return None if wrapper is None else wrapper.scaled(scale)


def _wrapper_of_size(a: Plate | None, b: Plate | None, size: float) -> Wrapper | None:
    if a is not None and b is not None and covers(b, a):
        a = None
    if a is None:
        return None if b is None else wrapper_from_one_plate(b, CLOSED_HEIGHT, size, is_closed=True)
    if b is None:
        return wrapper_from_one_plate(a, PLATE_HALF[2], size, is_closed=False)
    if a.is_on_edge or b.is_on_edge:
        return wrapper_on_edge(a, b)
    away = (a.rectangle.x - b.rectangle.x, a.rectangle.y - b.rectangle.y)
    best = a if a.is_mostly_visible else b
    # The sides of a tilted plate look too short; the line between the plates is across the hinge.
    across_hinge = atan2(away[1], away[0])
    heading = across_hinge + wrap_heading(best.rectangle.heading - across_hinge, pi / 2.0)
    way, side = np.array((cos(heading), sin(heading))), np.array((-sin(heading), cos(heading)))
    near, far = float((a.points[:, :2] @ way).min()), float((b.points[:, :2] @ way).max())
    visible = best.points if best.is_mostly_visible else np.concatenate((a.points, b.points))
    across = visible[:, :2] @ side
    u, v = (near + far) / 2.0, float(across.min() + across.max()) / 2.0
    x, y = (u * way + v * side).tolist()
    fold = acos(max(-1.0, min(1.0, sum(p * q for p, q in zip(a.normal, b.normal, strict=True)))))
    return Wrapper((x, y, a.height - PLATE_HALF[2] * size), wrap_heading(heading, 2.0 * pi), fold)


def covers(b: Plate, a: Plate) -> bool:
    """Return True if plate B hides plate A but for its edges, as when they are folded together."""
    apart = dist((a.rectangle.x, a.rectangle.y), (b.rectangle.x, b.rectangle.y))
    return b.is_mostly_visible and b.height - a.height > HINGE_TO_PLATE / 2.0 and apart < PLATE_HALF[1]


def wrapper_from_one_plate(plate: Plate, above: float, size: float, *, is_closed: bool) -> Wrapper:
    """Estimate the wrapper from the only visible plate: the upper one if closed, the lower one if open."""
    if plate.is_on_edge:
        return wrapper_on_edge(plate, plate)
    heading = plate.rectangle.shorter_heading
    if cos(heading) < 0.0:
        heading += pi
    x = plate.rectangle.x - HINGE_TO_PLATE * size * cos(heading)
    y = plate.rectangle.y - HINGE_TO_PLATE * size * sin(heading)
    tilt = acos(min(1.0, abs(plate.normal[2])))
    fold = pi - tilt if is_closed else 0.0
    return Wrapper((x, y, plate.height - above * size), wrap_heading(heading, 2.0 * pi), fold)


def wrapper_on_edge(a: Plate, b: Plate) -> Wrapper:
    """Estimate a wrapper on its edge: its middle is half as high as its top; its fold is not visible."""
    away = (a.rectangle.x - b.rectangle.x, a.rectangle.y - b.rectangle.y)
    are_apart = dist(away, (0.0, 0.0)) > PLATE_HALF[0] / 2.0
    heading = atan2(away[1], away[0]) if are_apart else a.rectangle.shorter_heading
    top = max(float(plate.points[:, 2].max()) for plate in (a, b))
    middle = ((a.rectangle.x + b.rectangle.x) / 2.0, (a.rectangle.y + b.rectangle.y) / 2.0, top / 2.0)
    return Wrapper(middle, wrap_heading(heading, 2.0 * pi), None)
