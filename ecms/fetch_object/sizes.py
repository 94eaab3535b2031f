"""Sizes of objects: which ones the hand can hold, and how high it grips them. All lengths in metres.

The gate decides a motion for a space around the tool that what is held may take up, the site's
`largest_object`. A hand that points down has its palm over the object, so it grips 30 mm below the top at
most, and one that is higher than 90 mm would hang out of that space. A site for taller objects declares a
larger space; then every module has to come down more slowly from farther above, with whatever it holds.
"""

GRASP = 0.012
"""Height of the tool over the middle of an object that stands, where it is neither low nor high, m."""

PALM = 0.030
"""Greatest height of an object's top over the tool, m: the palm is 37 mm over it, and it is seen within 5."""

BELOW = 0.060
"""Greatest depth of an object's underside below the tool, m: the site's `largest_object`."""

TIP, TOP = 0.012, 0.008
"""Least height of the tool over what the object stands on, and least depth below its top, m."""

NARROWEST, WIDEST = 0.015, 0.075
"""Least and greatest width between the fingers, m: they close to 10 mm and open 80 mm."""

LONGEST = 0.12
"""Greatest length across that, m: the site's `largest_object`."""


def grip_height(height: float, *, is_lying: bool) -> float:
    """Return the height of the tool over the middle of an object that it grips, m.

    Args:
        height: of the object, as it stands or lies, m.
        is_lying: it is a cylinder on its side.
    """
    if is_lying:
        return 0.0
    return max(height / 2.0 - PALM, TIP - height / 2.0, min(GRASP, height / 2.0 - TOP))


def fits_hand(length: float, width: float, height: float) -> bool:
    """Return True if the hand can hold an object that stands, whose longer side is `length`."""
    return NARROWEST <= width <= WIDEST and length <= LONGEST and height <= PALM + BELOW
