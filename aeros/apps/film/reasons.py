"""Short sentences about the values that broke a rule, for captions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from aeros.apps.rule_causes import RuleCause, Shortfall

PERSON_DISTANCE: Final = "human_distance"
"""State variable that measures how far the nearest person is."""


def in_words(name: str) -> str:
    """Write a name as words, without the module before it.

    Args:
        name: name of a variable, an action or a rule.

    Returns:
        The words.
    """
    return name.rpartition(".")[2].replace("_", " ").replace("-", " ")


def reason_text(causes: Sequence[RuleCause]) -> str:
    """Say why an action was not allowed as it was requested.

    Args:
        causes: rules that bit.

    Returns:
        One sentence of the first rule whose values are known; empty without causes.
    """
    known = next((one for one in causes if one.shortfalls), None)
    if known is None:
        return f"{in_words(causes[0].rule)}: {causes[0].text}".rstrip(": ") if causes else ""
    person = next((one for one in known.shortfalls if one.quantity == PERSON_DISTANCE), None)
    others = [one for one in known.shortfalls if one.quantity != PERSON_DISTANCE]
    if person is None:
        return "; ".join(_needed(one) for one in others)
    if not others:
        return f"person at {person.value:.2f} m, {person.bound:.2f} m needed"
    changed = ", ".join(
        f"{in_words(one.quantity)} {one.bound:.2f} in place of {one.value:.2f} {one.unit}" for one in others
    )
    return f"person first at {person.value:.2f} m: {changed}"


def _needed(one: Shortfall) -> str:
    side = "at most" if one.is_upper else "at least"
    unit = f" {one.unit}" if one.unit else ""
    return f"{in_words(one.quantity)} {one.value:.3g}{unit}, {side} {one.bound:.3g}{unit} needed"


def action_text(kind: str, requested: Mapping[str, Any], decided: Mapping[str, Any]) -> str:
    """Describe an action.

    Args:
        kind: its kind.
        requested: parameters as requested.
        decided: parameters as decided; empty if it was denied.

    Returns:
        Its kind with its speed, or with what it looks with.
    """
    words = in_words(kind)
    parameters = decided or requested
    speed, camera = parameters.get("speed"), parameters.get("camera")
    if type(speed) in (int, float):
        return f"{words} at {speed:.2f} m/s"
    if type(camera) is str:
        return f"{words} with camera {camera}"
    return words
