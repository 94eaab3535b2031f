"""Memory for perceivers: the places where the things of a module were seen, and where they usually are.

A place is no measurement. A perceiver gets it in a table of its own, with its age. The values that the
perceiver makes of it may be read by skills of its module, and by no condition (`Declared.is_recalled`).
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from typing import Any

from aeros.agent.memory.sightings import RememberedValue
from aeros.agent.memory.things import remembered_things
from aeros.spec.model.ecm import Ecm

POSITION = "position"
"""Attribute of a thing that is recalled."""


def recalled_places(
    remembered: Iterable[RememberedValue], modules: Iterable[Ecm], now: datetime, session: int
) -> dict[str, dict[str, Any]]:
    """Make the table of each module whose things may be recalled.

    Args:
        remembered: memory of variables, obstacles and things.
        modules: the modules.
        now: a time with its time zone.
        session: id of the present session.

    Returns:
        By module, then by thing and kind, as in `object.red_can`: `position` (m, in W) and `age` (s) where it
        was seen last, `uncertainty` (m) if it is known, and `in_session`, true if that was in this session;
        `usual`, the position (m, in W) at which most sessions saw it first, with the number of these,
        `usual_sessions`, and of all, `sessions`.
    """
    things = [one for one in remembered_things(remembered) if POSITION in one.attributes]
    tables: dict[str, dict[str, Any]] = {}
    for module in modules:
        recalled = {thing.name: thing.recall for thing in module.things.values() if thing.recall is not None}
        if recalled:
            tables[module.id] = {
                f"{one.name.removeprefix(f'{module.id}.')}.{one.kind}": _place(place, now, session)
                for one in things
                if one.name in recalled and (place := one.attributes[POSITION]).age(now) <= recalled[one.name]
            }
    return tables


def _place(remembered: RememberedValue, now: datetime, session: int) -> dict[str, Any]:
    place = {
        POSITION: tuple(remembered.value),
        "age": max(0.0, remembered.age(now)),
        "in_session": remembered.session == session,
        "usual": tuple(remembered.usual),
        "usual_sessions": float(remembered.usual_sessions),
        "sessions": float(remembered.sessions),
    }
    return place if remembered.uncertainty is None else {**place, "uncertainty": remembered.uncertainty}
