"""The bin, as pictures show it from above."""

import numpy as np

from aeros.perception import Mask, Points

from .places import Corners, Place, in_rectangle

BIN_SHADOW = 0.06
"""Width of the strip around the bin that its walls hide, m."""

BIN_HALF = (0.09, 0.08)
"""Half of the bin's inner length and width, m."""

BIN_DEPTH = 0.08
"""From the bin's floor to its opening, whose middle is surveyed, m."""

BIN_MARGIN = 0.015
"""Margin around the inside of the bin that belongs to the bin, m: its walls are 5 mm, and depth is a
pixel off."""

BIN_EDGE = 0.010
"""The same of a picture from above, m, where a piece may be at the wall."""


OVER_RIM, HEAP_TOP, INSIDE_WALLS = 0.015, 0.30, -0.010
"""Height over the opening from which something is heaped, rather than in the bin, m; the height above which
it is the arm; and the margin inside of the walls, m."""


WALL, RIM_WITHIN = 0.005, 0.008
"""Thickness of its walls, and greatest height of a point of their edges over or below the opening, m."""

SHIFTS = np.arange(-0.015, 0.0151, 0.001)
"""Distances along x and y from where the bin was surveyed at which it is looked for, m: of a survey from 2 m
away and of a camera, which are some millimetres off each."""

LEAST_RIM, LEAST_SHARE = 60, 0.6
"""Least number of points of the upper edges that show where the bin is, and least share of all points there
that belong to them: others are of a thing that is as high."""


def find_bin(points: Points, opening: Place) -> Place:
    """Find the bin where most of the points that are as high as its rim lie on its walls.

    Its walls are 5 mm thick, so a bin that is a little off would count as clutter beside it.

    Args:
        points: of a picture (h, w, 3), m.
        opening: middle of its opening, as it was surveyed, m.

    Returns:
        Middle of the opening in the picture; as it was surveyed, where the picture does not show it.
    """
    most = float(SHIFTS[-1])
    around = is_bin(points, opening, WALL + most) & ~is_bin(points, opening, -most)
    rim = points[around & (np.abs(points[:, :, 2] - opening[2]) < RIM_WITHIN)][:, :2] - np.array(opening[:2])
    if len(rim) < LEAST_RIM:
        return opening
    x, y = (np.abs(rim[:, axis] - SHIFTS[:, None]) - BIN_HALF[axis] for axis in (0, 1))
    outside = np.maximum(x[:, None, :], y[None, :, :])
    counts = ((outside >= 0.0) & (outside <= WALL)).sum(axis=2)
    best = int(counts.max())
    if best < max(LEAST_RIM, LEAST_SHARE * len(rim)):
        return opening
    # Pixels are as wide as walls, so several shifts are as good.
    dx, dy = (float(SHIFTS[at].mean()) for at in np.nonzero(counts == best))
    return (opening[0] + dx, opening[1] + dy, opening[2])


def is_heaped(points: Points, opening: Place) -> Mask:
    """Find the points of what lies over the bin's opening and is not in it: it may fall out."""
    z = points[:, :, 2]
    heaped: Mask = is_bin(points, opening, INSIDE_WALLS) & (z > opening[2] + OVER_RIM) & (z < HEAP_TOP)
    return heaped


def bin_surroundings(opening: Place) -> Corners:
    """Return the corners of the bin, and of what its walls hide."""
    x, y, _ = opening
    u, v = BIN_HALF[0] + BIN_SHADOW, BIN_HALF[1] + BIN_SHADOW
    return (x - u, y - v), (x + u, y + v)


def is_bin(points: Points, opening: Place, margin: float) -> Mask:
    """Find the points over the bin, with a margin around its inside, m."""
    low, high = (
        (opening[0] + sign * (BIN_HALF[0] + margin), opening[1] + sign * (BIN_HALF[1] + margin))
        for sign in (-1.0, 1.0)
    )
    return in_rectangle(points, low, high)


def is_in_bin(place: Place, opening: Place) -> bool:
    """Return True if a place is inside the bin whose opening has that middle."""
    dx, dy, dz = (a - b for a, b in zip(place, opening, strict=True))
    return abs(dx) < BIN_HALF[0] and abs(dy) < BIN_HALF[1] and -BIN_DEPTH < dz < 0.0
