"""Checkpoints of a run, written at every step boundary and at its end, each whole or not at all.

Two generations are kept. A checkpoint is valid only if it has this schema, its digest is right, it is of this
agent, and the audit record holds the very record at which it was made. An invalid one is named, and the
previous one is tried; the audit record says what happened since (`recover.py`).

State that the gate decides on (use of quotas, histories) is not in it: the runtime restores that from its own
record, so nothing that the agent keeps influences what is allowed.
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
from aeros.agent.execution.attempt import AttemptResult
from aeros.agent.execution.progress import AttemptHistory, PlanProgress, StepPath, UnfinishedAttempt
from aeros.agent.execution.report import RunReport, StepRecord
from aeros.agent.execution.waiting import Wait
from aeros.agent.planning.task_graph import TaskGraph
from aeros.agent.recovery.json_values import ValueSerializer
from aeros.files import replace_durably
from aeros.runtime.ports import LogHead
from aeros.spec.migrations.formats import CHECKPOINT

SCHEMA: Final = CHECKPOINT.version

_FILE: Final = "checkpoint.json"
_PREVIOUS_FILE: Final = "checkpoint.previous.json"
_SERIALIZER: Final = ValueSerializer(
    (AttemptResult, UnfinishedAttempt, AttemptHistory, RunReport, StepRecord, Wait)
)


@dataclass(frozen=True, slots=True)
class TaskCheckpoint:
    """State of one run.

    Attributes:
        agent: id of the agent.
        instruction: words of the user.
        task: task as MODULE.TASK.
        goal: goal as written.
        time: plant time (s).
        audit_head: end of the audit record when this was made.
        world: predicates as last measured, for people; a resumed agent measures anew.
        replans: re-plans so far.
        waited_s: plant time (s) waited so far after transient denials.
        deadline: plant time (s) at which the time limit of the task has passed; None for no limit.
        denied_steps: requests that the gate denied for good.
        avoided_skills: skills that the gate denied for good.
        uncertain_steps: steps that may have happened already (`uncertain_steps.py`).
        repeated_failures: failures that chance does not explain (`repeats.py`).
        last_plan_problems: problems of the last plan, if it was rejected.
        planning_states: predicates as measured where plans were made.
        steps: invocations so far.
        plan: plan that is followed; None if a new one is to be made.
        attempts: attempts at each step path.
        done_paths: step paths where nothing is left to do.
        branch_choices: decisions of the plan's `if`s.
        part_starts: plant time (s) at which each part with a timeout began.
        final_report: result of the run, for a user who did not receive it; None while it can be resumed.
        errand: number of the instruction's errands before this task.
        earlier_reports: reports of those errands.
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
    repeated_failures: tuple[str, ...]
    last_plan_problems: tuple[str, ...]
    planning_states: tuple[Mapping[str, Any], ...]
    steps: tuple[StepRecord, ...]
    plan: TaskGraph | None
    attempts: tuple[tuple[StepPath, AttemptHistory], ...]
    done_paths: tuple[StepPath, ...]
    branch_choices: tuple[tuple[StepPath, bool], ...]
    part_starts: tuple[tuple[StepPath, float], ...] = ()
    final_report: RunReport | None = None
    errand: int = 0
    earlier_reports: tuple[RunReport, ...] = ()

    @property
    def earliest_head(self) -> LogHead:
        """End of the audit record when the earliest unfinished attempt began; without one, `audit_head`."""
        heads = [one.unfinished.head for _, one in self.attempts if one.unfinished is not None]
        return min([self.audit_head, *heads])

    def progress(self) -> PlanProgress:
        """Restore the progress of the plan.

        Returns:
            A progress object with copies of the attempts, done paths and choices.
        """
        return PlanProgress(
            dict(self.attempts), set(self.done_paths), dict(self.branch_choices), dict(self.part_starts)
        )


class TaskEnd(NamedTuple):
    """End of a task.

    Attributes:
        report: the task's report.
        time: plant time (s).
        head: end of the audit record at that time.
    """

    report: RunReport
    time: float
    head: LogHead


class UnusableCheckpointError(ValueError):
    """A checkpoint that cannot be resumed from; the message says why."""


