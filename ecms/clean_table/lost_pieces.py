"""Count of all clutter by volume, so that a piece that vanishes is missed."""

from math import dist, inf
from typing import Any, NamedTuple

from aeros.perception import Points, estimate, heap_volume

from .pieces import Piece
from .places import UNCERTAINTY, Place, raise_place

VOLUME_CELL = 0.005
"""Edge of a cell in which the height of clutter is taken, m: a pixel is 4 mm."""

MISSING_SHARE = 0.6
"""Share of the smallest piece's volume by which clutter must have become less for a piece to be missing:
volumes are seen to a quarter, and walls hide some."""

LEAST_LACK = 0.2
"""The same as a share of all clutter, so that a speck that was once seen is not missed."""


MOVED = 0.03
"""Distance from all pieces of a picture beyond which a piece of an earlier one is not among them, m."""


class Clutter(NamedTuple):
    """All clutter: volumes of it that were seen, m³, and where pieces were.

    `most` is the greatest volume that two pictures in a row have shown, `last` that of the last picture, or
    0, and `smallest` the smallest piece's. `places` are those of the last picture that showed loose pieces;
    once a piece has vanished, where it may have been.
    `is_missing` if a piece has vanished; None if one picture alone says so.
    """

    most: float
    last: float
    smallest: float
    places: tuple[Place, ...]
    is_missing: bool | None


def count_clutter(before: Clutter, loose: list[Piece], inside: Points, table: float) -> Clutter:
    """Compare the volume of all clutter, loose and in the bin, with the most that there was.

    Pieces in the bin lie on each other, so they are counted by volume.
    """
    volumes = [heap_volume(one.points, VOLUME_CELL) for one in loose]
    now = sum(volumes) + heap_volume(inside, VOLUME_CELL)
    most = max(before.most, min(before.last, now))
    smallest = min([before.smallest or inf, *volumes])
    places = tuple(raise_place(one.place, table) for one in loose)
    lack = 0.0 if smallest == inf else max(MISSING_SHARE * smallest, LEAST_LACK * most)
    is_less: bool | None = smallest < inf and now < most - lack
    if is_less and before.is_missing is False:
        is_less = None
    if is_less is not False:
        # It was where no piece is now; later pictures show only the others.
        gone = tuple(one for one in before.places if all(dist(one, other) > MOVED for other in places))
        places = gone or before.places
    return Clutter(most, now, 0.0 if smallest == inf else smallest, places or before.places, is_less)


def missing_values(clutter: Clutter) -> dict[str, Any]:
    """Return whether a piece has vanished, and where the last one was seen."""
    values: dict[str, Any] = {"clutter_missing": clutter.is_missing}
    if clutter.is_missing and clutter.places:
        values["clutter_last_seen"] = estimate(clutter.places[0], UNCERTAINTY)
    return values
