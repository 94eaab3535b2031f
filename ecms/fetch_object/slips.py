"""Slips: how often in a row an object left the fingers as it was lifted. All lengths in metres.

A slip is chance, as after a bad look. Where each grip ends so, the object is too heavy or too smooth.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

LIFTED = 0.10
"""Rise of the tool from where the fingers closed, at which an object that is still held was lifted, m."""

SHUT_BELOW = 0.0145
"""Gap of fingers that closed on nothing, m: less than the narrowest that they hold. Open ones are wider."""

WIDER = 0.003
"""Rise of the gap over that of the grip from which on the fingers open, m: the object was let go."""

SLIPS_OUT = 2
"""Slips in a row that are more than chance."""


class Slips(NamedTuple):
    """Slips in a row of the object that is wanted.

    Attributes:
        wanted: the object that is wanted; None if that is unknown.
        gripped_at: height of the tool where the fingers closed on it, m; None if they do not hold it.
        gap: of the fingers that held it last, m.
        times: slips since it was last lifted, or since it is wanted.
        is_lifted: it was lifted in this grip, so that a loss is no slip.
    """

    wanted: str | None = None
    gripped_at: float | None = None
    gap: float = 0.0
    times: int = 0
    is_lifted: bool = False


NO_SLIP = Slips()


def slips_with(slips: Slips, given: Mapping[str, Any], held: bool | None) -> Slips:
    """Note what the hand feels now.

    Fingers that neither hold it any more nor are shut or wider are still on their way.

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
    height, gap, at = given["tool_position"][2], given["finger_gap"], slips.gripped_at
    if held:
        at = height if at is None else at
        is_lifted = slips.is_lifted or height - at > LIFTED
        return Slips(slips.wanted, at, gap, 0 if is_lifted else slips.times, is_lifted)
    if at is None or SHUT_BELOW <= gap <= slips.gap + WIDER:
        return slips
    is_slip = gap < SHUT_BELOW and not slips.is_lifted
    return Slips(slips.wanted, times=slips.times + is_slip)
