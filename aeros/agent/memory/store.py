"""What the agent remembers, durably: sessions, one episode a step, events, and facts.

A write has reached the disk when the method returns (WAL, `synchronous=FULL`).  An episode is
written before its step starts, so after kill -9 the step that was under way is known: it is the
one without an ending.  A database that is damaged, foreign or newer than this code is refused
with the reason; nothing is repaired or replaced silently.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import quantiles
from typing import Any, Final, TypeVar

from aeros.agent.errors import AgentError
from aeros.agent.identity import Identity
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.schema import open_database

_T = TypeVar("_T")

_ENCODER: Final = json.JSONEncoder(allow_nan=False, sort_keys=True)

INTERRUPTED: Final = "interrupted"
"""The status of a step whose ending nobody saw."""

_DURATION_SAMPLES: Final = 101
"""How many of the latest successes say how long a skill usually takes."""


@dataclass(frozen=True, slots=True)
class EpisodeStart:
    """What is known of a step before it starts.

    started: plant seconds.
    context: what the step's ending will be evidence of; see `context.py`.
    """

    task: str
    module: str
    skill: str
    role: str
    inputs: Mapping[str, Any]
    started: float
    before: Mapping[str, Any]
    context: str


@dataclass(frozen=True, slots=True)
class EpisodeEnd:
    """What became of the step.

    outcome: None where no declared one was measured.
    counts: whether it says how good the skill is.
    causes: the reason as data, JSON values.
    """

    status: str
    outcome: str | None
    failed: bool
    reason: str
    ended: float
    after: Mapping[str, Any]
    counts_toward_record: bool
    causes: Sequence[Mapping[str, Any]] = ()


@dataclass(frozen=True, slots=True)
class DurationStats:
    """How long the latest successes of a skill took, plant seconds: their median and quartiles.

    successes: how many they are.
    """

    median: float
    low: float
    high: float
    successes: int

    def __str__(self) -> str:
        return f"{self.median:.1f} s, half of them {self.low:.1f} to {self.high:.1f} s"


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

    def start_episode(self, step: EpisodeStart) -> int:
        """Remember that a step starts; the number to end it by."""
        sql = """INSERT INTO episodes
                 (session, task, module, skill, role, inputs, started, before, context)
                 VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)"""
        inputs, before = _json(step.inputs), _json(step.before)
        what = (step.task, step.module, step.skill, step.role)
        row = (self._session, *what, inputs, step.started, before, step.context)
        episode = self._run(sql, row).lastrowid
        assert episode is not None  # noqa: S101  an INSERT always has one
        return episode

    def end_episode(self, episode: int, how: EpisodeEnd) -> None:
        """Remember how that step ended."""
        sql = """UPDATE episodes
                 SET status = ?, outcome = ?, failed = ?, reason = ?, ended = ?, after = ?, counts = ?,
                     causes = ?
                 WHERE id = ?"""
        what = (how.status, how.outcome, int(how.failed), how.reason, how.ended)
        self._run(sql, (*what, _json(how.after), int(how.counts_toward_record), _json(how.causes), episode))

    def mark_interrupted(self) -> list[str]:
        """Mark every step without an ending as interrupted; their skills, as `MODULE.SKILL`."""
        sql = (
            "UPDATE episodes SET status = ?, counts = 0 WHERE status IS NULL RETURNING module || '.' || skill"
        )
        return [skill for (skill,) in self._run(sql, (INTERRUPTED,)).fetchall()]

    def add_event(self, time: float, kind: str, details: Mapping[str, Any]) -> None:
        """Keep an event of this session; `time` in plant seconds."""
        sql = "INSERT INTO events (session, time, kind, details) VALUES (?, ?, ?, ?)"
        self._run(sql, (self._session, time, kind, _json(details)))

    def set_fact(self, key: str, value: Any, source: str) -> None:
        """Keep a fact, in place of what was known under `key`; `value` is JSON."""
        sql = "INSERT OR REPLACE INTO facts (key, value, source, learned) VALUES (?, ?, ?, ?)"
        self._run(sql, (key, _json(value), source, _utc_now()))

    def get_fact(self, key: str) -> Fact | None:
        """The fact known under `key`."""
        row = self._run("SELECT value, source FROM facts WHERE key = ?", (key,)).fetchone()
        return None if row is None else Fact(json.loads(row[0]), row[1])

    def success_record(self, module: str, skill: str, context: str | None = None) -> SuccessRecord:
        """How often the skill succeeded and failed, in `context` or ever, where its ending counts."""
        return self._query(lambda database: read_success_record(database, module, skill, context))

    def typical_duration(self, module: str, skill: str) -> DurationStats | None:
        """How long the latest successes of the skill took; None where there is none."""
        return self._query(lambda database: read_typical_duration(database, module, skill))

    def latest_episode(self) -> int:
        """The number of the latest episode, 0 before the first."""
        (latest,) = self._run("SELECT coalesce(max(id), 0) FROM episodes", ()).fetchone()
        return int(latest)

    def end_session(self) -> None:
        """Mark what was under way as interrupted, and the session as over."""
        self.mark_interrupted()
        self._run("UPDATE sessions SET ended = ? WHERE id = ?", (_utc_now(), self._session))

    def _run(self, sql: str, row: tuple[Any, ...]) -> sqlite3.Cursor:
        return self._query(lambda database: database.execute(sql, row))

    def _query(self, read: Callable[[sqlite3.Connection], _T]) -> _T:
        try:
            return read(self._database)
        except sqlite3.Error as error:
            raise AgentError(f"the agent's memory failed: {error}") from error


def read_success_record(
    database: sqlite3.Connection, module: str, skill: str, context: str | None = None
) -> SuccessRecord:
    """See `Memory.success_record`."""
    sql = """SELECT coalesce(sum(failed = 0), 0), coalesce(sum(failed = 1), 0) FROM episodes
             WHERE module = ? AND skill = ? AND counts = 1 AND (? IS NULL OR context = ?)"""
    return SuccessRecord(*database.execute(sql, (module, skill, context, context)).fetchone())


def read_typical_duration(database: sqlite3.Connection, module: str, skill: str) -> DurationStats | None:
    """See `Memory.typical_duration`."""
    sql = """SELECT ended - started FROM episodes
             WHERE module = ? AND skill = ? AND counts = 1 AND failed = 0 ORDER BY id DESC LIMIT ?"""
    took = [seconds for (seconds,) in database.execute(sql, (module, skill, _DURATION_SAMPLES))]
    if not took:
        return None
    low, median, high = quantiles(took * 2 if len(took) == 1 else took, method="inclusive")
    return DurationStats(median, low, high, len(took))


@contextmanager
def open_memory(path: Path, identity: Identity) -> Iterator[Memory]:
    """The memory at `path`, in a new session of `identity`; raises `AgentError` if it cannot be trusted."""
    database = open_database(path)
    try:
        memory = Memory(database, _new_session(database, path, identity))
        try:
            yield memory
        finally:
            memory.end_session()
    finally:
        database.close()


def _new_session(database: sqlite3.Connection, path: Path, identity: Identity) -> int:
    row = (str(identity.id), identity.sessions, _utc_now())
    try:
        inserted = database.execute("INSERT INTO sessions (agent, number, began) VALUES (?, ?, ?)", row)
    except sqlite3.Error as error:
        raise AgentError(f"the agent's memory {path} is damaged or cannot be used: {error}") from error
    assert inserted.lastrowid is not None  # noqa: S101  an INSERT always has one
    return inserted.lastrowid


def _json(value: Any) -> str:
    return _ENCODER.encode(value)


def _utc_now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
