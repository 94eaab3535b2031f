"""Things that are flatter than the noise of depth: found by means of many pixels, or by another colour.

A pixel's depth is 2 mm off, but the mean of the 25 pixels around it 0.4 mm. So a thing of 3 mm shows as a
patch that is higher than the table, of whatever colour. What is flatter shows by its colour, beside the area
to wipe.
"""

import numpy as np

from aeros.perception import Mask, Points, erode, mean_nearby, separate_parts

from .places import AREA, Corners, Place, corners_in_world, in_rectangle

LOW = 0.020
"""Height up to which a thing is low, m: higher ones stand out of the noise of single pixels."""

NOISE_RADIUS, EDGE_RADIUS = 2, 1
"""Half the sides of the squares whose mean height tells that something lies there, and where its edge is,
pixels."""

LEAST_HEIGHT, NOISE_FACTOR = 0.0018, 5.2
"""Least mean height of a low thing, m, and its least multiple of that mean's standard deviation."""

LEAST_COUNTED = 10
"""Least number of pixels that a mean is of."""

LOW_PIXELS, COLOUR_PIXELS = 6, 4
"""Least number of pixels of a patch that is higher, and of the inside of one that has another colour."""

AROUND_TALL = 4
"""Width of the strip around a tall thing in which nothing low is looked for, pixels: it shows its sides."""

OTHER_COLOUR = 0.15
"""Least difference of a colour from the table's, as a share of it."""

DIRT_AROUND = 0.03
"""Margin around the area to wipe in which the dirt of a camera that is off may show, m."""

LEAST_TABLE = 1000
"""Least number of pixels of bare table that its height and colour are taken from."""


def find_low_things(points: Points, rgb: Points, free: Mask, area: Place) -> tuple[Mask, Points]:
    """Find what lies flat on the table.

    Args:
        points: of every pixel (height, width, 3), m; z counts from the table.
        rgb: their colours, 0 to 255.
        free: pixels that show the table, or what may lie on it: not the sponge, the bin or the hand.
        area: middle of the area to wipe.

    Returns:
        Mask of the low things, and the points with the heights of low things without noise.
    """
    z = points[:, :, 2]
    ground = free & (np.abs(z) < LOW)
    ground &= ~_widened(erode(free & (z >= LOW)), AROUND_TALL + 1)
    bare = ground & ~in_rectangle(points, *_around(corners_in_world(area, AREA), DIRT_AROUND))
    if int(bare.sum()) < LEAST_TABLE:
        return np.zeros_like(ground), points
    level = float(np.median(z[bare]))
    noise = 1.4826 * float(np.median(np.abs(z[bare] - level)))
    height, counted = mean_nearby(z - level, ground, NOISE_RADIUS)
    least = np.maximum(LEAST_HEIGHT, NOISE_FACTOR * noise / np.sqrt(np.maximum(counted, 1.0)))
    higher = ground & (counted >= LEAST_COUNTED) & (height > least)
    near, _ = mean_nearby(z - level, ground, EDGE_RADIUS)
    low = np.zeros_like(ground)
    for part in separate_parts(higher, LOW_PIXELS):
        half = float(np.percentile(height[part], 75)) / 2.0
        low |= _widened(part, 1) & ground & (near > half)
    low |= _other_colours(rgb, ground, bare)
    found = points.copy()
    found[:, :, 2] = np.where(low, np.maximum(near, LEAST_HEIGHT), z)
    return low, found


def _other_colours(rgb: Points, ground: Mask, bare: Mask) -> Mask:
    """Find what lies beside the area to wipe and has another colour than the table."""
    table = np.maximum(np.median(rgb[bare], axis=0), 1.0)
    differs = np.zeros_like(bare)
    for channel in range(3):
        smooth, _ = mean_nearby(rgb[:, :, channel], bare, EDGE_RADIUS)
        differs |= bare & (np.abs(smooth / table[channel] - 1.0) > OTHER_COLOUR)
    found = np.zeros_like(ground)
    for core in separate_parts(erode(differs), COLOUR_PIXELS):
        found |= _widened(core, 1) & differs
    return found


def _widened(mask: Mask, pixels: int) -> Mask:
    """Widen a mask by so many pixels."""
    counts = mean_nearby(mask.astype(np.float64), np.ones_like(mask), pixels)[0]
    wide: Mask = counts > 0.25 / (2 * pixels + 1) ** 2
    return wide


def _around(corners: Corners, margin: float) -> Corners:
    (left, near), (right, far) = corners
    return (left - margin, near - margin), (right + margin, far + margin)
