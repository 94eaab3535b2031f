"""What memory holds, for people: summed up, searched, or whole.  Reads, and may while the agent is awake."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from aeros.agent.errors import RefusedError
from aeros.agent.memory.posterior import Record
from aeros.agent.memory.schema import connected
from aeros.agent.memory.store import Usual, record_in, usual_in

_JSON: Final = frozenset(("inputs", "before", "after", "context", "details", "value", "causes"))
_TABLES: Final = {"session": "sessions", "episode": "episodes", "event": "events", "fact": "facts"}
_REASONS: Final = 3


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which episodes: all that is not None must fit.

    text: part of the status, outcome, reason or inputs, in any case of ASCII letters.
    skill: MODULE.SKILL.
    """

    text: str | None = None
    skill: str | None = None
    task: str | None = None
    outcome: str | None = None
    failed: bool | None = None
    session: int | None = None


@dataclass(frozen=True, slots=True)
class SkillSummary:
    """What is remembered of a skill.

    record: ever; contexts: by context, None where it was not kept.
    reasons: the commonest reasons of its failures, and how often each was given.
    """

    skill: str
    record: Record
    usual: Usual | None
    contexts: tuple[tuple[dict[str, Any] | None, Record], ...]
    reasons: tuple[tuple[str, int], ...]


class Recollection:
    """Reads one memory; made by `recollection`."""

    def __init__(self, database: sqlite3.Connection) -> None:
        self._database = database

    def skills(self, name: str | None = None) -> Iterator[SkillSummary]:
        """Every skill that was ever tried, or the one of this name, MODULE.SKILL."""
        sql = "SELECT DISTINCT module, skill FROM episodes ORDER BY module, skill"
        for module, skill in self._run(sql):
            if name in (None, f"{module}.{skill}"):
                yield SkillSummary(
                    f"{module}.{skill}",
                    record_in(self._database, module, skill),
                    usual_in(self._database, module, skill),
                    tuple(self._contexts(module, skill)),
                    tuple(self._reasons(module, skill)),
                )

    def _contexts(self, module: str, skill: str) -> Iterator[tuple[dict[str, Any] | None, Record]]:
        sql = """SELECT context, sum(failed = 0), sum(failed = 1) FROM episodes
                 WHERE module = ? AND skill = ? AND counts = 1 GROUP BY context ORDER BY max(id) DESC"""
        for context, successes, failures in self._run(sql, module, skill):
            yield None if context is None else json.loads(context), Record(successes, failures)

    def _reasons(self, module: str, skill: str) -> list[tuple[str, int]]:
        sql = """SELECT reason, count(*) FROM episodes WHERE module = ? AND skill = ? AND failed = 1
                 GROUP BY reason ORDER BY count(*) DESC, max(id) DESC LIMIT ?"""
        return [(reason, count) for reason, count in self._run(sql, module, skill, _REASONS)]

    def search(self, wanted: Wanted, most: int) -> list[dict[str, Any]]:
        """The latest `most` episodes that are wanted, newest first; all columns, JSON decoded."""
        text = None if wanted.text is None else f"%{_escaped(wanted.text)}%"
        said = "coalesce(status, '') || char(10) || coalesce(outcome, '') || char(10) || coalesce(reason, '')"
        conditions = {
            f"{said} || char(10) || inputs LIKE ? ESCAPE '!'": text,
            "module || '.' || skill = ?": wanted.skill,
            "task = ?": wanted.task,
            "outcome = ?": wanted.outcome,
            "failed = ?": None if wanted.failed is None else int(wanted.failed),
            "session = ?": wanted.session,
        }
        asked = {condition: value for condition, value in conditions.items() if value is not None}
        where = " AND ".join(asked) or "true"
        sql = f"SELECT * FROM episodes WHERE {where} ORDER BY id DESC LIMIT ?"  # noqa: S608  the texts above
        return [_decoded(row) for row in self._rows(sql, *asked.values(), most)]

    def broken_assumptions(self) -> list[dict[str, Any]]:
        """What was measured that a certificate's proofs exclude, oldest first: session, time and details."""
        sql = "SELECT session, time, details FROM events WHERE kind = 'broken-assumption' ORDER BY id"
        return [
            {"session": session, "time": time, **json.loads(details)}
            for session, time, details in self._run(sql)
        ]

    def facts(self) -> list[dict[str, Any]]:
        """Every fact, by key."""
        return [_decoded(row) for row in self._rows("SELECT * FROM facts ORDER BY key")]

    def sessions(self) -> list[dict[str, Any]]:
        """Every session, and how many episodes it has."""
        sql = """SELECT sessions.*, count(episodes.id) AS episodes FROM sessions
                 LEFT JOIN episodes ON episodes.session = sessions.id GROUP BY sessions.id"""
        return self._rows(sql)

    def everything(self) -> Iterator[dict[str, Any]]:
        """Every row there is, each with its `kind`."""
        for kind, table in _TABLES.items():
            for row in self._rows(f"SELECT * FROM {table} ORDER BY 1"):  # noqa: S608  a name of the above
                # An event has a kind of its own.
                yield {"row": kind, **_decoded(row)}

    def _rows(self, sql: str, *given: Any) -> list[dict[str, Any]]:
        cursor = self._run(sql, *given)
        names = [column[0] for column in cursor.description]
        return [dict(zip(names, row, strict=True)) for row in cursor]

    def _run(self, sql: str, *given: Any) -> sqlite3.Cursor:
        return self._database.execute(sql, given)


@contextmanager
def recollection(path: Path) -> Iterator[Recollection]:
    """What the memory at `path` holds; raises `RefusedError` where there is none or it cannot be trusted."""
    if not path.exists():
        raise RefusedError(f"nothing is remembered here: there is no {path}")
    database = connected(path)
    try:
        yield Recollection(database)
    except sqlite3.Error as error:
        raise RefusedError(f"the agent's memory {path} is damaged or cannot be used: {error}") from error
    finally:
        database.close()


def _decoded(row: dict[str, Any]) -> dict[str, Any]:
    return {
        name: json.loads(value) if name in _JSON and value is not None else value
        for name, value in row.items()
    }


def _escaped(text: str) -> str:
    return text.replace("!", "!!").replace("%", "!%").replace("_", "!_")
