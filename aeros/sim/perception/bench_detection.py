"""What lies on a dumpling bench, by pictures: both plates of the wrapper by colour, the filling, the fold.

Nothing is asked of the simulator.  From above, a plate is the plane through its points and the rectangle
around them.  From the side, what shows between the plates is in the dumpling.
Units: m, rad.  Frame: W.
"""

from __future__ import annotations

from math import acos, atan2, cos, dist, pi, sin
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.bullet.world import Image
from aeros.sim.geometry import Camera, Triple
from aeros.sim.layouts.dumpling_bench import CLOSED_HEIGHT, FILLING, HINGE_TO_PLATE, PLATE_HALF, WrapperSight
from aeros.sim.perception.detection import BRIGHTNESS, PIXELS_MIN, points_of
from aeros.sim.perception.rectangles import Rectangle, rectangle_around, top_face, turned_into

HIGHEST: Final = 0.20
"""Height over which nothing lies, m: there is the arm."""

DOUGH: Final = ((0.75, 1.1), 0.5)
"""Of a pixel of plate A: green to red from to, and blue to red at most."""

GLAZED: Final = ((0.42, 0.72), 0.4)
"""The same of plate B."""

GREEN: Final = 1.3
"""How many times green exceeds red and blue in a pixel of the filling."""

WHOLE: Final = 0.6
"""Share of a plate's area from which its rectangle tells where the plate is."""

NARROW: Final = 0.015
"""A plate whose rectangle is less wide than this stands on its edge, m."""

OUTLIERS: Final = 0.003
"""Points that are this far off a plate's plane are of its sides, m."""

SLIVER: Final = 6
"""Fewest pixels of the filling that show between the plates."""

Points = NDArray[np.float64]


class BenchView(NamedTuple):
    """What a picture from above shows: the wrapper, and the filling's middle; None for what it does not."""

    wrapper: WrapperSight | None
    filling: Triple | None


class _Plate(NamedTuple):
    """A plate by its points: the rectangle around them, its middle's height, its normal, what it covers."""

    points: Points
    around: Rectangle
    height: float
    normal: tuple[float, float, float]

    @property
    def is_whole(self) -> bool:
        return self.around.length * self.around.width > WHOLE * 4.0 * PLATE_HALF[0] * PLATE_HALF[1]

    @property
    def stands(self) -> bool:
        return min(self.around.length, self.around.width) < NARROW

    @property
    def heading(self) -> float:
        """Along the plate's short side, which is across its hinge; as good as that plus π."""
        across = self.around.length > self.around.width
        return self.around.heading + (pi / 2.0 if across else 0.0)

    @property
    def tilt(self) -> float:
        return acos(min(1.0, abs(self.normal[2])))


def view_bench(image: Image, camera: Camera) -> BenchView:
    """What lies in a picture from above in which the arm hides nothing."""
    points, dough, glazed, green = _colours(image, camera)
    a, b = _plate(points[dough]), _plate(points[glazed])
    return BenchView(_wrapper(a, b), _filling(points[green]))


def shows_filling(image: Image, camera: Camera, wrapper: WrapperSight) -> bool:
    """Whether a picture from the side shows filling between a closed wrapper's plates, and none beside."""
    points, _, _, green = _colours(image, camera)
    x, y, z = wrapper.hinge
    away = points[green] - np.array((x, y, z))
    along = away[:, 0] * cos(wrapper.yaw) + away[:, 1] * sin(wrapper.yaw)
    across = away[:, 1] * cos(wrapper.yaw) - away[:, 0] * sin(wrapper.yaw)
    near = (along > -0.01) & (along < 2.0 * HINGE_TO_PLATE + 0.01) & (np.abs(across) < PLATE_HALF[1] + 0.01)
    between = near & (away[:, 2] > 0.0) & (away[:, 2] < CLOSED_HEIGHT)
    inside = (along < HINGE_TO_PLATE + PLATE_HALF[0]) & (np.abs(across) < PLATE_HALF[1])
    return int((between & inside).sum()) >= SLIVER and not bool((between & ~inside).any())


