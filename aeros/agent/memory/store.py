"""Durable memory of the agent: sessions, one episode per step, events and facts.

A write has reached the disk when its method returns (WAL, `synchronous=FULL`). An episode is written before
its step starts, so after kill -9 the interrupted step is known: its episode has no end. A database that is
damaged, foreign or newer than this code is refused with the reason; nothing is repaired or replaced silently.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, TypeVar

from aeros.agent.errors import AgentError
from aeros.agent.identity import Identity
from aeros.agent.memory.evidence import (
    DurationStats,
    Hindrance,
    SkillId,
    read_experience,
    read_hindrances,
    read_recent_duration,
    read_recent_records,
    read_success_record,
    read_typical_duration,
)
from aeros.agent.memory.experience import ExperiencedEnd
from aeros.agent.memory.posterior import RecentRecord, SuccessRecord
from aeros.agent.memory.schema import open_database
from aeros.agent.memory.sightings import RememberedValue, Sighting, SightingLog, read_remembered

_T = TypeVar("_T")

_ENCODER: Final = json.JSONEncoder(allow_nan=False, sort_keys=True)

INTERRUPTED: Final = "interrupted"
"""The status of a step whose ending nobody saw."""


@dataclass(frozen=True, slots=True)
class EpisodeStart:
    """The part of an episode that is known before its step starts.

    Attributes:
        task: task as MODULE.TASK.
        module: id of the module.
        skill: id of the skill.
        role: reason for the invocation, a value of `StepRole`.
        inputs: inputs by name, JSON values (SI).
        started: plant time (s).
        before: predicates as measured, JSON values.
        context: context in which the step's ending is evidence; see `context.py`.
        code: digest of the module's code and parameters.
    """

    task: str
    module: str
    skill: str
    role: str
    inputs: Mapping[str, Any]
    started: float
    before: Mapping[str, Any]
    context: str
    code: str = ""


@dataclass(frozen=True, slots=True)
class EpisodeEnd:
    """The part of an episode that is known when its step has ended.

    Attributes:
        status: status of the step, a value of `StepStatus`.
        outcome: declared outcome that was measured; None if none was.
        failed: True if the step counts as failed.
        reason: reason of a failure, in words.
        ended: plant time (s).
        after: predicates as measured, JSON values.
        counts_toward_record: True if it is evidence of how good the skill is.
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
class Fact:
    """A fact that was learned, and its source.

    Attributes:
        value: JSON value.
        source: origin of the value, as given to `Memory.set_fact`.
    """

    value: Any
    source: str


