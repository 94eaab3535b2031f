"""Wrappers and fillings in pictures: plates are told apart by their colour.

The bench is level, so a picture in which it slopes is of a tilted camera, and is levelled first. From the
side, the filling shows between the plates.
"""

from collections.abc import Sequence
from math import atan2, cos, dist, sin
from typing import NamedTuple

import numpy as np

from aeros.perception import (
    Mask,
    Picture,
    Points,
    believe_height,
    has_dominant_colour,
    has_red_ratios,
    level_ground,
    min_area_rectangle,
    seen_cells,
    separate_parts,
    smooth_colours,
    upper_points,
    without_specks,
)

from .measures import (
    CLOSED_HEIGHT,
    FILLING_HEIGHT,
    HIDING_CELL,
    HIDING_CELLS,
    HINGE_TO_PLATE,
    LOOKED_OVER,
    MAX_HEIGHT,
    MIN_PATCH,
    MIN_PIXELS,
    PLATE_HALF,
    Place,
)
from .plates import fit_plate, wrapper_of_plates
from .wrappers import Filling, Wrapper, is_in_pot

CLOSED_MIDDLE, CLOSED_ROOM = (HINGE_TO_PLATE, 0.0, 0.011), (0.05, 0.05, 0.04)
"""Middle of a closed wrapper from its hinge, along, across and up, and half of the room that it is looked for
in, m."""

OFF_SIDE = 0.03
"""Greatest distance of a wrapper in a picture from the side from where it was seen from above, m."""

NEAR_BENCH = 0.045
"""Greatest height of a point that the bench is fitted to, m: stands are 50 mm high."""

OFF_BENCH = 0.004
"""Greatest distance from its plane of such a point, m: the pot's floor is 5 mm up."""

MIN_BENCH = 1000
"""Least number of pixels of the bench: a picture with fewer shows no bench."""

UNNOTICED = 0.012
"""Greatest displacement of a camera that nobody notices, m: a bench that is seen higher or lower by more
is."""

MIN_FILLING_PIXELS = 6
"""Least number of pixels of the filling between the plates of a filled wrapper."""

MIN_GREEN = 30
"""Least green of a pixel of the filling (of 255): darker ones have no colour that noise leaves."""

MIN_BRIGHTNESS = 60
"""Least red of a pixel of a plate (of 255)."""

DARK = 48
"""Brightness of the bench up to which a plate on it, which is a fifth brighter, may be too dark, of 255."""

PLATE_COLOURS = (((0.75, 1.1), 0.5), ((0.42, 0.72), 0.4))
"""Colours of plates A and B: bounds of green over red, and upper bound of blue over red."""

GREEN_DOMINANCE = 1.3
"""Least ratio of green to red and to blue in a pixel of the filling."""

BETWEEN_HEIGHTS = 0.045
"""Height between things that lie on the bench and things on press, trays and stands, m."""

SAME_PLATE = 0.04
"""Distance of two parts of one colour below which they are of one plate, m: it is 42 mm long."""

PLATES_APART = 0.056
"""Greatest distance of the middles of a wrapper's plates, m: 44 mm if it is open, and plates of two wrappers
side by side are as far apart as they are wide."""

SETTLED_WITHIN = 0.045
"""Points nearer than this to the middle of a cooked dumpling, level, are of it, m."""

SETTLED_PIXELS = 120
"""Least number of pixels of another dumpling in the pot beside a cooked one, which may have been bumped: half
of its top."""

STRAIGHT = 0.2
"""Heading below which a filling is gripped as if it lay straight, rad: as few pixels show it."""


def square_heading(face: Points) -> float:
    """Return the heading of a small square, from its few points (n, 3): that of their fourth moment.

    All points count, whereas the rectangle around them turns with a single one at a corner.
    """
    x, y = (face[:, :2] - face[:, :2].mean(axis=0)).T
    real, imaginary = (x**4 - 6.0 * x**2 * y**2 + y**4).sum(), (4.0 * x * y * (x**2 - y**2)).sum()
    yaw = atan2(-imaginary, -real) / 4.0
    return 0.0 if abs(yaw) < STRAIGHT else yaw