def _colours(
    image: Image, camera: Camera
) -> tuple[Points, NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Points of the picture that are no arm; which are of plate A, of plate B, of the filling."""
    points = points_of(image.depth, camera).reshape(-1, 3)
    rgb = image.rgb.reshape(-1, 3).astype(np.float64)
    low = points[:, 2] < HIGHEST
    red, green, blue = rgb[:, 0], rgb[:, 1], rgb[:, 2]
    bright = low & (red > BRIGHTNESS)
    plates = [
        bright & (green > least * red) & (green < most * red) & (blue < bluest * red)
        for (least, most), bluest in (DOUGH, GLAZED)
    ]
    return points, plates[0], plates[1], low & (green > GREEN * np.maximum(red, blue))


def _plate(points: Points) -> _Plate | None:
    """The plate that the points are of, its sides left out."""
    if len(points) < PIXELS_MIN:
        return None
    for _ in range(2):
        middle = points.mean(axis=0)
        normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
        off = np.abs((points - middle) @ normal)
        if int((off < OUTLIERS).sum()) < PIXELS_MIN:
            break
        points = points[off < OUTLIERS]
    normal = normal if normal[2] > 0.0 else -normal
    around = rectangle_around(points[:, :2])
    x, y = around.x - middle[0], around.y - middle[1]
    height = float(middle[2] - (normal[0] * x + normal[1] * y) / max(normal[2], 0.1))
    return _Plate(points, around, height, (float(normal[0]), float(normal[1]), float(normal[2])))


def _wrapper(a: _Plate | None, b: _Plate | None) -> WrapperSight | None:
    if a is not None and b is not None and _is_over(b, a):
        a = None
    if a is None:
        return None if b is None else _by_one(b, CLOSED_HEIGHT, closed=True)
    if b is None:
        return _by_one(a, PLATE_HALF[2], closed=False)
    if a.stands or b.stands:
        return _standing(a, b)
    away = (a.around.x - b.around.x, a.around.y - b.around.y)
    best = a if a.is_whole else b
    # Of one that leans the sides look shorter than they are: from plate to plate is across the hinge.
    across_hinge = atan2(away[1], away[0])
    heading = across_hinge + turned_into(best.around.heading - across_hinge, pi / 2.0)
    way, side = np.array((cos(heading), sin(heading))), np.array((-sin(heading), cos(heading)))
    near, far = float((a.points[:, :2] @ way).min()), float((b.points[:, :2] @ way).max())
    beside = best.points if best.is_whole else np.concatenate((a.points, b.points))
    across = beside[:, :2] @ side
    u, v = (near + far) / 2.0, float(across.min() + across.max()) / 2.0
    x, y = u * way + v * side
    fold = acos(max(-1.0, min(1.0, sum(p * q for p, q in zip(a.normal, b.normal, strict=True)))))
    return WrapperSight((float(x), float(y), a.height - PLATE_HALF[2]), turned_into(heading, 2.0 * pi), fold)


def _is_over(b: _Plate, a: _Plate) -> bool:
    """Whether plate B hides plate A, of which edges are seen, as where they are folded together."""
    apart = dist((a.around.x, a.around.y), (b.around.x, b.around.y))
    return b.is_whole and b.height - a.height > HINGE_TO_PLATE / 2.0 and apart < PLATE_HALF[1]


def _by_one(plate: _Plate, above: float, *, closed: bool) -> WrapperSight:
    """By the only plate that is seen: the upper one of a closed wrapper, or the lower one of an open."""
    if plate.stands:
        return _standing(plate, plate)
    heading = plate.heading
    if cos(heading) < 0.0:
        heading += pi
    x = plate.around.x - HINGE_TO_PLATE * cos(heading)
    y = plate.around.y - HINGE_TO_PLATE * sin(heading)
    return WrapperSight(
        (x, y, plate.height - above), turned_into(heading, 2.0 * pi), pi - plate.tilt if closed else 0.0
    )


def _standing(a: _Plate, b: _Plate) -> WrapperSight:
    """A wrapper on its edge: its middle, half as high as its top; how it is folded is not seen."""
    away = (a.around.x - b.around.x, a.around.y - b.around.y)
    heading = atan2(away[1], away[0]) if dist(away, (0.0, 0.0)) > PLATE_HALF[0] / 2.0 else a.heading
    top = max(float(one.points[:, 2].max()) for one in (a, b))
    middle = ((a.around.x + b.around.x) / 2.0, (a.around.y + b.around.y) / 2.0, top / 2.0)
    return WrapperSight(middle, turned_into(heading, 2.0 * pi), None)


def _filling(points: Points) -> Triple | None:
    """The filling's middle, by its top face."""
    if len(points) < PIXELS_MIN:
        return None
    around, top = top_face(points)
    return (around.x, around.y, top - FILLING[1] / 2.0)