class CheckpointStore:
    """The checkpoints in an agent's folder. Its user must hold the folder's lock."""

    def __init__(self, folder: Path) -> None:
        self._path, self._previous = folder / _FILE, folder / _PREVIOUS_FILE

    def write(self, checkpoint: TaskCheckpoint) -> None:
        """Write a checkpoint durably and keep the previous one.

        Args:
            checkpoint: state of the run.

        Raises:
            AgentError: the file cannot be written.
        """
        content = encode_checkpoint(checkpoint)
        try:
            self._save_previous()
            replace_durably(self._path, content)
        except OSError as error:
            raise AgentError(f"the checkpoint {self._path} cannot be written: {error.strerror}") from error

    def read(self) -> Iterator[TaskCheckpoint | UnusableCheckpointError]:
        """Read the checkpoints, the newest first.

        Yields:
            Each checkpoint, or the reason that it is unusable.
        """
        for path in (self._path, self._previous):
            try:
                yield decode_checkpoint(path.read_bytes(), path)
            except FileNotFoundError:
                continue
            except (OSError, ValueError) as error:
                yield UnusableCheckpointError(f"{path}: {error}")

    def write_final(self, checkpoint: TaskCheckpoint) -> None:
        """Write the final checkpoint durably and delete the previous one, so that nothing is left to resume.

        Args:
            checkpoint: state of the run, with its `final_report`.

        Raises:
            AgentError: a file cannot be written or removed.
        """
        self.write(checkpoint)
        try:
            self._previous.unlink(missing_ok=True)
        except OSError as error:
            raise AgentError(f"{self._previous} cannot be removed: {error.strerror}") from error

    def read_final(self, instruction: str) -> TaskEnd | None:
        """Read the result of a run that has ended; this needs no plant.

        Args:
            instruction: instruction of the run.

        Returns:
            The result; None if the newest checkpoint is not final or is of another instruction.
        """
        newest = next(self.read(), None)
        if (
            not isinstance(newest, TaskCheckpoint)
            or newest.final_report is None
            or newest.instruction != instruction
        ):
            return None
        return TaskEnd(newest.final_report, newest.time, newest.audit_head)

    def delete(self) -> None:
        """Delete all checkpoints, the final one included."""
        for path in (self._path, self._previous):
            path.unlink(missing_ok=True)

    def _save_previous(self) -> None:
        """Keep the newest as the previous one, by a hard link, so that a newest one exists all the time."""
        link = self._previous.with_name(self._previous.name + ".new")
        link.unlink(missing_ok=True)
        with suppress(FileNotFoundError):
            os.link(self._path, link)
            link.replace(self._previous)


def encode_checkpoint(checkpoint: TaskCheckpoint) -> bytes:
    """Encode a checkpoint as JSON with the digest of its body.

    Args:
        checkpoint: state of the run.

    Returns:
        The content of the file.
    """
    held = {field.name: _SERIALIZER.encode(getattr(checkpoint, field.name)) for field in fields(checkpoint)}
    body = json.dumps(held, sort_keys=True, allow_nan=False)
    return json.dumps({"schema": SCHEMA, "digest": _digest(body), "body": body}, indent=1).encode()


def decode_checkpoint(content: bytes, path: Path) -> TaskCheckpoint:
    """Decode the content of a checkpoint file.

    Args:
        content: content of the file.
        path: path of the file, for messages.

    Returns:
        The checkpoint.

    Raises:
        UnusableCheckpointError: the content is damaged or of another schema.
    """
    try:
        kept = json.loads(content)
        digest, body = kept["digest"], kept["body"]
        version = CHECKPOINT.version_of(kept)
        if version is not None and version != SCHEMA:
            raise UnusableCheckpointError("; ".join(CHECKPOINT.refusal(version, path)))
        if digest != _digest(body):
            raise UnusableCheckpointError("it is damaged: its digest does not match")
        return TaskCheckpoint(**{name: _SERIALIZER.decode(value) for name, value in json.loads(body).items()})
    except (KeyError, TypeError, AttributeError) as error:
        raise UnusableCheckpointError("it is damaged: it does not have the layout of a checkpoint") from error


def _digest(body: str) -> str:
    return hashlib.sha256(body.encode()).hexdigest()