def level_points(picture: Picture) -> tuple[Points, float | None]:
    """Return the points of a level picture from above, and the height of the bench, surveyed as 0.

    The height is None if the picture shows no bench.
    """
    points = picture.points()
    level = level_ground(picture, np.abs(points[:, :, 2]) < NEAR_BENCH, OFF_BENCH, MIN_BENCH)
    if level is None:
        return points, None
    height = believe_height(level.height, 0.0, UNNOTICED)
    return level.points + np.array((0.0, 0.0, height - level.height)), height


def find_hidden_place(points: Points, rgb: Points, lift: float) -> Place | None:
    """Return the middle of the largest part of the bench that a picture does not show, or too darkly.

    It is None if each part is too small for a wrapper.

    Args:
        points: of the level picture from above (h, w, 3), m.
        rgb: its colours (h, w, 3), 0 to 255.
        lift: height of the bench, m.
    """
    (left, near), (right, far) = LOOKED_OVER
    is_low = (points[:, :, 2] > lift - NEAR_BENCH) & (points[:, :, 2] < MAX_HEIGHT)
    seen = seen_cells(points[is_low & (rgb.max(axis=-1) > DARK)], *LOOKED_OVER, HIDING_CELL)
    parts = sorted(separate_parts(~seen, HIDING_CELLS), key=np.count_nonzero)
    if not parts:
        return None
    x, y = np.argwhere(parts[-1]).mean(axis=0) + 0.5
    columns, rows = seen.shape
    return (float(left + x / columns * (right - left)), float(near + y / rows * (far - near)), lift)


class Shown(NamedTuple):
    """Wrappers and fillings that a picture from above shows; not those of cooked dumplings."""

    wrappers: list[Wrapper]
    fillings: list[Filling]


def look_from_above(picture: Picture, seen: Points, settled: Sequence[Place], pot: Place | None) -> Shown:
    """Find wrappers and fillings in a picture in which the arm hides nothing.

    Args:
        picture: from above.
        seen: its points, levelled by the bench.
        settled: middles of the cooked dumplings in the pot, whose points are left out.
        pot: the middle of the pot's opening.
    """
    points, dough, glazed, green = coloured_points(picture, seen)
    is_settled = np.zeros(len(points), np.bool_)
    for x, y, _ in settled:
        is_settled |= np.hypot(points[:, 0] - x, points[:, 1] - y) < SETTLED_WITHIN
    dough, glazed, green = (mask & ~is_settled for mask in (dough, glazed, green))
    shape = picture.rgb.shape[:2]
    fillings = []
    for part in separate_parts(green.reshape(shape), MIN_PIXELS):
        face = upper_points(points[part.reshape(-1)])
        around = min_area_rectangle(face[:, :2])
        place = (around.x, around.y, float(np.median(face[:, 2])) - FILLING_HEIGHT / 2.0)
        fillings.append(Filling(place, square_heading(face)))
    wrappers = []
    for a, b in paired(points, plates_of(points, dough, shape), plates_of(points, glazed, shape)):
        wrapper = wrapper_of_plates(fit_plate(points[a]), fit_plate(points[b]))
        if wrapper is None:
            continue
        is_remainder = bool(settled) and int((a | b).sum()) < SETTLED_PIXELS
        if not (is_remainder and is_in_pot(wrapper.middle, pot)):
            wrappers.append(wrapper)
    return Shown(wrappers, fillings)


