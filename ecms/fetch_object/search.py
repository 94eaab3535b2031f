"""The search for an object: the squares of floor and stands that pictures showed without it.

Where a picture is too dark to show the object's colour it shows nothing, which is another reason to stop than
that the object is not there. All lengths in metres, in the world frame.
"""

from collections.abc import Iterable
from math import inf
from typing import Any, NamedTuple

import numpy as np

from aeros.perception import Mask, Points, estimate

Cell = tuple[int, int]
Place = tuple[float, float, float]

NOTHING: tuple[Points, Mask] = (np.zeros((0, 3)), np.zeros(0, np.bool_))
"""Points that a picture shows, and a mask of those in light, of a picture that is no look."""

SEARCH_CELL = 0.08
"""Edge of the squares of floor and stands that are looked over, m: about as large as an object."""

SEARCH_WIDE = ((-0.75, -0.45), (0.25, 0.45))
"""Margins of the searched area around the stands' places, along x and y, m: the aisle is part of it."""

SEARCH_AGE = 60.0
"""Greatest age of a picture that still counts as a look at a square, s."""

SEARCHED_SHARE = 0.98
"""Share of it that was looked over when nothing is there: the rest are single squares that the arm hides. The
carriage hides 7 %, so the camera over the aisle has to look when it stands elsewhere, too."""


class Search(NamedTuple):
    """Squares that pictures showed since the object was missed.

    Attributes:
        lit: those in light, with the time of the last such picture, s.
        dark: those too dark to show the object's colour, with that time and a point there, m.
        unlike: those with something of its colour that is larger than the object, with the same.
    """

    lit: dict[Cell, float]
    dark: dict[Cell, tuple[float, Place]]
    unlike: dict[Cell, tuple[float, Place]]

    def count_elsewhere(self, points: Points, stands: Points) -> int:
        """Count points that are not where something larger of the object's colour was shown.

        Args:
            points: of its colour (n, 3), m.
            stands: places of the stands (n, 2), m.
        """
        low = stands.min(axis=0) + SEARCH_WIDE[0]
        cells = ((points[:, :2] - low) / SEARCH_CELL).astype(np.intp).tolist()
        around = {(i + u, k + v) for i, k in self.unlike for u in (-1, 0, 1) for v in (-1, 0, 1)}
        return sum((i, k) not in around for i, k in cells)

    def look_at(
        self,
        time: float,
        points: Points,
        is_lit: Mask,
        stands: Points,
        last: Place | None,
        *,
        is_partly_dark: bool = False,
        unlike: Points | None = None,
    ) -> dict[str, Any]:
        """Add a picture that does not show the object, and say how much has been looked over.

        Args:
            time: of the picture, s.
            points: what it shows (…, 3), m.
            is_lit: mask of those that are bright enough to show the object's colour (…).
            stands: places of the stands (n, 2), m.
            last: where the object was seen last, m; None if it was not seen yet.
            is_partly_dark: a part of it is seen there, beside what is dark.
            unlike: points of its colour that are of something larger (n, 3), m; None if not looked for.

        Returns:
            Estimates of the variables that say it, by name; None for an unknown one.
        """
        low, high = stands.min(axis=0) + SEARCH_WIDE[0], stands.max(axis=0) + SEARCH_WIDE[1]
        inside = ((low < points[..., :2]) & (points[..., :2] < high)).all(axis=-1)
        shown = _cells(points[inside & is_lit], low)
        self.lit.update((cell, time) for cell in shown)
        if unlike is not None:
            for cell in shown:
                self.unlike.pop(cell, None)
            self.unlike.update((cell, (time, at)) for cell, at in _cells(unlike, low).items())
        self.dark.update((cell, (time, at)) for cell, at in _cells(points[inside & ~is_lit], low).items())
        # Squares at the far edges are not whole, and do not count.
        rows, columns = ((high - low) / SEARCH_CELL).astype(np.intp).tolist()
        since, whole = time - SEARCH_AGE, max(1.0, float(rows * columns))
        larger = {cell: place for cell, (at, place) in self.unlike.items() if at >= since}
        inner = [(i, k) for i in range(rows) for k in range(columns) if (i, k) not in larger]
        lit = {cell for cell in inner if self.lit.get(cell, -inf) >= since}
        dark = {
            cell: self.dark[cell][1]
            for cell in inner
            if cell not in lit and cell in self.dark and self.dark[cell][0] >= since
        }
        is_last_dark = is_partly_dark
        if last is not None:
            is_last_dark |= not dark.keys().isdisjoint(_cells(np.array([last]), low))
        needed = SEARCHED_SHARE * whole
        # Larger things beyond the area are in the way of nothing in it.
        shown_or_larger = len(lit) + rows * columns - len(inner)
        is_absent = len(lit) >= needed and not is_partly_dark and not larger
        is_unlike = bool(larger) and shown_or_larger >= needed and not is_last_dark
        is_darkened = is_last_dark or (bool(dark) and shown_or_larger + len(dark) >= needed)
        amid = last if is_last_dark else _amid(dark.values())
        amid_larger = _amid(larger.values())
        return {
            "object_searched": estimate(min(1.0, len(lit) / whole), 0.02, time=time),
            "object_absent": estimate(is_absent, time=time),
            "object_unlike": estimate(is_unlike, time=time),
            "object_unlike_place": (
                None if amid_larger is None else estimate(amid_larger, SEARCH_CELL, time=time)
            ),
            "search_darkened": estimate(is_darkened and not is_absent and not is_unlike, time=time),
            "object_dark_place": None if amid is None else estimate(amid, SEARCH_CELL, time=time),
        }


def _amid(places: Iterable[Place]) -> Place | None:
    """Return the middle one of places in order; None without any."""
    ordered = sorted(places)
    return ordered[len(ordered) // 2] if ordered else None


def _cells(points: Points, low: Points) -> dict[Cell, Place]:
    """Return the squares that points (n, 3) are in, from the lowest corner on, with a point in each."""
    cells = ((points[:, :2] - low) / SEARCH_CELL).astype(np.intp)
    squares, first = np.unique(cells, axis=0, return_index=True)
    places = points[first].tolist()
    return {(i, k): (x, y, z) for (i, k), (x, y, z) in zip(squares.tolist(), places, strict=True)}
