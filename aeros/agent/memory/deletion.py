"""Deletion of memories on request; deleted data is overwritten in the file, not only unlinked.

It works only while no agent is awake, because an agent decides by its memory. Each deletion is one
transaction.
"""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final, TypeAlias

from aeros.agent.errors import AgentError
from aeros.agent.identity import lock_folder
from aeros.agent.memory.schema import open_database
from aeros.agent.memory.things import THING


@dataclass(frozen=True, slots=True)
class DeletedRows:
    """Numbers of rows deleted from memory, by table, and of values deleted in other rows.

    Attributes:
        sessions: number of sessions.
        episodes: number of attempts of skills.
        events: number of events.
        facts: number of learned facts.
        sightings: number of variables seen, in each session.
        values: number of values, contexts, reasons and causes that the remaining episodes lost.
    """

    sessions: int
    episodes: int
    events: int
    facts: int
    sightings: int
    values: int = 0


DeletionFilter: TypeAlias = Callable[[sqlite3.Connection], object]
"""Function that deletes the selected rows of a memory."""

_TABLES: Final = ("sessions", "episodes", "events", "facts", "sightings")


def filter_by_skill(name: str) -> DeletionFilter:
    """Select the episodes of a skill, and every event and fact that mentions it.

    Args:
        name: skill as MODULE.SKILL.

    Returns:
        A function that deletes these rows.
    """
    mentioned = re.compile(rf"(?<![\w.]){re.escape(name)}(?!\w)")

    def forget(database: sqlite3.Connection) -> None:
        database.create_function("mentions", 1, lambda text: mentioned.search(text) is not None)
        database.execute("DELETE FROM episodes WHERE module || '.' || skill = ?", (name,))
        database.execute("DELETE FROM events WHERE mentions(details)")
        database.execute("DELETE FROM facts WHERE mentions(key) OR mentions(value)")

    return forget


def filter_by_variable(name: str) -> DeletionFilter:
    """Select what was seen of a variable or of a thing, and every event and fact that mentions it.

    What was seen of a thing goes with each variable that it follows from. Episodes lose the values of the
    variable, and the contexts, reasons and causes that mention it. A name that is not of the form MODULE.NAME
    may be any word, so nothing is deleted unless such a variable was seen or is in an episode.

    Args:
        name: name of the variable or of the thing.

    Returns:
        A function that deletes these rows.
    """
    mentioned = re.compile(rf"(?<![\w.]){re.escape(name)}(?!\w)")

    def forget(database: sqlite3.Connection) -> None:
        database.create_function(
            "mentions", 1, lambda text: text is not None and mentioned.search(text) is not None
        )
        database.create_function("without_value", 1, lambda text: _without_value(text, name))
        if _FULL_NAME.fullmatch(name) is None and not _is_remembered(database, name):
            return
        for table, condition in (
            ("events", "mentions(details)"),
            ("facts", "mentions(key) OR mentions(value)"),
        ):
            database.execute(f"DELETE FROM {table} WHERE {condition}")  # noqa: S608  of this file
        for column, value in _EPISODE_COLUMNS.items():
            database.execute(f"UPDATE episodes SET {column} = {value} WHERE mentions({column})")  # noqa: S608
        module, dot, _ = name.rpartition(".")
        things, of_module = f"{THING}{name} ", f"{THING}{module}{dot}"
        starts = "DELETE FROM sightings WHERE substr(variable, 1, ?) = ?"
        database.execute(starts, (len(things), things))
        # Older versions did not keep which variables an attribute follows from. A variable of the site, which
        # has no dot in its name, may be among those of the things of any module.
        is_variable = "EXISTS (SELECT 1 FROM sightings WHERE variable = ?)"
        older = f"{starts} AND derived_from IS NULL AND {is_variable}"
        database.execute(older, (len(of_module), of_module, name))
        database.execute("DELETE FROM sightings WHERE variable = ? OR mentions(derived_from)", (name,))

    return forget


