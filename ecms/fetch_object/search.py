"""The search for an object: the squares of floor and stands that pictures showed without it.

Where a picture is too dark to show the object's colour it shows nothing, which is another reason to stop than
that the object is not there. All lengths in metres, in the world frame.
"""

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
    """

    lit: dict[Cell, float]
    dark: dict[Cell, tuple[float, Place]]

    def look_at(
        self,
        time: float,
        points: Points,
        is_lit: Mask,
        stands: Points,
        last: Place | None,
        *,
        is_partly_dark: bool = False,
    ) -> dict[str, Any]:
        """Add a picture that does not show the object, and say how much has been looked over.

        Args:
            time: of the picture, s.
            points: what it shows (…, 3), m.
            is_lit: mask of those that are bright enough to show the object's colour (…).
            stands: places of the stands (n, 2), m.
            last: where the object was seen last, m; None if it was not seen yet.
            is_partly_dark: a part of it is seen there, beside what is dark.

        Returns:
            Estimates of the variables that say it, by name; None for an unknown one.
        """
        low, high = stands.min(axis=0) + SEARCH_WIDE[0], stands.max(axis=0) + SEARCH_WIDE[1]
        inside = ((low < points[..., :2]) & (points[..., :2] < high)).all(axis=-1)
        self.lit.update((cell, time) for cell in _cells(points[inside & is_lit], low))
        self.dark.update((cell, (time, at)) for cell, at in _cells(points[inside & ~is_lit], low).items())
        # Squares at the far edges are not whole, and do not count.
        rows, columns = ((high - low) / SEARCH_CELL).astype(np.intp).tolist()
        since, whole = time - SEARCH_AGE, max(1.0, float(rows * columns))
        lit = {(i, k) for (i, k), at in self.lit.items() if at >= since and i < rows and k < columns}
        dark = {
            (i, k): place
            for (i, k), (at, place) in self.dark.items()
            if at >= since and i < rows and k < columns and (i, k) not in lit
        }
        is_absent = len(lit) >= SEARCHED_SHARE * whole and not is_partly_dark
        is_last_dark = is_partly_dark
        if last is not None:
            is_last_dark |= not dark.keys().isdisjoint(_cells(np.array([last]), low))
        is_all_shown = len(lit) + len(dark) >= SEARCHED_SHARE * whole
        amid = last if is_last_dark else sorted(dark.values())[len(dark) // 2] if dark else None
        return {
            "object_searched": estimate(min(1.0, len(lit) / whole), 0.02, time=time),
            "object_absent": estimate(is_absent, time=time),
            "search_darkened": estimate(not is_absent and (is_last_dark or is_all_shown), time=time),
            "object_dark_place": None if amid is None else estimate(amid, SEARCH_CELL, time=time),
        }


def _cells(points: Points, low: Points) -> dict[Cell, Place]:
    """Return the squares that points (n, 3) are in, from the lowest corner on, with a point in each."""
    cells = ((points[:, :2] - low) / SEARCH_CELL).astype(np.intp)
    squares, first = np.unique(cells, axis=0, return_index=True)
    places = points[first].tolist()
    return {(i, k): (x, y, z) for (i, k), (x, y, z) in zip(squares.tolist(), places, strict=True)}
