"""The bin, as pictures show it from above."""

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
