"""Slips: how often in a row an object left the fingers as it was lifted. All lengths in metres.

A slip is chance, as after a bad look. Where each grip ends so, the object is too heavy or too smooth.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

LIFTED = 0.10
"""Rise of the tool from where the fingers closed, at which an object that is still held was lifted, m."""

SHUT_BELOW = 0.0145
"""Gap of fingers that closed on nothing, m: less than the narrowest that they hold. Open ones are wider."""

SLIPS_OUT = 2
"""Slips in a row that are more than chance."""


class Slips(NamedTuple):
    """Slips in a row of the object that is wanted.

    Attributes:
        wanted: the object that is wanted; None if that is unknown.
        gripped_at: height of the tool where the fingers closed on it, m; None if they do not hold it.
        times: slips since it was last lifted, or since it is wanted.
    """

    wanted: str | None = None
    gripped_at: float | None = None
    times: int = 0


NO_SLIP = Slips()


def slips_with(slips: Slips, given: Mapping[str, Any], held: bool | None) -> Slips:
    """Note what the hand feels now.

    Args:
        slips: what was felt before.
        given: readings, with the object that is wanted, the gap of the fingers and the tool's position.
        held: the hand holds it; None if that is unknown.

    Returns:
        What was felt until now.
    """
    if given.get("object") != slips.wanted:
        slips = Slips(given.get("object"))
    if held is None or "tool_position" not in given:
        return slips
    height = given["tool_position"][2]
    at = slips.gripped_at
    if held:
        at = height if at is None else at
        return Slips(slips.wanted, at, 0 if height - at > LIFTED else slips.times)
    is_slip = at is not None and given["finger_gap"] < SHUT_BELOW
    return Slips(slips.wanted, None, slips.times + is_slip)
