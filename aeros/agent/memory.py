"""What the agent remembers, durably: sessions, one episode a step, events, and facts.

A write has reached the disk when the method returns (WAL, `synchronous=FULL`).  An episode is
written before its step starts, so after kill -9 the step that was under way is known: it is the
one without an ending.  A database that is damaged, foreign or newer than this code is refused
with the reason; nothing is repaired or replaced silently.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from aeros.agent.errors import RefusedError
from aeros.agent.identity import Identity
from aeros.runtime.ports import StepStatus

SCHEMA_VERSION: Final = 1
"""Kept in `PRAGMA user_version`; 0 there means a new, empty database."""

INTERRUPTED: Final = "interrupted"
"""The status of a step whose ending nobody saw."""

_NOT_ITS_DOING: Final = tuple(
    one.value for one in (StepStatus.REFUSED, StepStatus.HALTED, StepStatus.CANCELLED)
)
"""Endings that say nothing of how good a skill is."""

_SCHEMA = f"""
BEGIN;
CREATE TABLE sessions (
  id INTEGER PRIMARY KEY, agent TEXT NOT NULL, number INTEGER NOT NULL, began TEXT NOT NULL, ended TEXT
) STRICT;
CREATE TABLE episodes (
  id INTEGER PRIMARY KEY, session INTEGER NOT NULL REFERENCES sessions, task TEXT NOT NULL,
  module TEXT NOT NULL, skill TEXT NOT NULL, role TEXT NOT NULL, inputs TEXT NOT NULL,
  started REAL NOT NULL, before TEXT NOT NULL,
  status TEXT, outcome TEXT, failed INTEGER, reason TEXT, ended REAL, after TEXT
) STRICT;
CREATE INDEX episodes_of_skill ON episodes (module, skill);
CREATE TABLE events (
  id INTEGER PRIMARY KEY, session INTEGER NOT NULL REFERENCES sessions, time REAL NOT NULL,
  kind TEXT NOT NULL, details TEXT NOT NULL
) STRICT;
CREATE TABLE facts (
  key TEXT PRIMARY KEY, value TEXT NOT NULL, source TEXT NOT NULL, learned TEXT NOT NULL
) STRICT;
PRAGMA user_version = {SCHEMA_VERSION};
COMMIT;
"""


@dataclass(frozen=True, slots=True)
class Beginning:
    """What is known of a step before it starts; `started` in plant seconds."""

    task: str
    module: str
    skill: str
    role: str
    inputs: Mapping[str, Any]
    started: float
    before: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Ending:
    """What became of the step; `outcome` is None where no declared one was measured."""

    status: str
    outcome: str | None
    failed: bool
    reason: str
    ended: float
    after: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Fact:
    """Something learned, and from whom."""

    value: Any
    source: str


class Memory:
    """One session's hold on the database; made by `open_memory` alone."""

    def __init__(self, database: sqlite3.Connection, session: int) -> None:
        self._database = database
        self._session = session

    def begin(self, step: Beginning) -> int:
        """Remember that a step starts; the number to end it by."""
        sql = """INSERT INTO episodes (session, task, module, skill, role, inputs, started, before)
                 VALUES (?, ?, ?, ?, ?, ?, ?, ?)"""
        inputs, before = _json(step.inputs), _json(step.before)
        row = (self._session, step.task, step.module, step.skill, step.role, inputs, step.started, before)
        episode = self._run(sql, row).lastrowid
        assert episode is not None  # noqa: S101  an INSERT always has one
        return episode

    def end(self, episode: int, how: Ending) -> None:
        """Remember how that step ended."""
        sql = """UPDATE episodes SET status = ?, outcome = ?, failed = ?, reason = ?, ended = ?, after = ?
                 WHERE id = ?"""
        row = (how.status, how.outcome, int(how.failed), how.reason, how.ended, _json(how.after), episode)
        self._run(sql, row)

    def interrupt(self) -> list[str]:
        """Mark every step without an ending as interrupted; their skills, as `MODULE.SKILL`."""
        sql = "UPDATE episodes SET status = ? WHERE status IS NULL RETURNING module || '.' || skill"
        return [skill for (skill,) in self._run(sql, (INTERRUPTED,)).fetchall()]

    def remember(self, time: float, kind: str, details: Mapping[str, Any]) -> None:
        """Keep an event of this session; `time` in plant seconds."""
        sql = "INSERT INTO events (session, time, kind, details) VALUES (?, ?, ?, ?)"
        self._run(sql, (self._session, time, kind, _json(details)))

    def learn(self, key: str, value: Any, source: str) -> None:
        """Keep a fact, in place of what was known under `key`; `value` is JSON."""
        sql = "INSERT OR REPLACE INTO facts (key, value, source, learned) VALUES (?, ?, ?, ?)"
        self._run(sql, (key, _json(value), source, _utc_now()))

    def recall(self, key: str) -> Fact | None:
        """The fact known under `key`."""
        row = self._run("SELECT value, source FROM facts WHERE key = ?", (key,)).fetchone()
        return None if row is None else Fact(json.loads(row[0]), row[1])

    def record_of(self, skill: str) -> tuple[int, int]:
        """Successes and failures of `MODULE.SKILL`, ever; what others kept from its end is neither."""
        sql = """SELECT coalesce(sum(failed = 0), 0), coalesce(sum(failed = 1), 0) FROM episodes
                 WHERE module || '.' || skill = ? AND status NOT IN (?, ?, ?)"""
        successes, failures = self._run(sql, (skill, *_NOT_ITS_DOING)).fetchone()
        return successes, failures

    def end_session(self) -> None:
        """Mark what was under way as interrupted, and the session as over."""
        self.interrupt()
        self._run("UPDATE sessions SET ended = ? WHERE id = ?", (_utc_now(), self._session))

    def _run(self, sql: str, row: tuple[Any, ...]) -> sqlite3.Cursor:
        try:
            return self._database.execute(sql, row)
        except sqlite3.Error as error:
            raise RefusedError(f"the agent's memory failed: {error}") from error


