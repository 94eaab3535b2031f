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
from aeros.sim.detected_object import Sight
from aeros.sim.geometry import Camera
from aeros.sim.perception.detection import BRIGHTNESS, PIXELS_MIN, is_yellow, points_of
from aeros.sim.perception.rectangles import top_face, turned_into

LIES: Final = (0.012, 0.12)
"""Heights between which the top of what lies on the table is, m: beneath is the table, above is the arm."""

PURE: Final = 1.5
"""How many times a piece's colour exceeds the two others, whatever the light."""

Mask = NDArray[np.bool_]


class Overview(NamedTuple):
    """What a picture from above shows; None and nothing where it does not.

    A sight's `grip` is the heading of a hand whose fingers close on two of its sides, rad: the sponge's
    along its length in [-π/2, π/2), a piece's in [-π/4, π/4).
    """

    sponge: Sight | None
    pieces: tuple[Sight, ...]


def overlook(image: Image, camera: Camera) -> Overview:
    """What lies in a picture in which the arm hides nothing."""
    points = points_of(image.depth, camera)
    low = (points[:, :, 2] > LIES[0]) & (points[:, :, 2] < LIES[1])
    rgb = image.rgb.astype(np.float64)
    red, green, blue = (rgb[:, :, channel] for channel in range(3))
    bluish = (blue > BRIGHTNESS) & (blue > PURE * np.maximum(red, green))
    greenish = (green > BRIGHTNESS) & (green > PURE * np.maximum(red, blue))
    pieces = (_lying(points[low & mask], pi / 2.0) for mask in (bluish, greenish))
    sponge = _lying(points[low & is_yellow(rgb)], pi)
    return Overview(sponge, tuple(one for one in pieces if one is not None))


def _lying(points: NDArray[np.float64], period: float) -> Sight | None:
    """Where the middle is, half as high as its top, of what looks alike when turned by `period`."""
    if len(points) < PIXELS_MIN:
        return None
    face, top = top_face(points)
    along = face.heading if face.length >= face.width else face.heading + pi / 2.0
    return Sight((face.x, face.y, top / 2.0), None, turned_into(along, period))
