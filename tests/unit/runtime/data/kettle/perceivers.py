"""Find the kettle from above: its steam, and the float of its gauge."""

import numpy as np

from aeros.perception import Perception, View, estimate

STEAM = 220
"""Grey level above which a pixel over the spout is steam."""


def see_kettle(view: View) -> Perception:
    """Measure the water: hot if a hundredth of the picture is steam; its level from the gauge's height."""
    while True:
        picture = view.pictures["overhead"]
        grey = picture.rgb.mean(axis=2)
        height = float(np.median(picture.points()[..., 2]))
        steam = np.count_nonzero(grey > STEAM) / grey.size
        view = yield {
            "water_hot": bool(steam > 0.01),
            "filled": height > 0.1,
            "water_level": estimate(height, 0.004),
        }
