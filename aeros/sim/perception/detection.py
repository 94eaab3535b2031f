"""Detect a coloured object in a picture by colour and depth, and free room around it.

The simulator's state is not used. Units: m. Frame: W.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import Final

import numpy as np
from numpy.typing import NDArray

from aeros.perception.colours import has_dominant_colour, has_red_ratios
from aeros.perception.cylinders import locate_cylinder
from aeros.perception.points import point_cloud
from aeros.sim.bullet.renderer import Image
from aeros.sim.detected_object import DetectedObject, Push
from aeros.sim.geometry import Camera, Vector3, add

MIN_PIXELS: Final = 25
"""Least number of pixels of a detection: fewer are noise or a mostly hidden object."""

RED_DOMINANCE: Final = 2.0
"""Least ratio of red to green and to blue in a red pixel, in any light."""

MIN_BRIGHTNESS: Final = 60
"""Least red of a red pixel (of 255)."""

YELLOW_RATIOS: Final = (0.6, 0.5)
"""Colour of a yellow pixel: least green over red, greatest blue over red."""

HAND_HALF_EXTENT: Final = (0.06, 0.115)
"""Half of the space that hand and flange need, along and across the hand's x axis, with 1 cm margin, m."""

HAND_CLEARANCE: Final = 0.02
"""Height of the hand above a gripped object, m; lower objects fit between or next to its fingers."""

_PUSH_HALF_EXTENTS: Final = ((0.035, 0.11), (0.046, 0.046))
"""Half of the space that a pushing hand needs, and of its wrist, which may touch objects next to it, m."""

_PUSH_START_OFFSET: Final = 0.08
"""Distance behind a can's middle at which fingers come down to push it, m: 40 mm from its end."""

_PUSH_LATERAL_OFFSETS: Final = (0.0, 0.008, -0.008, 0.016, -0.016, 0.024, -0.024, 0.027, -0.027)
"""Lateral offsets from its axis to try, m: beyond them the fingers miss the end of a can of 22 mm
radius."""

_SEARCH_STEP: Final = 0.02
"""Spacing of the positions at which free room is searched, m."""

_SEARCH_RADIUS: Final = 0.45
"""Greatest distance of those positions from the object, m: more than half of a stand's length."""

_GRIP_HEADINGS: Final = (0.0, pi / 2.0)
"""Hand headings to try for an object that can be gripped at any heading, rad."""


def detect_red_cylinder(image: Image, camera: Camera, size: tuple[float, float]) -> DetectedObject | None:
    """Detect the one red cylinder of known size in a picture.

    Assumes that its upper side is visible, as `locate_cylinder` does.

    Args:
        image: the picture.
        camera: that took it.
        size: radius and height of the cylinder, m.

    Returns:
        The cylinder in W, with the grip heading and the push that a hand needs; None if it is not visible.
    """
    radius, height = size
    red = has_dominant_colour(image.rgb, 0, RED_DOMINANCE, MIN_BRIGHTNESS)
    if int(red.sum()) < MIN_PIXELS:
        return None
    everything = camera_points(image.depth, camera)
    found = locate_cylinder(everything[red], radius, height)
    axis = found.axis
    ways = (axis,) if axis is not None else _GRIP_HEADINGS
    # Visible points that a hand would hit.
    higher = everything[everything[:, :, 2] > found.top + HAND_CLEARANCE]
    grip = next((way for way in ways if _has_room(higher, found.position, way)), None)
    push = None
    if found.heading is not None and grip is None:
        push = _shortest_push(higher, found.position, found.heading)
    return DetectedObject(found.position, axis, grip, push)


def _has_room(
    points: NDArray[np.float64], place: Vector3, yaw: float, half: tuple[float, float] = HAND_HALF_EXTENT
) -> bool:
    """Return True if none of `points` (n, 3) is where a hand at `yaw` over `place` would be."""
    ahead = (cos(yaw), sin(yaw))
    away = points[:, :2] - np.array(place[:2])
    inside = (np.abs(away @ np.array(ahead)) < half[0]) & (
        np.abs(away @ np.array((-ahead[1], ahead[0]))) < half[1]
    )
    return not bool(inside.any())


def _shortest_push(points: NDArray[np.float64], place: Vector3, axis: float) -> Push | None:
    """Return the shortest push along `axis` to where a hand has room; a hand at its start has room too.

    The fingers push as near to the axis as possible.
    """
    x, y, z = place
    for away in np.arange(_SEARCH_STEP, _SEARCH_RADIUS, _SEARCH_STEP).tolist():
        for u, v in ((cos(axis), sin(axis)), (-cos(axis), -sin(axis))):
            way = (away * u, away * v, 0.0)
            if not _has_room(points, add(place, way), axis):
                continue
            for aside in _PUSH_LATERAL_OFFSETS:
                start = (x - _PUSH_START_OFFSET * u - aside * v, y - _PUSH_START_OFFSET * v + aside * u, z)
                if all(_has_room(points, start, axis + pi / 2.0, half) for half in _PUSH_HALF_EXTENTS):
                    return Push(start, way)
    return None


def is_yellow(rgb: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Find the pixels that are as yellow as a sponge.

    Args:
        rgb: picture (height, width, 3), 0 to 255.

    Returns:
        Mask (height, width).
    """
    return has_red_ratios(rgb, (YELLOW_RATIOS[0], None), (None, YELLOW_RATIOS[1]), MIN_BRIGHTNESS)


def camera_points(depth: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """Compute the point of every pixel.

    Args:
        depth: along the optical axis (height, width), m.
        camera: that took the picture.

    Returns:
        Points (height, width, 3) in W, m.
    """
    return point_cloud(depth, camera.eye, camera.target, camera.up, camera.field_of_view)
