"""Detect a coloured object in a picture by colour and depth, and free room around it.

The simulator's state is not used. A pixel's point: p_W = eye + depth · (forward + x·right + y·up), where x
and y are the pixel's coordinates on the image plane at distance 1. Units: m. Frame: W.
"""

from __future__ import annotations

from math import atan2, cos, pi, radians, sin, tan
from typing import Final

import numpy as np
from numpy.typing import NDArray

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

TOP_FACE_DEPTH: Final = 0.004
"""Depth below the highest point that still belongs to the top face, m."""

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

    Its highest points show its pose: a disc if it stands, a strip as long as the cylinder if it lies. They
    also give the middle: the visible side is the camera's side, so the middle of all points would be biased
    towards the camera. Assumes that its upper side is visible.

    Args:
        image: the picture.
        camera: that took it.
        size: radius and height of the cylinder, m.

    Returns:
        The cylinder in W, with the grip heading and the push that a hand needs; None if it is not visible.
    """
    radius, height = size
    rgb = image.rgb.astype(np.float64)
    others = np.maximum(rgb[:, :, 1], rgb[:, :, 2])
    red = (rgb[:, :, 0] > MIN_BRIGHTNESS) & (rgb[:, :, 0] > RED_DOMINANCE * others)
    if int(red.sum()) < MIN_PIXELS:
        return None
    everything = point_cloud(image.depth, camera)
    points = everything[red]
    top = float(points[:, 2].max())
    face = points[points[:, 2] > top - TOP_FACE_DEPTH]
    level = float(np.median(face[:, 2]))
    along = _principal_direction(face[:, :2])
    low, high = _extent(face[:, :2], along)
    lies = float((high - low)[0]) > (2.0 * radius + height) / 2.0
    heading = atan2(along[1], along[0]) if lies else 0.0
    if not lies:
        along = np.array((1.0, 0.0))
        low, high = _extent(face[:, :2], along)
    u, v = (low + high) / 2.0
    x, y = u * along + v * np.array((-along[1], along[0]))
    place = (float(x), float(y), level - (radius if lies else height / 2.0))
    axis = (heading + pi / 2.0) % pi - pi / 2.0 if lies else None
    ways = (axis,) if axis is not None else _GRIP_HEADINGS
    # Visible points that a hand would hit.
    higher = everything[everything[:, :, 2] > top + HAND_CLEARANCE]
    grip = next((way for way in ways if _has_room(higher, place, way)), None)
    is_stuck = axis is not None and grip is None
    return DetectedObject(place, axis, grip, _shortest_push(higher, place, heading) if is_stuck else None)


def _principal_direction(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit direction in which `points` (n, 2) spread most."""
    away = points - points.mean(axis=0)
    _, vectors = np.linalg.eigh(away.T @ away)
    longest: NDArray[np.float64] = vectors[:, -1]
    return longest


def _extent(points: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return least and greatest coordinates of `points` (n, 2) along and across a direction: (2, 2)."""
    turned = points @ np.array((along, (-along[1], along[0]))).T
    return np.array((turned.min(axis=0), turned.max(axis=0)))


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
    red, green, blue = (rgb[:, :, channel] for channel in range(3))
    yellow: NDArray[np.bool_] = (
        (red > MIN_BRIGHTNESS) & (green > YELLOW_RATIOS[0] * red) & (blue < YELLOW_RATIOS[1] * red)
    )
    return yellow


def point_cloud(depth: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """Compute the point of every pixel.

    Args:
        depth: along the optical axis (height, width), m.
        camera: that took the picture.

    Returns:
        Points (height, width, 3) in W, m.
    """
    eye = np.array(camera.eye)
    forward = np.array(camera.target) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.array(camera.up))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    half = tan(radians(camera.field_of_view) / 2.0)
    aspect = camera.width / camera.height
    # The TinyRenderer samples a pixel at its lower left corner: pixel middles would be half a pixel off.
    x = (2.0 * np.arange(camera.width) / camera.width - 1.0) * half * aspect
    y = (1.0 - 2.0 * (np.arange(camera.height) + 1.0) / camera.height) * half
    rays = forward + x[None, :, None] * right + y[:, None, None] * up
    points: NDArray[np.float64] = eye + depth[:, :, None] * rays
    return points
