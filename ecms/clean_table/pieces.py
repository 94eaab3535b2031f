"""Pieces of clutter: where each is, and which one the hand can grip next."""

from collections.abc import Iterator
from math import cos, pi, sin
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import (
    Mask,
    Points,
    erode,
    estimate,
    min_area_rectangle,
    separate_parts,
    top_points,
    wrap_heading,
)

from .places import AREA, UNCERTAINTY, WAY_AROUND, Place, corners_in_world, part_of, raise_place, reaches

HAND_AROUND, HAND_FROM = 0.14, 0.07
"""Distance from the area, along y, within which the hand passes, m, and the height of its underside with a
margin, m."""

MIN_CORE = 4
"""Least number of pixels of a piece without its outermost ones: a wall of the bin has fewer."""

GRASPABLE = (0.065, 0.15, 0.095)
"""Greatest shorter side, longer side and height of a piece, or of a heap, that the hand can grip, m."""

LEAST_GRIPPED = 0.006
"""Least height of a piece that the hand can grip, m: its fingertips stay 3.5 mm above the table."""

HEAP_HEIGHT, HEAP_GRASP = 0.065, 0.035
"""Height above which a piece is gripped near its top, m, as it may be a heap, and depth of that grasp, m: the
upper piece comes first, and a single one hangs no lower than what may be held."""

HEADING_UNCERTAINTY = 0.05
"""Standard uncertainty of a heading, rad."""


class HandExtent(NamedTuple):
    """A part of the open hand, on both sides of the tool point.

    Attributes:
        thick: extent along the hand's heading, m.
        wide: nearest and farthest distance from the tool point along the way of the fingers, m.
        from_height: height of its lower end over the tool point, m.
    """

    thick: float
    wide: tuple[float, float]
    from_height: float


OPEN_HAND = (HandExtent(0.035, (0.0, 0.105), 0.034), HandExtent(0.013, (0.036, 0.064), -0.009))
"""Palm and fingers, 80 mm apart; with some millimetres to spare."""

IN_THE_WAY = 4
"""Number of points from which something is in the hand's way: fewer are noise."""


class Piece(NamedTuple):
    """A thing on the table that is neither the sponge nor the hand.

    Attributes:
        points: its points (n, 3), m; z counts from the table.
        place: its middle at half its height, or near the top of a high one, m.
        heading: of its longer side, rad.
        sides: shorter side, longer side and height, m.
    """

    points: Points
    place: Place
    heading: float
    sides: tuple[float, float, float]


def find_pieces(points: Points, cores: Mask, mask: Mask) -> Iterator[Piece]:
    """Locate each piece of a mask, whose core has neither its outermost pixels nor what is very thin."""
    for core in separate_parts(cores, MIN_CORE):
        # A core has lost one pixel on each side, and two at corners.
        part = ~erode(erode(~core)) & mask
        piece = points[part]
        top = float(np.median(top_points(piece)[:, 2]))
        box = min_area_rectangle(top_points(piece, top / 2.0)[:, :2])
        shorter, longer = sorted((box.length, box.width))
        middle = top / 2.0 if top < HEAP_HEIGHT else top - HEAP_GRASP
        yield Piece(piece, (box.x, box.y, middle), box.longer_heading, (shorter, longer, top))


def lifted_piece(piece: Piece, base: float) -> Piece:
    """Return a piece that lies on something `base` metres high; its points count from there."""
    (x, y, _), (shorter, longer, top) = piece.place, piece.sides
    points, middle = piece.points - np.array((0.0, 0.0, base)), (x, y, (base + top) / 2.0)
    return Piece(points, middle, piece.heading, (shorter, longer, top - base))


def choose_piece(
    loose: list[Piece], around: list[Points], area: Place, region: str, table: float
) -> dict[str, Any]:
    """Choose the piece to grip next, and its heading: none that is too large or flat, whose place is another.

    One with room for the hand comes first, then one in the way, then the nearest to the arm.

    Args:
        loose: the pieces to choose from.
        around: points of each thing on the table, those of the pieces among them.
        area: middle of the area to wipe.
        region: the part of the table to clean.
        table: height of the table, m.
    """
    fitting = [one for one in loose if _fits_the_hand(one, table)]
    others = [one for one in loose if not _fits_the_hand(one, table)]
    values: dict[str, Any] = {"clutter_ungraspable": bool(others)}
    if others:
        values["clutter_ungraspable_position"] = estimate(raise_place(others[0].place, table), UNCERTAINTY)
    if not fitting:
        return values
    fitting.sort(key=lambda one: (not is_in_the_way(one.points, area, region), one.place[0]))
    found = ((one, headings) for one in fitting if (headings := _headings_with_room(one, around)))
    piece, headings = next(found, (fitting[0], _headings(fitting[0])[:1]))
    heading = headings[0]
    return values | {
        "clutter_free_across": len(headings) > 1,
        "clutter_position": estimate(raise_place(piece.place, table), UNCERTAINTY),
        "clutter_yaw": estimate(heading, HEADING_UNCERTAINTY),
        "clutter_length": estimate(piece.sides[1], UNCERTAINTY),
    }


def _fits_the_hand(piece: Piece, table: float) -> bool:
    """Return True if the hand can grip a piece on a table of that height, m.

    On a lower table the fingertips stay where the site ends their way, and do not come as near to it.
    """
    is_small = all(side < most for side, most in zip(piece.sides, GRASPABLE, strict=True))
    return is_small and piece.sides[2] + min(table, 0.0) >= LEAST_GRIPPED


def _headings(piece: Piece) -> tuple[float, ...]:
    """Return the headings to grip a piece at: across, and along as well where both sides fit."""
    if piece.sides[1] >= GRASPABLE[0]:
        return (wrap_heading(piece.heading, pi),)
    first = wrap_heading(piece.heading, pi / 2.0)
    return (first, wrap_heading(first + pi / 2.0, pi))


def _headings_with_room(piece: Piece, around: list[Points]) -> tuple[float, ...]:
    """Return the headings at which an open hand meets no other thing."""
    others = [one for one in around if one is not piece.points]
    points = np.concatenate([np.empty((0, 3)), *others])
    return tuple(one for one in _headings(piece) if _has_room(points, piece.place, one))


def _has_room(points: Points, place: Place, yaw: float) -> bool:
    """Return True if an open hand at a place and heading meets none of the points.

    Args:
        points: points of all other things, (n, 3), in the frame of `place`, m.
        place: of the tool, m.
        yaw: heading of the hand, rad; the fingers close across it.
    """
    x, y, z = place
    away = points[:, :2] - np.array((x, y))
    along = np.abs(away @ np.array((cos(yaw), sin(yaw))))
    across = np.abs(away @ np.array((-sin(yaw), cos(yaw))))
    above = points[:, 2] - z
    return not any(
        np.count_nonzero(
            (along < part.thick)
            & (across >= part.wide[0])
            & (across < part.wide[1])
            & (above > part.from_height)
        )
        >= IN_THE_WAY
        for part in OPEN_HAND
    )


def is_in_the_way(points: Points, area: Place, region: str) -> bool:
    """Return True if a thing is where sponge and fingers pass, or as high as the hand where that passes."""
    (left, near), (right, far) = corners_in_world(area, part_of(AREA, region))
    around = (left - WAY_AROUND, near - WAY_AROUND), (right + WAY_AROUND, far + WAY_AROUND)
    beside = (left - WAY_AROUND, near - HAND_AROUND), (right + WAY_AROUND, far + HAND_AROUND)
    return reaches(points, around) or reaches(points[points[:, 2] > HAND_FROM], beside)
