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

from aeros.agent.errors import AgentError
from aeros.agent.execution.progress import AttemptHistory, PlanProgress, StepPath, UnfinishedAttempt
from aeros.agent.execution.report import RunReport, StepRecord
from aeros.agent.execution.step_attempt import AttemptResult
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.recovery.json_values import ValueSerializer
from aeros.files import replace_durably
from aeros.runtime.ports import LogHead
from aeros.spec.migrations.formats import CHECKPOINT

SCHEMA: Final = CHECKPOINT.version

_FILE: Final = "checkpoint.json"
_PREVIOUS_FILE: Final = "checkpoint.previous.json"
_SERIALIZER: Final = ValueSerializer(
    (AttemptResult, UnfinishedAttempt, AttemptHistory, RunReport, StepRecord)
)


@dataclass(frozen=True, slots=True)
class TaskCheckpoint:
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
    audit_head: LogHead
    world: Mapping[str, Any]
    replans: int
    waited_s: float
    deadline: float | None
    denied_steps: tuple[str, ...]
    avoided_skills: tuple[tuple[str, str], ...]
    uncertain_steps: tuple[str, ...]
    last_plan_problems: tuple[str, ...]
    planning_states: tuple[Mapping[str, Any], ...]
    steps: tuple[StepRecord, ...]
    plan: TaskGraph | None
    attempts: tuple[tuple[StepPath, AttemptHistory], ...]
    done_paths: tuple[StepPath, ...]
    branch_choices: tuple[tuple[StepPath, bool], ...]
    final_report: RunReport | None = None

    @property
    def earliest_head(self) -> LogHead:
        """Where the audit record ended when the first of what is under way began, or else now."""
        heads = [one.unfinished.head for _, one in self.attempts if one.unfinished is not None]
        return min([self.audit_head, *heads])

    def progress(self) -> PlanProgress:
        """How far the plan has come."""
        return PlanProgress(dict(self.attempts), set(self.done_paths), dict(self.branch_choices))


class TaskEnd(NamedTuple):
    """How a task ended, when on the plant's clock, and the end of the audit record then."""

    report: RunReport
    time: float
    head: LogHead


class UnusableCheckpointError(ValueError):
    """A checkpoint cannot be gone on from; the message says why."""


class CheckpointStore:
    """The checkpoints in an agent's folder; whoever makes one holds the folder's lock."""

    def __init__(self, folder: Path) -> None:
        self._path, self._previous = folder / _FILE, folder / _PREVIOUS_FILE

    def write(self, checkpoint: TaskCheckpoint) -> None:
        """Keep it durably, and the one before it; raises `AgentError`."""
        content = encode_checkpoint(checkpoint)
        try:
            self._save_previous()
            replace_durably(self._path, content)
        except OSError as error:
            raise AgentError(f"the checkpoint {self._path} cannot be written: {error.strerror}") from error

    def read(self) -> Iterator[TaskCheckpoint | UnusableCheckpointError]:
        """The newest first; or why it is none."""
        for path in (self._path, self._previous):
            try:
                yield decode_checkpoint(path.read_bytes(), path)
            except FileNotFoundError:
                continue
            except (OSError, ValueError) as error:
                yield UnusableCheckpointError(f"{path}: {error}")

    def write_final(self, checkpoint: TaskCheckpoint) -> None:
        """Keep durably how it ended, and nothing to go on with; raises `AgentError`."""
        self.write(checkpoint)
        try:
            self._previous.unlink(missing_ok=True)
        except OSError as error:
            raise AgentError(f"{self._previous} cannot be removed: {error.strerror}") from error

    def read_final(self, instruction: str) -> TaskEnd | None:
        """How that ended, if the newest says so: there is nothing to go on with, and no plant is needed."""
        newest = next(self.read(), None)
        if (
            not isinstance(newest, TaskCheckpoint)
            or newest.final_report is None
            or newest.instruction != instruction
        ):
            return None
        return TaskEnd(newest.final_report, newest.time, newest.audit_head)

    def delete(self) -> None:
        """Nothing is left, not even how it ended."""
        for path in (self._path, self._previous):
            path.unlink(missing_ok=True)

    def _save_previous(self) -> None:
        """By a second name, so that at each moment there is a newest."""
        beside = self._previous.with_name(self._previous.name + ".new")
        beside.unlink(missing_ok=True)
        with suppress(FileNotFoundError):
            os.link(self._path, beside)
            beside.replace(self._previous)


def encode_checkpoint(checkpoint: TaskCheckpoint) -> bytes:
    """As it is kept: JSON with the digest of its body."""
    held = {field.name: _SERIALIZER.encode(getattr(checkpoint, field.name)) for field in fields(checkpoint)}
    body = json.dumps(held, sort_keys=True, allow_nan=False)
    return json.dumps({"schema": SCHEMA, "digest": _digest(body), "body": body}, indent=1).encode()


def decode_checkpoint(content: bytes, path: Path) -> TaskCheckpoint:
    """What was kept; raises `ValueError` where it is not whole or of another schema.

    path: where it was, for messages.
    """
    try:
        kept = json.loads(content)
        digest, body = kept["digest"], kept["body"]
        version = CHECKPOINT.version_of(kept)
        if version is not None and version != SCHEMA:
            raise UnusableCheckpointError("; ".join(CHECKPOINT.refusal(version, path)))
        if digest != _digest(body):
            raise UnusableCheckpointError("it is damaged: its digest is another")
        return TaskCheckpoint(**{name: _SERIALIZER.decode(value) for name, value in json.loads(body).items()})
    except (KeyError, TypeError, AttributeError) as error:
        raise UnusableCheckpointError("it is damaged: it is not laid out as a checkpoint is") from error


def _digest(body: str) -> str:
    return hashlib.sha256(body.encode()).hexdigest()