@contextmanager
def open_memory(path: Path, identity: Identity) -> Iterator[Memory]:
    """The memory at `path`, in a new session of `identity`; raises `RefusedError` if it cannot be trusted."""
    try:
        # Autocommit: each statement is one transaction, durable when it returns.
        database = sqlite3.connect(path, isolation_level=None)
    except sqlite3.Error as error:
        raise RefusedError(f"the agent's memory {path} cannot be opened: {error}") from error
    try:
        session = _prepare(database, path, identity)
        memory = Memory(database, session)
        try:
            yield memory
        finally:
            memory.end_session()
    finally:
        database.close()


def _prepare(database: sqlite3.Connection, path: Path, identity: Identity) -> int:
    try:
        (version,) = database.execute("PRAGMA user_version").fetchone()
        (tables,) = database.execute("SELECT count(*) FROM sqlite_schema").fetchone()
        if version > SCHEMA_VERSION:
            raise RefusedError(
                f"the agent's memory {path} has schema {version}; this version reads up to {SCHEMA_VERSION}"
            )
        if version < 0 or (version == 0 and tables):
            raise RefusedError(f"{path} is a database of something else, not the agent's memory")
        (health,) = database.execute("PRAGMA quick_check(1)").fetchone()
        if health != "ok":
            raise RefusedError(f"the agent's memory {path} is damaged: {health}")
        database.execute("PRAGMA journal_mode = WAL")
        database.execute("PRAGMA synchronous = FULL")
        database.execute("PRAGMA foreign_keys = ON")
        if version == 0:
            database.executescript(_SCHEMA)
        row = (str(identity.id), identity.sessions, _utc_now())
        inserted = database.execute("INSERT INTO sessions (agent, number, began) VALUES (?, ?, ?)", row)
    except sqlite3.Error as error:
        raise RefusedError(f"the agent's memory {path} is damaged or cannot be used: {error}") from error
    assert inserted.lastrowid is not None  # noqa: S101  an INSERT always has one
    return inserted.lastrowid


def _json(value: Any) -> str:
    return json.dumps(value, allow_nan=False, sort_keys=True)


def _utc_now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
