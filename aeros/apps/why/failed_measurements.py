"""Measurements that failed in a step: what they would have told was unknown at its end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from aeros.runtime.audit.check import Record
from aeros.runtime.records.failed_measurements import (
    PERCEIVER_FAILED,
    PERCEIVER_UNSURE,
    TOOL_FAILED,
    failure_text,
)

_OF_PERCEIVERS: Final = (PERCEIVER_FAILED, "perceiver-recovered", PERCEIVER_UNSURE)


def failures_before(
    records: Sequence[Record], start: int, end: int, module: str
) -> Iterator[tuple[int, str]]:
    """Find the failures that left values of a step unknown at its end.

    Args:
        records: the records of a log.
        start: index of the step's start.
        end: index of its end.
        module: module of the step.

    Yields:
        Index and text of the last failure of each perceiver of the module that has not recovered, and of each
        tool that failed during the step.
    """
    latest: dict[tuple[str, str], tuple[int, str]] = {}
    for place, record in enumerate(records[:end]):
        event, details = record["event"], record["details"]
        if event in _OF_PERCEIVERS and details.get("module") == module:
            sort = "unsure" if event == PERCEIVER_UNSURE else "perceiver"
            latest[sort, str(details.get("perceiver"))] = (place, failure_text(event, details))
        elif event in (TOOL_FAILED, "tool-answered") and place >= start:
            latest[event[:4], str(details.get("tool"))] = (place, failure_text(event, details))
    yield from sorted(one for one in latest.values() if one[1])
