"""Waits of a step that cannot go on now: for a person, a sensor, a quota or a condition, and for how long."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Final

from aeros.spec.expr import terms as t
from aeros.spec.expr.shortfall import UnmetBound
from aeros.spec.model.cause import Cause
from aeros.spec.model.site import Site

MAX_WAIT_S: Final = 60.0
"""Longest total wait for anything but a quota before the agent gives up, in plant seconds."""

_QUOTA_CODE: Final = "AE742"
_CONDITIONS: Final = ("precondition", "hold")


@dataclass(frozen=True, slots=True)
class Wait:
    """Something that may allow a step later.

    Attributes:
        subject: what is waited for, in words that follow “until”.
        limit_s: longest wait that makes sense, in plant seconds.
    """

    subject: str
    limit_s: float = MAX_WAIT_S


def wait_after_denial(causes: Iterable[Cause], site: Site) -> Wait:
    """Say what a denial that may turn into an allowance waits for.

    Args:
        causes: causes of the denial.
        site: the site under which it was decided.

    Returns:
        The wait; for a quota it is as long as the window that frees it.
    """
    causes = tuple(causes)
    windows = {one.id: one.window_s for one in site.quotas}
    used_up = [cause.rule for cause in causes if cause.code == _QUOTA_CODE and cause.rule in windows]
    parts = [part for cause in causes for part in cause.shortfalls]
    subject = _subject(parts, site)
    if used_up:
        longest = max(float(windows[name]) for name in used_up)
        names = ", ".join(f"`{name}`" for name in used_up)
        freed = f"the quota {names} is free again, which takes {longest:g} s at most"
        # One more second, as the window ends between two tries.
        return Wait("; ".join(filter(None, (freed, subject))), max(MAX_WAIT_S, longest + 1.0))
    return Wait(subject or "the measured state changes")


def wait_for_condition(causes: Sequence[Cause], site: Site) -> Wait | None:
    """Say what a step waits for whose conditions are not met now.

    A condition on a quantity, or on what is not known, may be met later without any action. A predicate that
    is measured otherwise is changed by an action, so a plan that relies on it is wrong.

    Args:
        causes: why the step cannot start.
        site: the site.

    Returns:
        The wait; None if waiting cannot help.
    """
    parts = [part for cause in causes for part in cause.shortfalls]
    # Until all is known, a plan would be made on the same unknown values again.
    parts = [part for part in parts if part.value is None] or parts
    of_conditions = all(cause.kind in _CONDITIONS and cause.shortfalls for cause in causes)
    if not parts or not of_conditions or not all(map(_may_change, parts)):
        return None
    return Wait(_subject(parts, site))


def is_about_person(cause: Cause, site: Site) -> bool:
    """Check if a cause is that somebody is near.

    Args:
        cause: why a step did not go on.
        site: the site; its limits of contact name the distance to people.

    Returns:
        True if the distance to people is part of it.
    """
    contact = None if site.motion is None else site.motion.contact
    rules = (rule for rule in site.rules if rule.id == cause.rule)
    read = {name for rule in rules for term in rule.terms.values() for name in t.variables_of(term)}
    return (contact is not None and contact.distance in read) or any(
        _is_distance_to_people(part, site) for part in cause.shortfalls
    )


def _is_distance_to_people(part: UnmetBound, site: Site) -> bool:
    contact = None if site.motion is None else site.motion.contact
    return contact is not None and re.search(rf"\b{re.escape(contact.distance)}\b", part.quantity) is not None


def _may_change(part: UnmetBound) -> bool:
    """Return True for what is not known, and for a number that a state can meet."""
    if not part.quantity:
        return False
    return part.value is None or (isinstance(part.value, float) and abs(part.value) < inf)


def _subject(parts: Iterable[UnmetBound], site: Site) -> str:
    """Say what unmet parts of a condition wait for; empty for none."""
    parts = tuple(parts)
    for part in parts:
        if _is_distance_to_people(part, site) and isinstance(part.value, float):
            # Whatever else is not met, such as a speed, is allowed once nobody is near.
            return f"{_name_of_nearest(part.value, site)} goes away"
    return " and ".join(dict.fromkeys(map(_subject_of_part, parts)))


def _name_of_nearest(distance: float, site: Site) -> str:
    """Name the thing whose distance counts as that of people: a scanner cannot tell who or what it is."""
    contact = None if site.motion is None else site.motion.contact
    scanners = site.area_scanners
    if contact is not None and scanners is not None and scanners.measures == contact.distance:
        return f"something in the scanners' plane at {distance:.2f} m, which may be a person,"
    return f"the person at {distance:.2f} m"


def _subject_of_part(part: UnmetBound) -> str:
    if part.value is None:
        return f"`{part.quantity}` is measured"
    return f"{part.quantity} is {part.required_op} {part.formatted_values()[1]}"
