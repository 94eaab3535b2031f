"""The sponge in a picture: found by colour and size, and how it lies."""

from math import cos, dist, sin

import numpy as np

from aeros.perception import Mask, Points, Rectangle, has_red_ratios, min_area_rectangle, separate_parts

from .places import FLAT, MIN_PIXELS, Place, is_all_shown, is_standing

FOAM_TOPS = (FLAT, 0.12)
"""Height range of the sponge's foam, m, however it lies."""

MIN_BRIGHTNESS = 60
"""Least brightness of a coloured pixel (of 255)."""

YELLOW = (0.6, 0.5)
"""Colour of the sponge: least green over red, greatest blue over red."""

SPONGE_LENGTHS = (0.0625, 0.13)
"""Bounds on the longer side of the sponge's top, m: it is 100 mm, and 70 mm where it stands on its end; a
smaller sponge (15 %) or a larger one (20 %) is as good."""

FOAM_TOP_SHARE, FOAM_TOP_WITHIN = 80.0, 0.008
"""Percentile of the heights of foam that is on its upper side, as seen from above, and the noise of that
height, m."""

SPONGE_HEIGHT = 0.03
"""Height of the sponge's foam, m."""

BLOCK_OVER, BLOCK_PIXELS = 0.02, 20
"""Least height of a block on top of the foam above the foam's top, m, and its least number of pixels: the
sponge's is 34 mm and some 120 pixels."""

BLOCK_HEIGHT, BLOCK_RADIUS, ON_TOP = 0.034, 0.042, 0.015
"""Height of its block over the foam's top, radius around the foam's middle that the block is in, and least
height over either of what lies on it, m: a sponge that is 20 % larger has a block that is 7 mm higher."""

OVERTURNED_FROM = 0.045
"""Height of the foam's top from which a sponge without its block on top lies on another face, m: on its side
it is 75 mm high, upside down 64 mm."""

SPONGE_RADIUS = 0.08
"""Radius around the sponge's middle that belongs to the sponge, m."""

SPONGE_MARGIN = 0.012
"""Margin around the foam of a sponge that lies flat, m: depth and edges are a pixel off."""

HIDES_SPONGE = (0.06, 0.08, SPONGE_HEIGHT)
"""Least shorter side, longer side and height of a thing that may have the sponge below it, m: its foam is 75
by 100 mm, and a smaller sponge's is 64 by 85 mm."""

REST_HALF = 0.06
"""Half the edge of the square around its rest that has to be free for it and for the fingers, m."""

SPOTS = (
    tuple(-0.10 + 0.04 * step for step in range(7)),
    (*(-0.26 - 0.04 * step for step in range(5)), *(0.26 + 0.04 * step for step in range(5))),
    tuple(-0.20 + 0.04 * step for step in range(11)),
)
"""Places along x, and along y beside and in the area, from its middle, where it may lie meanwhile, m."""

SPOT_ROOM = 0.015
"""Distance of other things from such a place, m."""

HAND_FROM, HAND_HALF = 0.07, (0.05, 0.12)
"""Height from which a thing is in the way of the hand over it, and half the hand's length and width, m."""

RETURNED_WITHIN = 0.03
"""Greatest distance of the sponge from its rest at which it counts as returned, m."""


def find_sponge(points: Points, rgb: Points) -> tuple[Rectangle, float] | None:
    """Find the top of the foam and its height: yellow, and as long as a sponge.

    Another yellow thing may lie beside it, and in a bad picture the foam may be in parts.
    """
    z = points[:, :, 2]
    yellow = (z > FOAM_TOPS[0]) & (z < FOAM_TOPS[1]) & is_yellow(rgb)
    for part in (*separate_parts(yellow, MIN_PIXELS), yellow):
        if int(part.sum()) >= MIN_PIXELS:
            face, top = _foam_face(points[part])
            if SPONGE_LENGTHS[0] < max(face.length, face.width) < SPONGE_LENGTHS[1]:
                return face, top
    return None


def _foam_face(points: Points) -> tuple[Rectangle, float]:
    """Return the rectangle around the foam's upper side, and its height, whatever single points are."""
    top = float(np.percentile(points[:, 2], FOAM_TOP_SHARE))
    face = points[np.abs(points[:, 2] - top) < FOAM_TOP_WITHIN]
    return min_area_rectangle(face[:, :2]), float(np.median(face[:, 2]))


def middle_of_sponge(sponge: tuple[Rectangle, float]) -> Place:
    """Return the foam's middle: half-way up on the table, else as far below its top as when it lies flat."""
    face, top = sponge
    return (face.x, face.y, top / 2.0 if top < OVERTURNED_FROM else top - SPONGE_HEIGHT / 2.0)


def may_hide_sponge(sides: tuple[float, float, float]) -> bool:
    """Return True if a thing with these sides (shorter, longer, height, m) may have the sponge below it."""
    return all(side >= least for side, least in zip(sides, HIDES_SPONGE, strict=True))


