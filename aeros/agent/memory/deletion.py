"""Forgetting, at somebody's word: what is forgotten is overwritten in the file, and not only left out.

Only while no agent is awake, as an agent decides by what it remembers.  All of it is one transaction.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final, TypeAlias

from aeros.agent.errors import RefusedError
from aeros.agent.identity import exclusive
from aeros.agent.memory.schema import connected


@dataclass(frozen=True, slots=True)
class Forgotten:
    """How many rows of each table are gone."""

    sessions: int
    episodes: int
    events: int
    facts: int


Which: TypeAlias = Callable[[sqlite3.Connection], None]
"""Deletes what is to be forgotten."""

_TABLES: Final = ("sessions", "episodes", "events", "facts")


def of_skill(name: str) -> Which:
    """The episodes of MODULE.SKILL, and every event and fact that mentions it."""
    mentioned = re.compile(rf"(?<![\w.]){re.escape(name)}(?!\w)")

    def forget(database: sqlite3.Connection) -> None:
        database.create_function("mentions", 1, lambda text: mentioned.search(text) is not None)
        database.execute("DELETE FROM episodes WHERE module || '.' || skill = ?", (name,))
        database.execute("DELETE FROM events WHERE mentions(details)")
        database.execute("DELETE FROM facts WHERE mentions(key) OR mentions(value)")

    return forget


def of_session(number: int) -> Which:
    """A session by its id, with all that it remembered and learned."""
    return lambda database: _forget_sessions(database, "id = ?", number)


def before(time: datetime) -> Which:
    """Every session that began before `time`, and what was learned before it."""
    text = time.isoformat(timespec="seconds")

    def forget(database: sqlite3.Connection) -> None:
        _forget_sessions(database, "began < ?", text)
        database.execute("DELETE FROM facts WHERE learned < ?", (text,))

    return forget


def _forget_sessions(database: sqlite3.Connection, which: str, value: int | str) -> None:
    within = f"(SELECT id FROM sessions WHERE {which})"  # noqa: S608  of this file
    sources = f"(SELECT 'session ' || number FROM sessions WHERE {which})"  # noqa: S608
    database.execute(f"DELETE FROM facts WHERE source IN {sources}", (value,))  # noqa: S608
    for table in ("episodes", "events"):
        database.execute(f"DELETE FROM {table} WHERE session IN {within}", (value,))  # noqa: S608
    database.execute(f"DELETE FROM sessions WHERE {which}", (value,))  # noqa: S608


def forget(folder: Path, path: Path, which: Which) -> Forgotten:
    """Forget it, in the memory at `path` of the agent whose state folder is `folder`.

    Raises `RefusedError` where an agent is awake, or there is no memory that can be trusted.
    """
    if not path.exists():
        raise RefusedError(f"nothing is remembered here: there is no {path}")
    with exclusive(folder):
        database = connected(path)
        try:
            return _forget(database, which)
        except sqlite3.Error as error:
            raise RefusedError(f"the agent's memory {path} could not forget it: {error}") from error
        finally:
            database.close()


def _forget(database: sqlite3.Connection, which: Which) -> Forgotten:
    database.execute("BEGIN IMMEDIATE")
    try:
        there = _counted(database)
        which(database)
        left = _counted(database)
        database.execute("COMMIT")
    except BaseException:
        database.execute("ROLLBACK")
        raise
    # Pages that were freed earlier, and the log of writes, may hold it still.
    database.execute("VACUUM")
    database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return Forgotten(*(before_ - after for before_, after in zip(there, left, strict=True)))


def _counted(database: sqlite3.Connection) -> list[int]:
    counts = (database.execute(f"SELECT count(*) FROM {table}") for table in _TABLES)  # noqa: S608
    return [row[0] for (row,) in counts]