def plates_of(points: Points, mask: Mask, shape: tuple[int, ...]) -> list[Mask]:
    """Separate the points of one colour into plates: parts that are near each other are of one."""
    plates: list[Mask] = []
    # In a picture, a plate on the press may touch one on the bench behind it.
    is_high = points[:, 2] > BETWEEN_HEIGHTS
    layers = [(mask & layer).reshape(shape) for layer in (is_high, ~is_high)]
    for part in (one for layer in layers for one in separate_parts(layer, MIN_PIXELS)):
        one = part.reshape(-1)
        middle = points[one].mean(axis=0)
        near = [plate for plate in plates if dist(points[plate].mean(axis=0), middle) < SAME_PLATE]
        plates = [plate for plate in plates if not any(plate is other for other in near)]
        for plate in near:
            one = one | plate
        plates.append(one)
    return plates


def paired(points: Points, plates_a: list[Mask], plates_b: list[Mask]) -> list[tuple[Mask, Mask]]:
    """Find the two plates of each wrapper, the nearest first; of a hidden one the mask is empty."""
    ways = sorted(
        (dist(points[a].mean(axis=0), points[b].mean(axis=0)), i, k)
        for i, a in enumerate(plates_a)
        for k, b in enumerate(plates_b)
    )
    pairs: dict[int, int] = {}
    for away, i, k in ways:
        if away < PLATES_APART and i not in pairs and k not in pairs.values():
            pairs[i] = k
    none = np.zeros(len(points), np.bool_)
    found = [(a, plates_b[pairs[i]] if i in pairs else none) for i, a in enumerate(plates_a)]
    return found + [(none, b) for k, b in enumerate(plates_b) if k not in pairs.values()]


def shows_filling(picture: Picture, wrapper: Wrapper) -> bool | None:
    """Return True if a picture from the side shows filling between the plates, and none outside.

    Returns:
        None if it shows the wrapper and no filling at all in it or at it.
    """
    points, dough, glazed, green = coloured_points(picture, picture.points())
    c, s = cos(wrapper.yaw), sin(wrapper.yaw)
    away = (points - np.array(wrapper.hinge)) @ np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
    away /= wrapper.size
    # Both cameras are a little off: its plates are where the other one has seen the wrapper.
    plates = away[
        (dough | glazed) & (np.abs(away - np.array(CLOSED_MIDDLE)) < np.array(CLOSED_ROOM)).all(axis=1)
    ]
    off = np.zeros(3)
    if len(plates) >= MIN_PIXELS:
        low, high = np.percentile(plates, (1.0, 99.0), axis=0)
        off = (low + high) / 2.0 - np.array(CLOSED_MIDDLE)
    if float(np.abs(off).max()) > OFF_SIDE:
        return False
    along, across, above = (away[green] - off).T
    near = (along > -0.01) & (along < 2.0 * HINGE_TO_PLATE + 0.01) & (np.abs(across) < PLATE_HALF[1] + 0.01)
    between = near & (above > 0.0) & (above < CLOSED_HEIGHT)
    inside = (along < HINGE_TO_PLATE + PLATE_HALF[0]) & (np.abs(across) < PLATE_HALF[1])
    if len(plates) >= MIN_PIXELS and not between.any():
        return None
    return int((between & inside).sum()) >= MIN_FILLING_PIXELS and not bool((between & ~inside).any())


def coloured_points(picture: Picture, seen: Points) -> tuple[Points, Mask, Mask, Mask]:
    """Return the points of a picture, and masks of those on plate A, on plate B and on the filling.

    What is too small is noise.
    """
    # Between a plate and what lies on it, a median has the colour of neither.
    rgb, smooth = picture.rgb, smooth_colours(picture.rgb)
    low = seen[:, :, 2] < MAX_HEIGHT
    colours = [
        low & has_red_ratios(rgb, green, (None, bluest), MIN_BRIGHTNESS) for green, bluest in PLATE_COLOURS
    ]
    colours.append(low & has_dominant_colour(smooth, 1, GREEN_DOMINANCE, MIN_GREEN))
    dough, glazed, green = (without_specks(mask, MIN_PATCH).reshape(-1) for mask in colours)
    return seen.reshape(-1, 3), dough, glazed, green
