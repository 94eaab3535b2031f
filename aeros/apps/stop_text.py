"""Text about a stop, from its audit record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Any


def stop_text(details: Mapping[str, Any]) -> str:
    """Describe how the robot came to rest.

    Fields that are missing or have another form are left out, as the log may come from another version.

    Args:
        details: details of a `stopped` record.

    Returns:
        One line: reason, time, ways, greatest values, and least distances.
    """
    parts = [f"stopped: {details.get('reason')}"]
    times = details.get("began"), details.get("time")
    if all(map(_is_number, times)):
        began, ended = map(float, times)  # type: ignore[arg-type]
        parts.append(f"at rest after {ended - began:.3f} s")
    ways = details.get("ways")
    if isinstance(ways, dict):
        parts += [f"{name} moved {way:.3f} m" for name, way in ways.items() if _is_number(way)]
    late = details.get("late_ticks")
    if type(late) is int and late > 0:
        parts.append(f"{late} late tick{'s' if late > 1 else ''} so far")
    return "; ".join([*parts, *_extremes(details.get("quantities"))])


def _extremes(quantities: Any) -> Iterator[str]:
    """Yield the least value of each length and the greatest of every other quantity."""
    for name, one in quantities.items() if isinstance(quantities, dict) else ():
        if not isinstance(one, dict):
            continue
        unit = one.get("unit")
        word = "least" if unit == "m" else "greatest"
        if _is_number(one.get(word)):
            yield f"{word} {name} {one[word]:.3g} {unit}"


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and isfinite(value)
