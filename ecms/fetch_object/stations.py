"""Places of the base from which the object is taken and put down, for the skills and for the perceivers."""

from math import copysign, sqrt

REACH = 0.50
"""Distance in front of the arm's base at which objects are put down, m."""

EASTMOST = 0.03
"""Greatest x of the arm's base, m: 5 mm inside the site's `floor`, whose bound no double is."""


WESTMOST = -0.595
"""Least x of the arm's base, m: 5 mm inside the site's `floor`, too."""

BEHIND = 0.45
"""Greatest distance of an object west of all places of the base at which it is picked from beside, m."""

STATION_TO_OBJECT = 0.58
"""Distance of the object from the arm's base where the base stands to pick it, m."""


def base_from(x: float, aside: float) -> tuple[float, float]:
    """Return where the base stands to pick an object, from the object.

    Args:
        x: of the object, m.
        aside: distance to its left, m; farther aside where the floor ends in the west, before or behind it.

    Returns:
        Offset of the base along x and y, m.
    """
    along = -sqrt(STATION_TO_OBJECT**2 - aside**2)
    if x + along >= WESTMOST or x < WESTMOST - BEHIND:
        return along, aside
    along = WESTMOST - x
    return along, copysign(sqrt(STATION_TO_OBJECT**2 - along**2), aside)


def base_for_delivery(place: tuple[float, float, float], aside: float) -> tuple[float, float]:
    """Return where the base stands to put an object down.

    Args:
        place: of the object, m.
        aside: distance to its left, m.

    Returns:
        Position of the base along x and y, m.
    """
    x, y, _ = place
    return min(EASTMOST, x - sqrt(max(0.0, REACH**2 - aside**2))), y + aside
