"""A level ground, such as a table's top, in a picture with depth: it shows how far a camera is tilted.

A table is level, as a spirit level shows, but a camera is held by a bracket that bends. So if the ground of a
picture slopes, the camera is tilted: turned about its eye until the ground is level, its picture is right
again. A turn about the vertical and a displacement of the camera are not seen so; `calibrate_camera` finds
those, too. Units: m, rad. Frame: W.
"""

from __future__ import annotations

from math import acos
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from aeros.perception.planes import find_plane, trim_to_plane
from aeros.perception.points import Mask, Points
from aeros.perception.view import Picture

_CANDIDATES: Final = 4000
"""Greatest number of points among which the plane is looked for; more make it slower and no better."""

_TRIES: Final = 60
"""Number of planes to try: half of the points are on the ground, so one of eight tries has no other point."""


class Level(NamedTuple):
    """A picture whose camera was turned until its ground is level.

    Attributes:
        points: of every pixel (height, width, 3), in W, m.
        height: z of the ground in W, m.
        tilt: angle by which the camera was turned, rad.
        rotation: the turn about the camera's eye (3, 3).
    """

    points: Points
    height: float
    tilt: float
    rotation: NDArray[np.float64]

    @property
    def above_ground(self) -> Points:
        """Points of every pixel (height, width, 3), m; z counts from the ground."""
        points: Points = self.points - np.array((0.0, 0.0, self.height))
        return points


def level_ground(
    picture: Picture, near: Mask, tolerance: float, least: int, greatest_tilt: float = 0.06
) -> Level | None:
    """Turn a camera until the ground in its picture is level.

    Args:
        picture: the picture, with depth.
        near: pixels that may show the ground (height, width), of which at least half do.
        tolerance: greatest distance of the ground's points from its plane, m.
        least: least number of points that show a plane.
        greatest_tilt: rad; beyond it the camera has fallen over, or the plane is no ground.

    Returns:
        The level picture; None if it shows no such plane, or one that slopes more.
    """
    points = picture.points()
    ground = points[near]
    if len(ground) < max(least, 3):
        return None
    found = find_plane(ground[:: max(1, len(ground) // _CANDIDATES)], tolerance, _TRIES)
    if found is None:
        return None
    normal, middle = np.array(found[0].normal), np.array(found[0].middle)
    on_plane = ground[np.abs((ground - middle) @ normal) <= tolerance]
    if len(on_plane) < least:
        return None
    plane, _ = trim_to_plane(on_plane, tolerance, least)
    x, y, z = plane.normal
    tilt = acos(min(1.0, z))
    if tilt > greatest_tilt:
        return None
    # Rodrigues' formula for the turn of the normal to the vertical, about n × z = (y, -x, 0).
    skew = np.array(((0.0, 0.0, -x), (0.0, 0.0, -y), (x, y, 0.0)))
    rotation = np.eye(3) + skew + skew @ skew / (1.0 + z)
    eye = np.array(picture.eye)
    level = eye + (points - eye) @ rotation.T
    height = eye[2] + float(rotation[2] @ (np.array(plane.middle) - eye))
    return Level(level, height, tilt, rotation)


def believe_height(seen: float, surveyed: float, within: float) -> float:
    """Choose between two heights of a table: as a camera sees it, and as it was surveyed.

    A camera is moved more easily than a table, so a small difference is the camera's.

    Args:
        seen: from `level_ground`, m.
        surveyed: m.
        within: greatest displacement of a camera that nobody notices, m.

    Returns:
        The surveyed height; the seen one if the difference is greater, m.
    """
    return surveyed if abs(seen - surveyed) <= within else seen