class Memory:
    """The memory in one session; made by `open_memory` alone.

    Only episodes on the plant of this session are evidence: what a simulator does says little of a robot.

    Attributes:
        session: id of the session.
    """

    def __init__(self, database: sqlite3.Connection, session: int, plant: str = "") -> None:
        self._database = database
        self.session: Final = session
        self._plant = plant
        self._sightings = SightingLog(database, session)

    def start_episode(self, step: EpisodeStart) -> int:
        """Write the start of an episode.

        Args:
            step: state before the step.

        Returns:
            The number of the episode, for `end_episode`.
        """
        sql = """INSERT INTO episodes
                 (session, task, module, skill, role, inputs, started, before, context, code)
                 VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"""
        inputs, before = _json(step.inputs), _json(step.before)
        what = (step.task, step.module, step.skill, step.role)
        row = (self.session, *what, inputs, step.started, before, step.context, step.code)
        episode = self._run(sql, row).lastrowid
        assert episode is not None  # noqa: S101  an INSERT always has one
        return episode

    def end_episode(self, episode: int, how: EpisodeEnd) -> None:
        """Write the end of an episode.

        Args:
            episode: number of the episode.
            how: result of the step.
        """
        sql = """UPDATE episodes
                 SET status = ?, outcome = ?, failed = ?, reason = ?, ended = ?, after = ?, counts = ?,
                     causes = ?
                 WHERE id = ?"""
        what = (how.status, how.outcome, int(how.failed), how.reason, how.ended)
        self._run(sql, (*what, _json(how.after), int(how.counts_toward_record), _json(how.causes), episode))

    def mark_interrupted(self) -> list[str]:
        """Mark every episode without an end as interrupted.

        Returns:
            Their skills, as MODULE.SKILL.
        """
        sql = (
            "UPDATE episodes SET status = ?, counts = 0 WHERE status IS NULL RETURNING module || '.' || skill"
        )
        return [skill for (skill,) in self._run(sql, (INTERRUPTED,)).fetchall()]

    def add_event(self, time: float, kind: str, details: Mapping[str, Any]) -> None:
        """Write an event of this session.

        Args:
            time: plant time (s).
            kind: kind of the event.
            details: JSON values.
        """
        sql = "INSERT INTO events (session, time, kind, details) VALUES (?, ?, ?, ?)"
        self._run(sql, (self.session, time, kind, _json(details)))

    def set_fact(self, key: str, value: Any, source: str) -> None:
        """Write a fact, replacing an earlier one of the same key.

        Args:
            key: key of the fact.
            value: JSON value.
            source: source of the fact.
        """
        sql = "INSERT OR REPLACE INTO facts (key, value, source, learned) VALUES (?, ?, ?, ?)"
        self._run(sql, (key, _json(value), source, _utc_now()))

    def get_fact(self, key: str) -> Fact | None:
        """Read a fact.

        Args:
            key: key of the fact.

        Returns:
            The fact; None if there is none.
        """
        row = self._run("SELECT value, source FROM facts WHERE key = ?", (key,)).fetchone()
        return None if row is None else Fact(json.loads(row[0]), row[1])

    def success_record(
        self, module: str, skill: str, context: str | None = None, until: int | None = None
    ) -> SuccessRecord:
        """Count the successes and failures of a skill on this plant, without endings that do not count.

        Args:
            module: id of the module.
            skill: id of the skill.
            context: context that must agree; None for all contexts.
            until: number of the last episode to count; None for all.

        Returns:
            The counts.
        """
        return self._query(
            lambda database: read_success_record(database, module, skill, context, self._plant, until)
        )

    def recent_records(self, contexts: Mapping[SkillId, str]) -> Mapping[SkillId, RecentRecord]:
        """Weigh the results of skills on this plant by their age, for a choice between the skills.

        Args:
            contexts: context that must agree, by module and id of the skill.

        Returns:
            The record of each skill.
        """
        return self._query(lambda database: read_recent_records(database, contexts, self._plant))

    def typical_duration(self, module: str, skill: str, code: str = "") -> DurationStats | None:
        """Summarize the durations of a skill's latest successes on this plant.

        Args:
            module: id of the module.
            skill: id of the skill.
            code: digest of the module's code and parameters; the durations of another are no evidence.

        Returns:
            Median and quartiles (s); None if there are no successes.
        """
        return self._query(
            lambda database: read_typical_duration(database, module, skill, (self._plant, code))
        )

    def recent_duration(self, module: str, skill: str, code: str, context: str) -> float | None:
        """Compute how long a success of a skill takes now on this plant, for a choice between skills.

        Args:
            module: id of the module.
            skill: id of the skill.
            code: digest of the module's code and parameters; the durations of another are no evidence.
            context: context that must agree; without a success in it, all contexts count.

        Returns:
            The median of the durations, weighed by their age, s; None if there are no successes.
        """
        return self._query(
            lambda database: read_recent_duration(database, module, skill, (self._plant, code), context)
        )

    def experience(
        self, module: str, skill: str, code: str, until: int | None = None
    ) -> Sequence[ExperiencedEnd]:
        """List the latest ends of a skill on this plant that are evidence; an `ExperienceSource`.

        Args:
            module: id of the module.
            skill: id of the skill.
            code: digest of the module's code and parameters, which must agree.
            until: number of the last episode to list; None for all.

        Returns:
            The ends, newest first.
        """
        origin = (self._plant, code)
        return self._query(lambda database: read_experience(database, module, skill, origin, until))

    def note_sightings(self, sightings: Iterable[Sighting]) -> None:
        """Write what was measured, as far as it is new.

        Args:
            sightings: what was measured.
        """
        self._query(lambda _: self._sightings.write(sightings))

    def remembered_values(self) -> Mapping[str, RememberedValue]:
        """Read what was seen on this plant, in this session and in earlier ones.

        Returns:
            The memory of each variable, by name.
        """
        found = self._query(lambda database: read_remembered(database, self._plant))
        return {one.variable: one for one in found}

    def hindrances(self) -> Mapping[str, Sequence[Hindrance]]:
        """Count what denied, stopped or prevented each skill in the latest 1,000 steps on this plant.

        Returns:
            For each skill, as MODULE.SKILL, its most frequent hindrances first.
        """
        return self._query(lambda database: read_hindrances(database, self._plant))

    def latest_episode(self) -> int:
        """Read the number of the latest episode.

        Returns:
            The number, 0 before the first.
        """
        (latest,) = self._run("SELECT coalesce(max(id), 0) FROM episodes", ()).fetchone()
        return int(latest)

    def end_session(self) -> None:
        """Mark running episodes as interrupted and the session as ended."""
        self.mark_interrupted()
        self._run("UPDATE sessions SET ended = ? WHERE id = ?", (_utc_now(), self.session))

    def _run(self, sql: str, row: tuple[Any, ...]) -> sqlite3.Cursor:
        return self._query(lambda database: database.execute(sql, row))

    def _query(self, read: Callable[[sqlite3.Connection], _T]) -> _T:
        try:
            return read(self._database)
        except sqlite3.Error as error:
            raise AgentError(f"the agent's memory failed: {error}") from error


@contextmanager
def open_memory(path: Path, identity: Identity, plant: str = "") -> Iterator[Memory]:
    """Open the memory at `path` in a new session.

    Args:
        path: file of the memory, or `IN_MEMORY`.
        identity: agent whose session it is.
        plant: name of the plant; only episodes on a plant of this name are evidence.

    Yields:
        The memory; its session ends with the block.

    Raises:
        AgentError: the memory cannot be trusted or used.
    """
    database = open_database(path)
    try:
        memory = Memory(database, _new_session(database, path, identity, plant), plant)
        try:
            yield memory
        finally:
            memory.end_session()
    finally:
        database.close()


def _new_session(database: sqlite3.Connection, path: Path, identity: Identity, plant: str) -> int:
    row = (str(identity.id), identity.sessions, _utc_now(), plant)
    try:
        sql = "INSERT INTO sessions (agent, number, began, plant) VALUES (?, ?, ?, ?)"
        inserted = database.execute(sql, row)
    except sqlite3.Error as error:
        raise AgentError(f"the agent's memory {path} is damaged or cannot be used: {error}") from error
    assert inserted.lastrowid is not None  # noqa: S101  an INSERT always has one
    return inserted.lastrowid


def _json(value: Any) -> str:
    return _ENCODER.encode(value)


def _utc_now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
