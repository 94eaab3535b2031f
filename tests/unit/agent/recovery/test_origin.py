"""A checkpoint is resumed from only by its agent, for its task, on its record and its plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.agent.instructions.meaning import Errand, Understanding
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.recovery.checkpoint import UnusableCheckpointError
from aeros.agent.recovery.origin import events_since_checkpoint
from aeros.runtime.ports import AuditEvent, LogHead
from tests.unit.agent.recovery.test_checkpoint import ENDED, FULL

TASK: Any = SimpleNamespace(id="make", goal_text="cooked")
MEANING = Understanding("dumplings", (Errand(RoutedTask("m", TASK)),))
ENDED_STEP = AuditEvent(8, "step-ended", {"time": 4.0})
HEADS = (LogHead(7, "seven"), LogHead(9, "nine"))
"""Ends of the record when the checkpoint's unfinished attempt began, and when it was made."""


class Record:
    """A runtime with a clock and a record that has ended at some heads."""

    def __init__(self, now: float = 5.0, heads: Sequence[LogHead] = HEADS) -> None:
        self.clock, self.heads = now, heads

    def now(self) -> float:
        return self.clock

    def events_since(self, head: LogHead) -> Sequence[AuditEvent] | None:
        if head not in self.heads:
            return None
        return [ENDED_STEP] if head.records < ENDED_STEP.sequence else []


def events(
    checkpoint: Any = FULL, agent: str = "chef", meaning: Understanding = MEANING, runtime: Any = None
) -> Sequence[AuditEvent]:
    return events_since_checkpoint(checkpoint, agent, meaning, cast(Any, runtime or Record()))


def test_the_events_reach_back_to_the_earliest_unfinished_attempt() -> None:
    assert events() == [ENDED_STEP]
    assert events(replace(FULL, attempts=())) == []


def test_another_agent_is_refused() -> None:
    with pytest.raises(UnusableCheckpointError, match="belongs to another agent"):
        events(agent="waiter")


@pytest.mark.parametrize(
    "other",
    [
        {"instruction": "Dumplings, please"},
        {"task": "m.break"},
        {"goal": "not cooked"},
        {"errand": 1},
        {"errand": -1},
    ],
)
def test_another_task_is_refused(other: dict[str, Any]) -> None:
    with pytest.raises(UnusableCheckpointError, match="of another task"):
        events(replace(FULL, **other))


@pytest.mark.parametrize("head", HEADS)
def test_another_record_is_refused(head: LogHead) -> None:
    with pytest.raises(UnusableCheckpointError, match="does not hold the record"):
        events(runtime=Record(heads=[head]))


def test_a_plant_whose_clock_is_behind_is_refused_unless_the_task_has_ended() -> None:
    with pytest.raises(UnusableCheckpointError, match="is at 3 s, and was at 4 s: it is another plant"):
        events(runtime=Record(3.0))
    with pytest.raises(UnusableCheckpointError, match=r"is at 2 s, and was at 2\.5 s"):
        events(replace(FULL, attempts=()), runtime=Record(2.0))
    assert events(ENDED, runtime=Record(2.0)) == []
