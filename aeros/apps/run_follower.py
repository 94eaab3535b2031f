"""Follow a run through the files that it writes, without any request to the run itself.

The hash chain of the audit log is not checked here; `aeros audit verify` and `aeros report` check it.
"""

from __future__ import annotations

import json
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from aeros.apps.report_page.run_data import (
    AUDIT,
    TRACE,
    RecordedDecision,
    RecordReader,
    RunData,
    SkillExecution,
    TraceEvent,
    parse_event,
    parse_sample,
)
from aeros.apps.report_page.series import ClosestApproach, build_series
from aeros.files import open_regular
from aeros.runtime.bus.sample_file import FILE as SAMPLES
from aeros.spec.model.site import Site

_HISTORY_LENGTH: Final = 50
_READ_CHUNK_BYTES: Final = 1 << 20  # bytes


class RunFollower:
    """State of the run that writes to `folder`, as of the last call of `read`.

    Args:
        folder: The run's output folder; its files need not exist yet.

    Attributes:
        latest: The latest decision of each skill.
        last: The newest 50 decisions.
        counts: Number of decisions by verdict.
        world: Latest measurement of each state variable, as value (SI) and plant time (s).
        events: The newest 50 events of the trace.
        plan: The event of the latest plan; None before.
        task_event: Details of the event that names the task.
        ended: Details of the end of the run; None while it runs.
        modules: Limits and use of resources of each module, as the run has written them.
        tool_calls: Number of calls of each tool, and of those that failed.
        now: Latest time on the plant's clock, in seconds.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._record = RecordReader()
        self._tails = [_Tail(folder / name) for name in (AUDIT, TRACE, SAMPLES)]
        self.latest: dict[str, RecordedDecision] = {}
        self.last: deque[RecordedDecision] = deque(maxlen=_HISTORY_LENGTH)
        self.counts: Counter[str] = Counter()
        self.world: dict[str, tuple[Any, float]] = {}
        self.events: deque[TraceEvent] = deque(maxlen=_HISTORY_LENGTH)
        self.plan: TraceEvent | None = None
        self.task_event: Mapping[str, Any] = {}
        self.ended: Mapping[str, Any] | None = None
        self.modules: Any = {}
        self.tool_calls: dict[str, tuple[int, int]] = {}
        self.now = 0.0

    @property
    def runs(self) -> list[SkillExecution]:
        """Runs of skills since the latest plan, and earlier ones that have not ended."""
        return self._record.left.runs

    @property
    def stops(self) -> list[tuple[float, str]]:
        """Plant time (s) and text of each stop so far."""
        return self._record.left.stops

    @property
    def site(self) -> str | None:
        """Digest of the site in force; None if the log names none."""
        site = self._record.left.sessions[-1].get("site") if self._record.left.sessions else None
        found = site.get("digest") if type(site) is dict else None
        return found if type(found) is str else None

    @property
    def is_paused(self) -> bool:
        """True if the executor is paused by the operator."""
        changes = self._record.left.pause_changes
        return bool(changes) and changes[-1][1] == "paused"

    def read(self) -> None:
        """Read the lines that were written since the last call."""
        audit, trace, samples = self._tails
        for line in audit.lines():
            if _is_record(line):
                self._on_record(line)
        for event in map(parse_event, trace.lines()):
            if event is not None:
                self._on_event(event)
        for line in samples.lines():
            self.modules = line.get("modules", self.modules)
            if (sample := parse_sample(line)) is not None:
                self._on_sample(*sample)

    def closest_bounds(self, site: Site | None) -> list[ClosestApproach]:
        """Compute the margin of each rule for the actions in progress.

        Args:
            site: The site in force; None to compute no margins.

        Returns:
            The closest bound of each rule, sorted by margin relative to the bound, smallest first.
        """
        under_way = {run.skill for run in self.runs if run.end_time is None}
        state = {name: [value, time] for name, (value, time) in self.world.items()}
        decided = [
            replace(one, time=self.now, state=state)
            for skill, one in self.latest.items()
            if skill in under_way and one.decision != "DENY"
        ]
        found = build_series(
            RunData(decisions=decided), {} if site is None else {site.digest: site}
        ).closest_approaches.values()
        return sorted(found, key=lambda one: (one.margin / (abs(one.bound) or 1.0), one.rule))

    def _on_record(self, record: dict[str, Any]) -> None:
        left = self._record.left
        self._record.add_record(record)
        self.now = max(self.now, self._record.now)
        match record["event"]:
            case "decision":
                (one,) = left.decisions
                self.counts[one.decision] += 1
                self.last.append(one)
                self.latest[one.skill] = one
                self._on_sample(one.time, one.state)
            case "session-opened":
                self.ended = None
            case "tool-answered" | "tool-failed" as event if type(record["details"].get("tool")) is str:
                calls, failures = self.tool_calls.get(record["details"]["tool"], (0, 0))
                failed = event == "tool-failed"
                self.tool_calls[record["details"]["tool"]] = (calls + 1, failures + failed)
            case "note" if left.notes:
                kind, details = left.notes[-1]
                if kind == "task-selected":
                    self.task_event, self.ended = details, None
                if kind in ("run-ended", "run-already-ended"):
                    self.ended = details
        left.decisions.clear()
        del left.notes[:-1], left.sessions[:-1], left.pause_changes[:-1]

    def _on_event(self, event: TraceEvent) -> None:
        self.events.append(event)
        self.now = max(self.now, event.time)
        if event.kind == "plan-accepted":
            self.plan = event
            runs = self._record.left.runs
            runs[:] = [run for run in runs if run.end_time is None or run.start_time >= event.time]

    def _on_sample(self, now: float, state: Mapping[str, Any]) -> None:
        self.now = max(self.now, now)
        for name, pair in state.items():
            if type(pair) is list and len(pair) == 2 and type(pair[1]) in (int, float):
                known = self.world.get(name)
                if known is None or known[1] <= pair[1]:
                    self.world[name] = (pair[0], pair[1])


class _Tail:
    """Reader of a file of JSON lines that grows."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._position = 0
        self._rest = b""

    def lines(self) -> Iterator[dict[str, Any]]:
        """Yield the objects in complete lines that were added since the last call; skip other lines."""
        try:
            with open_regular(self._path) as file:
                file.seek(self._position)
                while chunk := file.read(_READ_CHUNK_BYTES):
                    self._position += len(chunk)
                    *whole, self._rest = (self._rest + chunk).split(b"\n")
                    yield from filter(None, map(_object, whole))
        except OSError:
            return  # not there yet, or not any more


def _object(line: bytes) -> dict[str, Any] | None:
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return found if type(found) is dict else None


def _is_record(line: Mapping[str, Any]) -> bool:
    details = line.get("details")
    return (
        type(details) is dict
        and type(line.get("event")) is str
        and type(line.get("sequence")) is int
        and (line["event"] != "decision" or type(details.get("verdict")) is str)
    )
