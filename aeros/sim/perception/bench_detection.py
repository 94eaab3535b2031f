"""Detect wrapper and filling on a dumpling bench in pictures: plates by colour, fold by their planes.

The simulator's state is not used. From above, a plate is the plane through its points and the rectangle
around them. From the side, what shows between the plates is in the dumpling.
Units: m, rad. Frame: W.
"""

from __future__ import annotations

from math import acos, atan2, cos, dist, pi, sin
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.colours import has_dominant_colour, has_red_ratios
from aeros.perception.planes import trim_to_plane
from aeros.perception.rectangles import Rectangle, min_area_rectangle, top_face, wrap_heading
from aeros.sim.bullet.renderer import Image
from aeros.sim.geometry import Camera, Vector3
from aeros.sim.layouts.dumpling_bench import (
    CLOSED_HEIGHT,
    FILLING,
    HINGE_TO_PLATE,
    PLATE_HALF,
    WrapperDetection,
)
from aeros.sim.perception.detection import MIN_BRIGHTNESS, MIN_PIXELS, camera_points

MAX_OBJECT_HEIGHT: Final = 0.20
"""Greatest height of an object on the bench, m: above it is the arm."""

PLATE_A_COLOUR: Final = ((0.75, 1.1), 0.5)
"""Colour of plate A: bounds of green over red, and upper bound of blue over red."""

PLATE_B_COLOUR: Final = ((0.42, 0.72), 0.4)
"""Colour of plate B, likewise."""

GREEN_DOMINANCE: Final = 1.3
"""Least ratio of green to red and to blue in a pixel of the filling."""

MIN_VISIBLE_AREA: Final = 0.6
"""Least visible share of a plate's area at which its rectangle locates the plate."""

EDGE_ON_WIDTH: Final = 0.015
"""Width of a plate's rectangle below which it stands on its edge, m."""

PLANE_TOLERANCE: Final = 0.003
"""Greatest distance of a plate's points from its plane, m; farther ones are on its sides."""

MIN_FILLING_PIXELS: Final = 6
"""Least number of pixels of the filling between the plates of a filled wrapper."""

Points = NDArray[np.float64]


class BenchDetection(NamedTuple):
    """Objects in a picture from above.

    Attributes:
        wrapper: the wrapper; None if it is not visible.
        filling: middle of the filling in W, m; None if it is not visible.
    """

    wrapper: WrapperDetection | None
    filling: Vector3 | None


class _Plate(NamedTuple):
    """A plate: its points, the rectangle around them, the height of its middle, and its normal."""

    points: Points
    rectangle: Rectangle
    height: float
    normal: tuple[float, float, float]

    @property
    def is_mostly_visible(self) -> bool:
        return (
            self.rectangle.length * self.rectangle.width
            > MIN_VISIBLE_AREA * 4.0 * PLATE_HALF[0] * PLATE_HALF[1]
        )

    @property
    def is_on_edge(self) -> bool:
        return min(self.rectangle.length, self.rectangle.width) < EDGE_ON_WIDTH

    @property
    def heading(self) -> float:
        """Heading of the plate's short side, which is across its hinge, rad; ambiguous by π."""
        across = self.rectangle.length > self.rectangle.width
        return self.rectangle.heading + (pi / 2.0 if across else 0.0)

    @property
    def tilt(self) -> float:
        return acos(min(1.0, abs(self.normal[2])))


def detect_bench(image: Image, camera: Camera) -> BenchDetection:
    """Detect the objects in a picture from above in which the arm hides nothing.

    Args:
        image: the picture.
        camera: that took it.

    Returns:
        The detections, in W.
    """
    points, dough, glazed, green = _colour_masks(image, camera)
    a, b = _plate(points[dough]), _plate(points[glazed])
    return BenchDetection(_wrapper(a, b), _filling(points[green]))


def is_filling_visible(image: Image, camera: Camera, wrapper: WrapperDetection) -> bool:
    """Look for filling at a closed wrapper, in a side picture.

    Args:
        image: the picture.
        camera: that took it.
        wrapper: the wrapper as seen from above.

    Returns:
        True if filling shows between the plates, and none outside.
    """
    points, _, _, green = _colour_masks(image, camera)
    x, y, z = wrapper.hinge
    away = points[green] - np.array((x, y, z))
    along = away[:, 0] * cos(wrapper.yaw) + away[:, 1] * sin(wrapper.yaw)
    across = away[:, 1] * cos(wrapper.yaw) - away[:, 0] * sin(wrapper.yaw)
    near = (along > -0.01) & (along < 2.0 * HINGE_TO_PLATE + 0.01) & (np.abs(across) < PLATE_HALF[1] + 0.01)
    between = near & (away[:, 2] > 0.0) & (away[:, 2] < CLOSED_HEIGHT)
    inside = (along < HINGE_TO_PLATE + PLATE_HALF[0]) & (np.abs(across) < PLATE_HALF[1])
    return int((between & inside).sum()) >= MIN_FILLING_PIXELS and not bool((between & ~inside).any())


