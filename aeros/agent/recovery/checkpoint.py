"""What a resumed agent must know, kept at every step boundary and at the end, whole or not at all.

Two generations are kept.  A checkpoint counts only if it is of this schema, its digest is right, it is of
this agent, and the audit record holds the very record at which it was made.  One that does not is named,
and the one before it is looked at; what happened since, the audit record tells (`recovery.py`).

What the gate decides on (the use of quotas, histories) is not in it: that is the runtime's, which has it
from its own record, so that nothing the agent keeps has a say in what is allowed.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, NamedTuple

from aeros.agent.errors import RefusedError
from aeros.agent.execution.progress import Begun, Place, Progress, Tried
from aeros.agent.execution.report import RunReport, StepRecord
from aeros.agent.execution.step_attempt import Attempt
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.recovery.json_values import Writing
from aeros.files import replace_file
from aeros.runtime.ports import Head
from aeros.spec.migrations.formats import CHECKPOINT

SCHEMA: Final = CHECKPOINT.version

_FILE: Final = "checkpoint.json"
_PREVIOUS: Final = "checkpoint.previous.json"
_WRITING: Final = Writing((Attempt, Begun, Tried, RunReport, StepRecord))


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """Where one run stands.

    agent: its id.
    instruction, task, goal: what it pursues, in words.
    time: plant seconds.
    head: the end of the audit record when this was made.
    world: the predicates as measured last, for people; a resumed agent measures anew.
    replans, waited: how much of its budgets is used up; until: plant seconds when its time is over.
    denied, avoided: requests and skills that the gate denied for good; rejected: problems of the last plan.
    barred: what may have happened already (`bars.py`).
    planned_in: predicates as measured where plans were made.
    steps: what was run so far.
    plan: the plan that is followed, and how far; None where one is to be made.
    ended: what came of it, for whoever was not told; None as long as there is something to go on with.
    """

    agent: str
    instruction: str
    task: str
    goal: str
    time: float
    head: Head
    world: Mapping[str, Any]
    replans: int
    waited: float
    until: float | None
    denied: tuple[str, ...]
    avoided: tuple[tuple[str, str], ...]
    barred: tuple[str, ...]
    rejected: tuple[str, ...]
    planned_in: tuple[Mapping[str, Any], ...]
    steps: tuple[StepRecord, ...]
    plan: TaskGraph | None
    tried: tuple[tuple[Place, Tried], ...]
    settled: tuple[Place, ...]
    branches: tuple[tuple[Place, bool], ...]
    ended: RunReport | None = None

    @property
    def earliest(self) -> Head:
        """Where the audit record ended when the first of what is under way began, or else now."""
        heads = [one.begun.head for _, one in self.tried if one.begun is not None]
        return min([self.head, *heads])

    def progress(self) -> Progress:
        """How far the plan has come."""
        return Progress(dict(self.tried), set(self.settled), dict(self.branches))


class Ended(NamedTuple):
    """How a task ended, when on the plant's clock, and the end of the audit record then."""

    report: RunReport
    time: float
    head: Head


class UnusableError(ValueError):
    """A checkpoint cannot be gone on from; the message says why."""


class Checkpoints:
    """The checkpoints in an agent's folder; whoever makes one holds the folder's lock."""

    def __init__(self, folder: Path) -> None:
        self._path, self._previous = folder / _FILE, folder / _PREVIOUS

    def write(self, checkpoint: Checkpoint) -> None:
        """Keep it durably, and the one before it; raises `RefusedError`."""
        content = spelt(checkpoint)
        try:
            self._keep_previous()
            replace_file(self._path, content)
        except OSError as error:
            raise RefusedError(f"the checkpoint {self._path} cannot be written: {error.strerror}") from error

    def read(self) -> Iterator[Checkpoint | UnusableError]:
        """The newest first; or why it is none."""
        for path in (self._path, self._previous):
            try:
                yield understood(path.read_bytes(), path)
            except FileNotFoundError:
                continue
            except (OSError, ValueError) as error:
                yield UnusableError(f"{path}: {error}")

    def conclude(self, checkpoint: Checkpoint) -> None:
        """Keep durably how it ended, and nothing to go on with; raises `RefusedError`."""
        self.write(checkpoint)
        try:
            self._previous.unlink(missing_ok=True)
        except OSError as error:
            raise RefusedError(f"{self._previous} cannot be removed: {error.strerror}") from error

    def ended(self, instruction: str) -> Ended | None:
        """How that ended, if the newest says so: there is nothing to go on with, and no plant is needed."""
        newest = next(self.read(), None)
        if not isinstance(newest, Checkpoint) or newest.ended is None or newest.instruction != instruction:
            return None
        return Ended(newest.ended, newest.time, newest.head)

    def forget(self) -> None:
        """Nothing is left, not even how it ended."""
        for path in (self._path, self._previous):
            path.unlink(missing_ok=True)

    def _keep_previous(self) -> None:
        """By a second name, so that at each moment there is a newest."""
        beside = self._previous.with_name(self._previous.name + ".new")
        beside.unlink(missing_ok=True)
        with suppress(FileNotFoundError):
            os.link(self._path, beside)
            beside.replace(self._previous)


def spelt(checkpoint: Checkpoint) -> bytes:
    """As it is kept: JSON with the digest of its body."""
    held = {field.name: _WRITING.write(getattr(checkpoint, field.name)) for field in fields(checkpoint)}
    body = json.dumps(held, sort_keys=True, allow_nan=False)
    return json.dumps({"schema": SCHEMA, "digest": _digest(body), "body": body}, indent=1).encode()


def understood(content: bytes, path: Path) -> Checkpoint:
    """What was kept; raises `ValueError` where it is not whole or of another schema.

    path: where it was, for messages.
    """
    try:
        kept = json.loads(content)
        digest, body = kept["digest"], kept["body"]
        version = CHECKPOINT.version_of(kept)
        if version is not None and version != SCHEMA:
            raise UnusableError("; ".join(CHECKPOINT.refusal(version, path)))
        if digest != _digest(body):
            raise UnusableError("it is damaged: its digest is another")
        return Checkpoint(**{name: _WRITING.read(value) for name, value in json.loads(body).items()})
    except (KeyError, TypeError, AttributeError) as error:
        raise UnusableError("it is damaged: it is not laid out as a checkpoint is") from error


def _digest(body: str) -> str:
    return hashlib.sha256(body.encode()).hexdigest()
