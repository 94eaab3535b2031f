"""Origin of a checkpoint: whether it is of this agent, task, record and plant."""

from __future__ import annotations

from collections.abc import Sequence

from aeros.agent.instructions.meaning import Understanding
from aeros.agent.recovery.checkpoint import TaskCheckpoint, UnusableCheckpointError
from aeros.runtime.ports import AuditEvent, Runtime


def events_since_checkpoint(
    kept: TaskCheckpoint, agent: str, meaning: Understanding, runtime: Runtime
) -> Sequence[AuditEvent]:
    """Return the runtime events since a checkpoint.

    Args:
        kept: the checkpoint.
        agent: id of the agent that would resume from it.
        meaning: meaning of the instruction that it would pursue.
        runtime: keeps the audit record, and knows the time of the plant.

    Returns:
        The events since its earliest unfinished attempt began, in order.

    Raises:
        UnusableCheckpointError: the checkpoint is of another agent, task, record or plant.
    """
    now = runtime.now()
    if kept.agent != agent:
        raise UnusableCheckpointError("the checkpoint belongs to another agent")
    if kept.instruction != meaning.instruction or not _is_of_errand(kept, meaning):
        raise UnusableCheckpointError(f"the checkpoint is of another task: “{kept.instruction}”, {kept.task}")
    events = runtime.events_since(kept.earliest_head)
    if events is None or runtime.events_since(kept.audit_head) is None:
        raise UnusableCheckpointError(
            "the audit record does not hold the record at which the checkpoint was made"
        )
    latest = max([kept.time, *(one.details.get("time", kept.time) for one in events)])
    if now < latest and kept.final_report is None:
        raise UnusableCheckpointError(
            f"the plant's clock is at {now:g} s, and was at {latest:g} s: it is another plant"
        )
    return events


def _is_of_errand(kept: TaskCheckpoint, meaning: Understanding) -> bool:
    """Return True if a checkpoint is of the errand of its number."""
    if not 0 <= kept.errand < len(meaning.errands):
        return False
    routed = meaning.errands[kept.errand].routed
    return (kept.task, kept.goal) == (str(routed), routed.task.goal_text)