def _is_remembered(database: sqlite3.Connection, name: str) -> bool:
    """Return True if a variable was seen, or describes a thing that was, or an episode has its value."""
    sql = """SELECT EXISTS (SELECT 1 FROM sightings WHERE variable = :name OR mentions(derived_from))
             OR EXISTS (SELECT 1 FROM episodes, json_each(before) WHERE key = :name)
             OR EXISTS (SELECT 1 FROM episodes, json_each(after) WHERE key = :name)"""
    (found,) = database.execute(sql, {"name": name}).fetchone()
    return bool(found)


_FULL_NAME: Final = re.compile(r"\w+(?:\.\w+)+")

_EPISODE_COLUMNS: Final = {
    "before": "without_value(before)",
    "after": "without_value(after)",
    "context": "NULL",
    "reason": "''",
    "causes": "NULL",
}
"""New values of the columns of an episode that mention a variable which is forgotten."""


def _without_value(text: str, name: str) -> str:
    """Remove a variable from a JSON object of values."""
    return json.dumps({key: value for key, value in json.loads(text).items() if key != name}, sort_keys=True)


def filter_by_session(number: int) -> DeletionFilter:
    """Select a session with its episodes and events and the facts learned in it.

    Args:
        number: id of the session.

    Returns:
        A function that deletes these rows.
    """
    return lambda database: _forget_sessions(database, "id = ?", number)


def filter_before(time: datetime) -> DeletionFilter:
    """Select every session that began before a time, and the facts learned before it.

    Args:
        time: the time, with its time zone.

    Returns:
        A function that deletes these rows.
    """
    text = time.isoformat(timespec="seconds")

    def forget(database: sqlite3.Connection) -> None:
        _forget_sessions(database, "began < ?", text)
        database.execute("DELETE FROM facts WHERE learned < ?", (text,))

    return forget


def _forget_sessions(database: sqlite3.Connection, which: str, value: int | str) -> None:
    within = f"(SELECT id FROM sessions WHERE {which})"  # noqa: S608  of this file
    sources = f"(SELECT 'session ' || number FROM sessions WHERE {which})"  # noqa: S608
    database.execute(f"DELETE FROM facts WHERE source IN {sources}", (value,))  # noqa: S608
    for table in ("episodes", "events", "sightings"):
        database.execute(f"DELETE FROM {table} WHERE session IN {within}", (value,))  # noqa: S608
    database.execute(f"DELETE FROM sessions WHERE {which}", (value,))  # noqa: S608


def forget(folder: Path, path: Path, rows: DeletionFilter) -> DeletedRows:
    """Delete rows of an agent's memory, and overwrite them in the file.

    Args:
        folder: state folder of the agent.
        path: file of the memory.
        rows: rows to delete, as the `filter_…` functions select them.

    Returns:
        The number of rows deleted.

    Raises:
        AgentError: an agent is awake, or there is no memory that can be trusted.
    """
    if not path.exists():
        raise AgentError(f"nothing is remembered here: there is no {path}")
    with lock_folder(folder):
        database = open_database(path)
        try:
            return _forget(database, rows)
        except sqlite3.Error as error:
            raise AgentError(f"the agent's memory {path} could not delete it: {error}") from error
        finally:
            database.close()


def _forget(database: sqlite3.Connection, which: DeletionFilter) -> DeletedRows:
    database.execute("BEGIN IMMEDIATE")
    try:
        there, changes = _row_counts(database), database.total_changes
        which(database)
        left, changes = _row_counts(database), database.total_changes - changes
        database.execute("COMMIT")
    except BaseException:
        database.execute("ROLLBACK")
        raise
    # Pages that were freed earlier, and the log of writes, may hold it still.
    database.execute("VACUUM")
    database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    deleted = [before_ - after for before_, after in zip(there, left, strict=True)]
    return DeletedRows(*(*deleted, changes - sum(deleted)))


def _row_counts(database: sqlite3.Connection) -> list[int]:
    counts = (database.execute(f"SELECT count(*) FROM {table}") for table in _TABLES)  # noqa: S608
    return [row[0] for (row,) in counts]
