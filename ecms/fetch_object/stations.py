"""Places of the base from which the object is put down, for the skills and for the perceiver of the aisle."""

from math import sqrt

REACH = 0.50
"""Distance in front of the arm's base at which objects are put down, m."""

EASTMOST = 0.03
"""Greatest x of the arm's base, m: 5 mm inside the site's `floor`, whose bound no double is."""


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
