"""Find the purple block from above."""

from math import pi
from typing import Any

import numpy as np

from aeros.perception import Perception, View, estimate, largest_component, top_face, wrap_heading

HALF_HEIGHT = 0.015
"""m."""


def see(view: View) -> Perception:
    """Locate the largest purple patch; its longer side gives the heading."""
    while True:
        picture = view.pictures["eye"]
        points = picture.points()
        low = (points[..., 2] > 0.012) & (points[..., 2] < 0.12)
        red, green, blue = (picture.rgb[..., channel].astype(int) for channel in range(3))
        patch = largest_component(low & (red > 60) & (blue > 60) & (2 * green < red))
        values: dict[str, Any] = {"block_seen": False}
        if np.count_nonzero(patch) > 25:
            face, height = top_face(points[patch])
            values = {
                "block_seen": True,
                "block_at": estimate((face.x, face.y, height - HALF_HEIGHT), 0.004),
                "block_yaw": estimate(wrap_heading(face.longer_heading, pi), 0.1),
            }
        view = yield values
