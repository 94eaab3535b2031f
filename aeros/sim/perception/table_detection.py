"""Detect sponge and clutter on a table in a picture from above, by colour and depth.

The simulator's state is not used. An object lies on its largest face: the rectangle of least area around
its top face gives middle and heading, as its sides are straight.
Units: m. Frame: W; the table's top is z = 0.
"""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.colours import has_dominant_colour
from aeros.perception.rectangles import top_face, wrap_heading
from aeros.sim.bullet.renderer import Image
from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera
from aeros.sim.perception.detection import MIN_BRIGHTNESS, MIN_PIXELS, camera_points, is_yellow

OBJECT_TOP_HEIGHTS: Final = (0.012, 0.12)
"""Height range of the tops of objects on the table, m: below is the table, above is the arm."""

COLOUR_DOMINANCE: Final = 1.5
"""Least ratio of a piece's colour to the two others, in any light."""

Mask = NDArray[np.bool_]


class TableDetection(NamedTuple):
    """Objects in a picture from above; None, or no pieces, for what is not visible.

    `grip_yaw` of each is the heading of a hand whose fingers close on two of its sides, rad: for the sponge
    along its length in [-π/2, π/2), for a piece in [-π/4, π/4).

    Attributes:
        sponge: the sponge; None if it is not visible.
        pieces: the visible pieces.
    """

    sponge: DetectedObject | None
    pieces: tuple[DetectedObject, ...]


def detect_table(image: Image, camera: Camera) -> TableDetection:
    """Detect the objects in a picture in which the arm hides nothing.

    Args:
        image: the picture.
        camera: that took it.

    Returns:
        The detections, in W.
    """
    points = camera_points(image.depth, camera)
    low = (points[:, :, 2] > OBJECT_TOP_HEIGHTS[0]) & (points[:, :, 2] < OBJECT_TOP_HEIGHTS[1])
    rgb = image.rgb.astype(np.float64)
    bluish, greenish = (
        has_dominant_colour(rgb, channel, COLOUR_DOMINANCE, MIN_BRIGHTNESS) for channel in (2, 1)
    )
    pieces = (_detect_lying(points[low & mask], pi / 2.0) for mask in (bluish, greenish))
    sponge = _detect_lying(points[low & is_yellow(rgb)], pi)
    return TableDetection(sponge, tuple(piece for piece in pieces if piece is not None))


def _detect_lying(points: NDArray[np.float64], period: float) -> DetectedObject | None:
    """Locate an object that looks the same when rotated by `period`; its middle is at half its height."""
    if len(points) < MIN_PIXELS:
        return None
    face, top = top_face(points)
    along = face.heading if face.length >= face.width else face.heading + pi / 2.0
    return DetectedObject((face.x, face.y, top / 2.0), None, wrap_heading(along, period))