def is_at_rest(middle: Place | None, shown: Points, rest: Place) -> bool | None:
    """Return True if the sponge is at its rest; None if neither it nor a free rest is seen.

    Args:
        middle: of the foam, m; None if it is not seen.
        shown: points (n, 3) that show what is on the table at their place, m.
        rest: where the foam's middle belongs, m.
    """
    if middle is not None:
        return dist(middle, rest) < RETURNED_WITHIN
    around = ((-RETURNED_WITHIN, -RETURNED_WITHIN), (RETURNED_WITHIN, RETURNED_WITHIN))
    return False if is_all_shown(shown, rest, around, []) else None


def is_rest_taken(others: Points, shown: Points, rest: Place) -> bool | None:
    """Return True if something else stands where the sponge, and the fingers around it, belong.

    Args:
        others: points (n, 3) of what is on the table, but for the sponge, m.
        shown: points (n, 3) that show what is on the table at their place, m.
        rest: where the foam's middle belongs, m.

    Returns:
        None if none of it is seen, and not all of that place is shown.
    """
    off = np.abs(others[:, :2] - np.array(rest[:2])).max(axis=1, initial=0.0)
    if int((off < REST_HALF).sum()) >= MIN_PIXELS:
        return True
    around = ((-REST_HALF, -REST_HALF), (REST_HALF, REST_HALF))
    return False if is_all_shown(shown, rest, around, []) else None


def find_spot(others: Points, shown: Points, area: Place, rest: Place) -> Place | None:
    """Return the place nearest to its rest where the sponge can be set down meanwhile; None if none is seen.

    Places in the area come after those beside it.

    Args:
        others: points (n, 3) of what stands on the table, but for the sponge, m.
        shown: points (n, 3) that show what is on the table at their place, m.
        area: middle of the area to wipe, m.
        rest: where the foam's middle belongs, m.
    """
    x, y, _ = area
    beside, inside = ([(x + dx, y + dy, rest[2]) for dx in SPOTS[0] for dy in ys] for ys in SPOTS[1:])
    spots = [one for part in (beside, inside) for one in sorted(part, key=lambda spot: dist(spot, rest))]
    around = ((-REST_HALF, -REST_HALF), (REST_HALF, REST_HALF))
    for spot in spots:
        off = np.abs(others[:, :2] - np.array(spot[:2]))
        is_low = off.max(axis=1, initial=0.0) < REST_HALF + SPOT_ROOM
        is_high = (others[:, 2] > HAND_FROM) & (off[:, 0] < HAND_HALF[0]) & (off[:, 1] < HAND_HALF[1])
        if not (is_low | is_high).any() and is_all_shown(shown, spot, around, []):
            return spot
    return None


def is_overturned(points: Points, face: Rectangle, top: float) -> bool:
    """Return True if the foam is higher than on the table, and no block is on top of it."""
    over = _inside(points, face, 0.0) & (points[:, :, 2] > top + BLOCK_OVER)
    return top > OVERTURNED_FROM and int((over & is_standing(points)).sum()) < BLOCK_PIXELS


def is_yellow(rgb: Points) -> Mask:
    """Find the pixels that have the sponge's colour."""
    return has_red_ratios(rgb, (YELLOW[0], None), (None, YELLOW[1]), MIN_BRIGHTNESS)


def may_be_foam(rgb: Points) -> Mask:
    """Find the pixels that have the sponge's colour, or are too dark to show that they have another one."""
    dark: Mask = rgb.max(axis=-1) <= MIN_BRIGHTNESS
    return dark | is_yellow(rgb)


def is_of_sponge(points: Points, face: Rectangle, top: float) -> Mask:
    """Find the points of the sponge: over foam that lies flat, else around it, as its block is beside."""
    if abs(top - SPONGE_HEIGHT) > FLAT:
        x, y = points[:, :, 0] - face.x, points[:, :, 1] - face.y
        around: Mask = np.hypot(x, y) <= SPONGE_RADIUS
        return around
    return _inside(points, face, SPONGE_MARGIN)


def find_on_sponge(points: Points, face: Rectangle, top: float) -> tuple[Mask, float]:
    """Find the points of what lies on the sponge, and the height of what it lies on: the block, or the foam.

    None are found on a sponge that does not lie flat.
    """
    z = points[:, :, 2]
    over = _inside(points, face, 0.0) & is_standing(points) & (abs(top - SPONGE_HEIGHT) <= FLAT)
    x, y = points[:, :, 0] - face.x, points[:, :, 1] - face.y
    block_top = top + BLOCK_HEIGHT
    is_high = over & (z > block_top + ON_TOP)
    is_beside = over & (z > top + ON_TOP) & (np.hypot(x, y) > BLOCK_RADIUS)
    return is_high | is_beside, block_top if int(is_high.sum()) >= MIN_PIXELS else top


def _inside(points: Points, face: Rectangle, margin: float) -> Mask:
    """Find the points over a rectangle with a margin around it."""
    x, y = points[:, :, 0] - face.x, points[:, :, 1] - face.y
    c, s = cos(face.heading), sin(face.heading)
    half = (face.length / 2.0 + margin, face.width / 2.0 + margin)
    over: Mask = (np.abs(x * c + y * s) < half[0]) & (np.abs(y * c - x * s) < half[1])
    return over
