"""Lengths of pushes that give a hand room."""

AMPLE = 0.06
"""Distance that an object is pushed beyond the first place with room for a hand, m."""

APPROACH = 0.06
"""Part of a push that moves nothing, m: the way before contact, and the loss as the object turns."""

LONGEST = 0.32
"""The longest push, m; a longer way begins with half of it."""


def push_length(distance: float) -> float:
    """Return how far the fingers go that push an object by a distance to where a hand has room, m."""
    way = distance + AMPLE
    if way > LONGEST:
        way = min(way / 2, LONGEST)
    return way + APPROACH
