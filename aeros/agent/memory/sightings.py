"""Sightings: the first and the latest value of each variable in each session.

So a later session knows where things were last seen and where they usually are at first. Such knowledge is
for planners and people. No condition reads it: a value that is not measured now stays unknown.
"""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import dist
from typing import Any, Final, TypeGuard

from aeros.agent.world.values import to_json_value
from aeros.agent.world.world import WorldModel
from aeros.runtime.ports import Obstacle
from aeros.spec.model.variables import Declared

SAME_PLACE_M: Final = 0.15
"""Greatest distance of two positions that count as the same usual place, m: about a hand's width."""

MAX_SESSIONS: Final = 50
"""Number of the latest sessions on the plant that are read."""

REFRESH_S: Final = 10.0
"""Plant time after which an unchanged value is written again, s, so that its age is known to this."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """A value that was measured.

    Attributes:
        variable: name of the variable.
        value: JSON value (SI).
        time: plant time of the measurement, s.
        source: sensor or module that measured it; None if the site names none.
        uncertainty: declared bound of its standard uncertainty (SI); None if there is none.
        derived_from: variables that an attribute of a thing follows from, by name; empty for a variable.
    """

    variable: str
    value: Any
    time: float
    source: str | None
    uncertainty: float | None
    derived_from: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RememberedValue:
    """Memory of a variable on one plant.

    Attributes:
        variable: name of the variable.
        value: latest value, JSON (SI).
        seen: UTC time at which it was written, ISO 8601.
        session: id of the session.
        source: sensor or module that measured it; None if it is not known.
        uncertainty: declared bound of its standard uncertainty (SI); None if there is none.
        usual: most frequent value at the beginning of a session; of positions, the one with the most others
            within `SAME_PLACE_M`.
        usual_sessions: number of sessions that began with it.
        sessions: number of sessions in which it was seen.
    """

    variable: str
    value: Any
    seen: str
    session: int
    source: str | None
    uncertainty: float | None
    usual: Any
    usual_sessions: int
    sessions: int

    def age(self, now: datetime) -> float:
        """Compute the age of the latest value.

        Args:
            now: a time with its time zone.

        Returns:
            Seconds.
        """
        return (now - datetime.fromisoformat(self.seen)).total_seconds()


class SightingLog:
    """Writer of sightings; writes only those that are new.

    Args:
        database: connection to the memory.
        session: id of the session.
    """

    def __init__(self, database: sqlite3.Connection, session: int) -> None:
        self._database = database
        self._session = session
        self._written: dict[str, Sighting] = {}

    def write(self, sightings: Iterable[Sighting]) -> None:
        """Write the sightings whose values are new, or were written too long ago, in one transaction.

        Args:
            sightings: what was measured.
        """
        new = [one for one in sightings if self._is_new(one)]
        if not new:
            return
        now = datetime.now(UTC).isoformat(timespec="seconds")
        sql = """INSERT INTO sightings
                 (session, variable, first_value, value, time, seen, source, uncertainty, derived_from)
                 VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)
                 ON CONFLICT (session, variable) DO UPDATE SET value = excluded.value, time = excluded.time,
                 seen = excluded.seen, source = excluded.source, uncertainty = excluded.uncertainty,
                 derived_from = excluded.derived_from"""
        rows = []
        for one in new:
            value = json.dumps(one.value)
            seen = (value, value, one.time, now, one.source, one.uncertainty)
            origin = json.dumps(one.derived_from) if one.derived_from else None
            rows.append((self._session, one.variable, *seen, origin))
        self._database.execute("BEGIN IMMEDIATE")
        try:
            self._database.executemany(sql, rows)
        except BaseException:
            self._database.execute("ROLLBACK")
            raise
        self._database.execute("COMMIT")
        self._written |= {one.variable: one for one in new}

    def _is_new(self, one: Sighting) -> bool:
        written = self._written.get(one.variable)
        return written is None or written.value != one.value or one.time - written.time >= REFRESH_S


def sightings_of(world: WorldModel, state: Mapping[str, Declared]) -> Iterator[Sighting]:
    """List what is measured in a world.

    Args:
        world: the world.
        state: declared state variables by name.

    Yields:
        Each known value but those that come from memory.
    """
    for name in (one for one in world.known if not state[one].is_recalled):
        yield sighting_of_variable(name, world, state)


def sighting_of_variable(name: str, world: WorldModel, state: Mapping[str, Declared]) -> Sighting:
    """Return the known value of a variable as a sighting.

    Args:
        name: name of the variable.
        world: the world, in which it is known.
        state: declared state variables by name.

    Returns:
        The sighting.
    """
    declared, stamp = state[name], world.stamps[name]
    module, dot, _ = name.rpartition(".")
    uncertainty = None if declared.uncertainty is None else float(declared.uncertainty)
    source = stamp.source or (module if dot else None)
    return Sighting(name, to_json_value(world.known[name]), stamp.time, source, uncertainty)


def sighting_of_obstacle(obstacle: Obstacle) -> Sighting:
    """Return an obstacle as a sighting, under its own name.

    Args:
        obstacle: the obstacle.

    Returns:
        The sighting; its value says place and size.
    """
    _, _, value = str(obstacle).partition(" ")
    return Sighting(obstacle.name, value, obstacle.seen, f"camera {obstacle.camera}", None)


def sighting_of_free_space(name: str, time: float) -> Sighting:
    """Return as a sighting that an obstacle is gone.

    Args:
        name: name of the obstacle.
        time: plant time, s.

    Returns:
        The sighting.
    """
    return Sighting(name, "gone: its place was seen free", time, None, None)


def read_remembered(database: sqlite3.Connection, plant: str) -> list[RememberedValue]:
    """Read what was seen on a plant.

    Args:
        database: connection to the memory.
        plant: name of the plant.

    Returns:
        The memory of each variable, by name.
    """
    sql = """SELECT variable, first_value, value, seen, session, source, uncertainty
             FROM sightings WHERE session IN
             (SELECT id FROM sessions WHERE plant = ? ORDER BY id DESC LIMIT ?)
             ORDER BY variable, session"""
    rows: dict[str, list[tuple[Any, ...]]] = {}
    for variable, *row in database.execute(sql, (plant, MAX_SESSIONS)):
        rows.setdefault(variable, []).append(tuple(row))
    found = []
    for variable, seen in rows.items():
        usual, times = usual_value([json.loads(first) for first, *_ in seen])
        _, value, when, session, source, uncertainty = seen[-1]
        found.append(
            RememberedValue(
                variable, json.loads(value), when, session, source, uncertainty, usual, times, len(seen)
            )
        )
    return found


def usual_value(values: Sequence[Any]) -> tuple[Any, int]:
    """Find the most frequent value.

    Args:
        values: JSON values, oldest first; at least one.

    Returns:
        The value and its number. Of positions it is the one that has the most values within `SAME_PLACE_M`;
        of equally frequent ones it is the latest.
    """
    latest_first = list(reversed(values))
    if all(_is_position(one) for one in latest_first):
        near = [sum(dist(one, other) <= SAME_PLACE_M for other in latest_first) for one in latest_first]
    else:
        texts = [json.dumps(one) for one in latest_first]
        counts = Counter(texts)
        near = [counts[one] for one in texts]
    most = max(near)
    return latest_first[near.index(most)], most


def _is_position(value: Any) -> TypeGuard[list[float]]:
    return isinstance(value, list) and len(value) == 3 and all(type(one) in (int, float) for one in value)
