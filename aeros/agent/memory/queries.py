"""Queries of the memory for people: summaries, search and all rows.

They only read, and may do so while the agent is awake.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from aeros.agent.errors import AgentError
from aeros.agent.memory.evidence import (
    DurationStats,
    read_experience,
    read_hindrances,
    read_success_record,
    read_typical_duration,
)
from aeros.agent.memory.experience import ExperienceSource
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.schema import open_database
from aeros.agent.memory.sightings import RememberedValue, read_remembered

_JSON_COLUMNS: Final = frozenset(
    ("inputs", "before", "after", "context", "details", "value", "first_value", "causes")
)
_TABLES: Final = {
    "session": "sessions",
    "episode": "episodes",
    "event": "events",
    "fact": "facts",
    "sighting": "sightings",
}
_MAX_REASONS: Final = 3
_MAX_INPUTS: Final = 5


@dataclass(frozen=True, slots=True)
class EpisodeFilter:
    """Filter of episodes; every field that is not None must match.

    Attributes:
        text: part of the status, outcome, reason or inputs; ASCII letters match in either case.
        skill: skill as MODULE.SKILL.
        task: task as MODULE.TASK.
        outcome: id of the measured outcome.
        failed: True for failures, False for successes.
        session: id of the session.
    """

    text: str | None = None
    skill: str | None = None
    task: str | None = None
    outcome: str | None = None
    failed: bool | None = None
    session: int | None = None


@dataclass(frozen=True, slots=True)
class ContextSummary:
    """Record of a skill in one context on one plant.

    Attributes:
        context: the context; None if it was not kept.
        plant: name of the plant; None if it was not kept.
        record: successes and failures.
    """

    context: dict[str, Any] | None
    plant: str | None
    record: SuccessRecord


@dataclass(frozen=True, slots=True)
class SkillSummary:
    """Summary of the episodes of a skill.

    Attributes:
        skill: skill as MODULE.SKILL.
        record: successes and failures in all contexts.
        typical_duration: duration of its latest successes (s); None if there are none.
        contexts: record of each context on each plant.
        reasons: most frequent reasons of failure, with their counts.
        inputs: record with each set of inputs, most successful first; empty if there was only one.
        obstacles: rules, readings and conditions that denied, stopped or prevented the skill, each as its
            kind and name, with their counts.
    """

    skill: str
    record: SuccessRecord
    typical_duration: DurationStats | None
    contexts: tuple[ContextSummary, ...]
    reasons: tuple[tuple[str, int], ...]
    inputs: tuple[tuple[dict[str, Any], SuccessRecord], ...] = ()
    obstacles: tuple[tuple[str, str, int], ...] = ()


class MemoryReader:
    """Reader of one memory; made by `open_memory_reader`."""

    def __init__(self, database: sqlite3.Connection) -> None:
        self._database = database

    def skills(self, name: str | None = None) -> Iterator[SkillSummary]:
        """Summarize the skills that were ever tried.

        Args:
            name: the one skill wanted, as MODULE.SKILL; None for all.

        Yields:
            A summary of each skill, by module and skill.
        """
        sql = "SELECT DISTINCT module, skill FROM episodes ORDER BY module, skill"
        obstacles = read_hindrances(self._database)
        for module, skill in self._run(sql):
            if name in (None, f"{module}.{skill}"):
                yield SkillSummary(
                    f"{module}.{skill}",
                    read_success_record(self._database, module, skill),
                    read_typical_duration(self._database, module, skill),
                    tuple(self._contexts(module, skill)),
                    tuple(self._reasons(module, skill)),
                    tuple(self._inputs(module, skill)),
                    tuple(obstacles.get(f"{module}.{skill}", ())),
                )

    def experience_on(self, plant: str) -> ExperienceSource:
        """Make the reader of the ends of skills on a plant, for `with_experience`.

        Args:
            plant: name of the plant.

        Returns:
            The reader.
        """
        return lambda module, skill, code: read_experience(self._database, module, skill, (plant, code))

    def _contexts(self, module: str, skill: str) -> Iterator[ContextSummary]:
        sql = """SELECT context, plant, sum(failed = 0), sum(failed = 1)
                 FROM episodes JOIN sessions ON sessions.id = session
                 WHERE module = ? AND skill = ? AND counts = 1 GROUP BY context, plant
                 ORDER BY max(episodes.id) DESC"""
        for context, plant, *counts in self._run(sql, module, skill):
            decoded = None if context is None else json.loads(context)
            yield ContextSummary(decoded, plant, SuccessRecord(*counts))

    def _inputs(self, module: str, skill: str) -> list[tuple[dict[str, Any], SuccessRecord]]:
        sql = """SELECT inputs, sum(failed = 0), sum(failed = 1) FROM episodes
                 WHERE module = ? AND skill = ? AND counts = 1 GROUP BY inputs ORDER BY max(id) DESC"""
        found = [
            (json.loads(inputs), SuccessRecord(*counts)) for inputs, *counts in self._run(sql, module, skill)
        ]
        return sorted(found, key=lambda one: -one[1].mean)[:_MAX_INPUTS] if len(found) > 1 else []

    def _reasons(self, module: str, skill: str) -> list[tuple[str, int]]:
        sql = """SELECT reason, count(*) FROM episodes WHERE module = ? AND skill = ? AND failed = 1
                 GROUP BY reason ORDER BY count(*) DESC, max(id) DESC LIMIT ?"""
        return [(reason, count) for reason, count in self._run(sql, module, skill, _MAX_REASONS)]

    def search(self, filters: EpisodeFilter, limit: int) -> list[dict[str, Any]]:
        """Find the latest episodes that match.

        Args:
            filters: filter of episodes.
            limit: maximum number of episodes.

        Returns:
            All columns of each episode with JSON decoded, newest first.
        """
        text = None if filters.text is None else f"%{_escape_like(filters.text)}%"
        searched = (
            "coalesce(status, '') || char(10) || coalesce(outcome, '') || char(10) || coalesce(reason, '')"
        )
        conditions = {
            f"{searched} || char(10) || inputs LIKE ? ESCAPE '!'": text,
            "module || '.' || skill = ?": filters.skill,
            "task = ?": filters.task,
            "outcome = ?": filters.outcome,
            "failed = ?": None if filters.failed is None else int(filters.failed),
            "session = ?": filters.session,
        }
        asked = {condition: value for condition, value in conditions.items() if value is not None}
        where = " AND ".join(asked) or "true"
        sql = f"SELECT * FROM episodes WHERE {where} ORDER BY id DESC LIMIT ?"  # noqa: S608  the texts above
        return [_decode_row(row) for row in self._rows(sql, *asked.values(), limit)]

    def broken_assumptions(self) -> list[dict[str, Any]]:
        """List the recorded outcomes that the proofs of a certificate exclude.

        Returns:
            Session, time and details of each, oldest first.
        """
        sql = "SELECT session, time, details FROM events WHERE kind = 'broken-assumption' ORDER BY id"
        return [
            {"session": session, "time": time, **json.loads(details)}
            for session, time, details in self._run(sql)
        ]

    def remembered_values(self, plant: str | None = None) -> list[RememberedValue]:
        """List what was seen.

        Args:
            plant: name of the plant; None for that of the latest session.

        Returns:
            The memory of each variable, by name.
        """
        if plant is None:
            latest = self._run("SELECT plant FROM sessions ORDER BY id DESC LIMIT 1").fetchone()
            plant = "" if latest is None or latest[0] is None else str(latest[0])
        return read_remembered(self._database, plant)

    def facts(self) -> list[dict[str, Any]]:
        """List all facts.

        Returns:
            All columns of each fact, sorted by key.
        """
        return [_decode_row(row) for row in self._rows("SELECT * FROM facts ORDER BY key")]

    def sessions(self) -> list[dict[str, Any]]:
        """List all sessions.

        Returns:
            All columns of each session, and its number of `episodes`.
        """
        sql = """SELECT sessions.*, count(episodes.id) AS episodes FROM sessions
                 LEFT JOIN episodes ON episodes.session = sessions.id GROUP BY sessions.id"""
        return self._rows(sql)

    def all_rows(self) -> Iterator[dict[str, Any]]:
        """Read all rows of all tables.

        Yields:
            All columns of each row; `row` is the kind of row.
        """
        for kind, table in _TABLES.items():
            for row in self._rows(f"SELECT * FROM {table} ORDER BY 1"):  # noqa: S608  a name of the above
                # An event has a kind of its own.
                yield {"row": kind, **_decode_row(row)}

    def _rows(self, sql: str, *given: Any) -> list[dict[str, Any]]:
        cursor = self._run(sql, *given)
        names = [column[0] for column in cursor.description]
        return [dict(zip(names, row, strict=True)) for row in cursor]

    def _run(self, sql: str, *given: Any) -> sqlite3.Cursor:
        return self._database.execute(sql, given)


@contextmanager
def open_memory_reader(path: Path) -> Iterator[MemoryReader]:
    """Open the memory at `path` for reading.

    Args:
        path: file of the memory.

    Yields:
        A reader of it.

    Raises:
        AgentError: there is no memory, or it cannot be trusted.
    """
    if not path.exists():
        raise AgentError(f"nothing is remembered here: there is no {path}")
    database = open_database(path)
    try:
        yield MemoryReader(database)
    except sqlite3.Error as error:
        raise AgentError(f"the agent's memory {path} is damaged or cannot be used: {error}") from error
    finally:
        database.close()


def _decode_row(row: dict[str, Any]) -> dict[str, Any]:
    return {
        name: json.loads(value) if name in _JSON_COLUMNS and value is not None else value
        for name, value in row.items()
    }


def _escape_like(text: str) -> str:
    return text.replace("!", "!!").replace("%", "!%").replace("_", "!_")
