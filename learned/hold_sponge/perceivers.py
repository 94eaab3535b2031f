"""Place of the sponge, by its colour and its top, in a picture from above.

All lengths in metres, in the world frame; the table's top is z = 0.
"""

from math import pi
from typing import Any

from aeros.perception import Perception, View, estimate, has_red_ratios, top_face, wrap_heading

TOPS = (0.012, 0.12)
"""Height range of the tops of objects on the table, m: below is the table, above is the arm."""

YELLOW = ((0.6, None), (None, 0.5), 60)
"""Colour of the sponge: bounds of green over red and of blue over red, and the least red (of 255)."""

MIN_PIXELS = 25
"""Least number of pixels of the sponge."""


def see_sponge(view: View) -> Perception:
    """Find the sponge: the rectangle around its top gives middle and heading."""
    while True:
        picture = view.pictures["overhead"]
        points = picture.points()
        foam = (
            has_red_ratios(picture.rgb, *YELLOW) & (points[:, :, 2] > TOPS[0]) & (points[:, :, 2] < TOPS[1])
        )
        is_seen = int(foam.sum()) >= MIN_PIXELS
        values: dict[str, Any] = {"sponge_seen": is_seen}
        if is_seen:
            face, top = top_face(points[foam])
            values["sponge_position"] = estimate((face.x, face.y, top / 2.0), 0.005)
            values["sponge_yaw"] = estimate(wrap_heading(face.longer_heading, pi), 0.05)
        view = yield values
