"""Annotations of camera pictures: each thing that a perceiver found in the picture, with its name.

Pinhole camera: a point with coordinates (x, y, z) along the picture's right and upward direction and the
optical axis is at (w/2·(1 + x/(z·a·h)), h_p/2·(1 − y/(z·h))) in a picture of w × h_p pixels, with
h = tan(field of view/2) and a = w/h_p.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from math import radians, sqrt, tan
from typing import Final

from aeros.runtime.bus.messages import Time, stamp
from aeros.runtime.bus.viewer.foxglove_messages import (
    CircleAnnotation,
    Color,
    ImageAnnotations,
    Point2,
    PointsAnnotation,
    TextAnnotation,
)
from aeros.runtime.bus.viewer.things import SceneThing
from aeros.runtime.ports import CameraPicture, CameraView, Vec3

_COLOUR: Final = Color(1.0, 0.75, 0.0)
_BACKGROUND: Final = Color(0.1, 0.1, 0.1, 0.6)

_DIAMETER: Final = 0.05
_FONT_SIZE: Final = 0.05
"""Sizes in heights of the picture."""

_NEAREST: Final = 0.01
"""Distance along the optical axis below which nothing is drawn, m."""

_LINE_LIST: Final = 4
"""Type of a `PointsAnnotation` with two points for each line."""

_EDGES: Final = tuple((a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in (1, 2, 4))
"""Numbers of the corners of each edge of a box; their binary digits are 1 at the upper bound of an axis."""


def annotate(picture: CameraPicture, found: Iterable[tuple[SceneThing, Vec3]]) -> ImageAnnotations:
    """Mark things in a picture: a circle with a name at the place, and the edges of the space it occupies.

    Args:
        picture: the picture.
        found: things with their places in W, m.

    Returns:
        The annotations; none of what is outside of the picture.
    """
    when, size = stamp(picture.time), (picture.width, picture.height)
    circles: list[CircleAnnotation] = []
    lines: list[PointsAnnotation] = []
    texts: list[TextAnnotation] = []
    for thing, place in found:
        middle = project(picture.view, size, place)
        if middle is None or not (0.0 <= middle.x < picture.width and 0.0 <= middle.y < picture.height):
            continue
        diameter = _DIAMETER * picture.height
        circles.append(CircleAnnotation(when, middle, diameter, 1.5, outline_color=_COLOUR))
        label_at = Point2(middle.x + 0.6 * diameter, middle.y - 0.6 * diameter)
        texts.append(
            TextAnnotation(when, label_at, thing.label, _FONT_SIZE * picture.height, _COLOUR, _BACKGROUND)
        )
        lines += _edges(picture.view, size, thing, place, when)
    return ImageAnnotations(tuple(circles), tuple(lines), tuple(texts))


def project(view: CameraView, size: tuple[int, int], place: Vec3) -> Point2 | None:
    """Compute where a point is in a picture.

    Args:
        view: place of the camera.
        size: columns and rows of the picture, pixels.
        place: the point in W, m.

    Returns:
        The place in the picture, which may be outside of its borders; None if it is behind the camera.
    """
    forward = _unit(_minus(view.target, view.eye))
    right = _unit(_cross(forward, view.up))
    upward = _cross(right, forward)
    away = _minus(place, view.eye)
    x, y, z = (_dot(axis, away) for axis in (right, upward, forward))
    if z < _NEAREST:
        return None
    width, height = size
    scale = height / 2.0 / tan(radians(view.field_of_view) / 2.0)
    return Point2(width / 2.0 + scale * x / z, height / 2.0 - scale * y / z)


def _edges(
    view: CameraView, size: tuple[int, int], thing: SceneThing, place: Vec3, when: Time
) -> Sequence[PointsAnnotation]:
    if thing.box is None:
        return ()
    sides = [(at + low, at + high) for at, low, high in zip(place, thing.box[0], thing.box[1], strict=True)]
    corners = [project(view, size, (x, y, z)) for x, y, z in product(*sides)]
    points = tuple(
        point
        for a, b in _EDGES
        if (one := corners[a]) is not None and (other := corners[b]) is not None
        for point in (one, other)
    )
    return (PointsAnnotation(when, _LINE_LIST, points, _COLOUR),)


def _unit(vector: Vec3) -> Vec3:
    length = sqrt(_dot(vector, vector))
    return (vector[0] / length, vector[1] / length, vector[2] / length)


def _minus(one: Vec3, other: Vec3) -> Vec3:
    return (one[0] - other[0], one[1] - other[1], one[2] - other[2])


def _cross(one: Vec3, other: Vec3) -> Vec3:
    (a, b, c), (d, e, f) = one, other
    return (b * f - c * e, c * d - a * f, a * e - b * d)


def _dot(one: Vec3, other: Vec3) -> float:
    return sum(a * b for a, b in zip(one, other, strict=True))
