"""What lies on a table, by a picture from above: sponge and clutter by colour and depth.

Nothing is asked of the simulator.  What lies, lies on its largest face that is in the picture: the
rectangle of least area around a top face gives middle and heading (as its sides are straight).
Units: m.  Frame: W; the table's top is z = 0.
"""

from __future__ import annotations

from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.sim.bullet.world import Image
from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera
from aeros.sim.perception.detection import MIN_BRIGHTNESS, MIN_PIXELS, is_yellow, point_cloud
from aeros.sim.perception.rectangles import top_face, wrap_heading

OBJECT_TOP_HEIGHTS: Final = (0.012, 0.12)
"""Heights between which the top of what lies on the table is, m: beneath is the table, above is the arm."""

COLOUR_DOMINANCE: Final = 1.5
"""How many times a piece's colour exceeds the two others, whatever the light."""

Mask = NDArray[np.bool_]


class TableDetection(NamedTuple):
    """What a picture from above shows; None and nothing where it does not.

    A sight's `grip` is the heading of a hand whose fingers close on two of its sides, rad: the sponge's
    along its length in [-π/2, π/2), a piece's in [-π/4, π/4).
    """

    sponge: DetectedObject | None
    pieces: tuple[DetectedObject, ...]


def detect_table(image: Image, camera: Camera) -> TableDetection:
    """What lies in a picture in which the arm hides nothing."""
    points = point_cloud(image.depth, camera)
    low = (points[:, :, 2] > OBJECT_TOP_HEIGHTS[0]) & (points[:, :, 2] < OBJECT_TOP_HEIGHTS[1])
    rgb = image.rgb.astype(np.float64)
    red, green, blue = (rgb[:, :, channel] for channel in range(3))
    bluish = (blue > MIN_BRIGHTNESS) & (blue > COLOUR_DOMINANCE * np.maximum(red, green))
    greenish = (green > MIN_BRIGHTNESS) & (green > COLOUR_DOMINANCE * np.maximum(red, blue))
    pieces = (_detect_lying(points[low & mask], pi / 2.0) for mask in (bluish, greenish))
    sponge = _detect_lying(points[low & is_yellow(rgb)], pi)
    return TableDetection(sponge, tuple(one for one in pieces if one is not None))


def _detect_lying(points: NDArray[np.float64], period: float) -> DetectedObject | None:
    """Where the middle is, half as high as its top, of what looks alike when turned by `period`."""
    if len(points) < MIN_PIXELS:
        return None
    face, top = top_face(points)
    along = face.heading if face.length >= face.width else face.heading + pi / 2.0
    return DetectedObject((face.x, face.y, top / 2.0), None, wrap_heading(along, period))