def _colour_masks(
    image: Image, camera: Camera
) -> tuple[Points, NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the points of the picture, and masks of those on plate A, on plate B and on the filling."""
    points = camera_points(image.depth, camera).reshape(-1, 3)
    rgb = image.rgb.reshape(-1, 3)
    low = points[:, 2] < MAX_OBJECT_HEIGHT
    plates = [
        low & has_red_ratios(rgb, green, (None, bluest), MIN_BRIGHTNESS)
        for green, bluest in (PLATE_A_COLOUR, PLATE_B_COLOUR)
    ]
    return points, plates[0], plates[1], low & has_dominant_colour(rgb, 1, GREEN_DOMINANCE, 0.0)


def _plate(points: Points) -> _Plate | None:
    """Fit a plate to points, without the points on its sides."""
    if len(points) < MIN_PIXELS:
        return None
    plane, face = trim_to_plane(points, PLANE_TOLERANCE, MIN_PIXELS)
    around = min_area_rectangle(face[:, :2])
    return _Plate(face, around, plane.height_at(around.x, around.y), plane.normal)


def _wrapper(a: _Plate | None, b: _Plate | None) -> WrapperDetection | None:
    if a is not None and b is not None and _covers(b, a):
        a = None
    if a is None:
        return None if b is None else _wrapper_from_one_plate(b, CLOSED_HEIGHT, closed=True)
    if b is None:
        return _wrapper_from_one_plate(a, PLATE_HALF[2], closed=False)
    if a.is_on_edge or b.is_on_edge:
        return _wrapper_on_edge(a, b)
    away = (a.rectangle.x - b.rectangle.x, a.rectangle.y - b.rectangle.y)
    best = a if a.is_mostly_visible else b
    # The sides of a tilted plate look too short; the line between the plates is across the hinge.
    across_hinge = atan2(away[1], away[0])
    heading = across_hinge + wrap_heading(best.rectangle.heading - across_hinge, pi / 2.0)
    way, side = np.array((cos(heading), sin(heading))), np.array((-sin(heading), cos(heading)))
    near, far = float((a.points[:, :2] @ way).min()), float((b.points[:, :2] @ way).max())
    visible_points = best.points if best.is_mostly_visible else np.concatenate((a.points, b.points))
    across = visible_points[:, :2] @ side
    u, v = (near + far) / 2.0, float(across.min() + across.max()) / 2.0
    x, y = u * way + v * side
    fold = acos(max(-1.0, min(1.0, sum(p * q for p, q in zip(a.normal, b.normal, strict=True)))))
    return WrapperDetection(
        (float(x), float(y), a.height - PLATE_HALF[2]), wrap_heading(heading, 2.0 * pi), fold
    )


def _covers(b: _Plate, a: _Plate) -> bool:
    """Return True if plate B hides plate A but for its edges, as when they are folded together."""
    apart = dist((a.rectangle.x, a.rectangle.y), (b.rectangle.x, b.rectangle.y))
    return b.is_mostly_visible and b.height - a.height > HINGE_TO_PLATE / 2.0 and apart < PLATE_HALF[1]


def _wrapper_from_one_plate(plate: _Plate, above: float, *, closed: bool) -> WrapperDetection:
    """Estimate the wrapper from the only visible plate: the upper one if closed, the lower one if open."""
    if plate.is_on_edge:
        return _wrapper_on_edge(plate, plate)
    heading = plate.heading
    if cos(heading) < 0.0:
        heading += pi
    x = plate.rectangle.x - HINGE_TO_PLATE * cos(heading)
    y = plate.rectangle.y - HINGE_TO_PLATE * sin(heading)
    return WrapperDetection(
        (x, y, plate.height - above), wrap_heading(heading, 2.0 * pi), pi - plate.tilt if closed else 0.0
    )


def _wrapper_on_edge(a: _Plate, b: _Plate) -> WrapperDetection:
    """Estimate a wrapper on its edge: its middle is half as high as its top; its fold is not visible."""
    away = (a.rectangle.x - b.rectangle.x, a.rectangle.y - b.rectangle.y)
    heading = atan2(away[1], away[0]) if dist(away, (0.0, 0.0)) > PLATE_HALF[0] / 2.0 else a.heading
    top = max(float(plate.points[:, 2].max()) for plate in (a, b))
    middle = ((a.rectangle.x + b.rectangle.x) / 2.0, (a.rectangle.y + b.rectangle.y) / 2.0, top / 2.0)
    return WrapperDetection(middle, wrap_heading(heading, 2.0 * pi), None)


def _filling(points: Points) -> Vector3 | None:
    """Estimate the filling's middle from its top face."""
    if len(points) < MIN_PIXELS:
        return None
    around, top = top_face(points)
    return (around.x, around.y, top - FILLING[1] / 2.0)
