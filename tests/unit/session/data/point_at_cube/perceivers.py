"""Find the blue cube from above, and compare the tool with it."""

from typing import Any

import numpy as np

from aeros.perception import (
    Perception,
    View,
    estimate,
    has_dominant_colour,
    has_size,
    largest_component,
    top_face,
)

EDGE = 0.04
"""Edge of the cube, m."""


def see_cube(view: View) -> Perception:
    """Locate the largest blue patch whose top is a square as large as the cube's."""
    while True:
        picture = view.pictures["overhead"]
        points = picture.points()
        low = (points[..., 2] > 0.012) & (points[..., 2] < 0.12)
        blue = largest_component(low & has_dominant_colour(picture.rgb, 2, 1.5, 60))
        values: dict[str, Any] = {"cube_seen": False}
        if np.count_nonzero(blue) > 25:
            face, height = top_face(points[blue])
            if has_size(face, EDGE, EDGE, 0.01):
                place = (face.x, face.y, height - EDGE / 2)
                values = {"cube_seen": True, "cube_position": estimate(place, 0.003)}
        view = yield values


def see_hand(view: View) -> Perception:
    """Measure whether the tool is over the cube, as it was seen last."""
    while True:
        place, tool = view.readings.get("cube_position"), view.readings.get("tool_position")
        over = None
        if place is not None and tool is not None:
            away = np.array(tool) - np.array(place)
            over = bool(np.hypot(away[0], away[1]) < 0.01 and 0.05 < away[2] < 0.15)
        view = yield {"hand_over_cube": over}
