"""Beside the end of a run: branches of plans that nothing decided, and the referee's judgement."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from aeros.runtime.audit.check import Record


def undecided_branches(
    notes: Sequence[tuple[int, str, Mapping[str, Any]]], end: int
) -> Iterator[tuple[int, str, Mapping[str, Any]]]:
    """Find each time that a plan was given up because nothing measured decided a branch of it.

    Args:
        notes: place, event and details of each note of the agent, in order.
        end: place of the end of the task.

    Yields:
        Place, text and details of each note about it, the last one first.
    """
    for at, event, details in reversed([one for one in notes if one[0] < end]):
        if event in ("run-ended", "task-selected"):
            return
        if event == "replan" and details.get("causes"):
            yield at, f"re-plan {details.get('number')}: {details.get('reason')}", details


def refuted_belief(records: Sequence[Record], end: int) -> tuple[int, str] | None:
    """Find the referee's judgement after the end of a run, if the simulator's truth refutes the belief.

    Args:
        records: records of the log.
        end: place of the end of the run.

    Returns:
        Place and text of the judgement; None if there is none, or it agrees.
    """
    for place, record in enumerate(records[end:], end):
        details = record["details"]
        if record["event"] == "goal-judged" and details.get("believed") and details.get("true") is False:
            values = details.get("values")
            found = values.items() if isinstance(values, dict) else ()
            truth = ", ".join(f"{name} = {json.dumps(value)}" for name, value in found)
            return place, f"in the simulator {truth or 'the goal is false'}"
    return None
