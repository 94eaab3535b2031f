"""What a run is at, read from what it writes while it writes it; nothing is asked of the run.

Nothing here checks the chain of the record: `aeros audit verify` does, and the page about a finished run.
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
from aeros.runtime.bus.sample_file import FILE as SAMPLES
from aeros.spec.model.model import Site

_HISTORY_LENGTH: Final = 50
_READ_CHUNK_BYTES: Final = 1 << 20  # bytes


class RunFollower:
    """The run that writes to `folder`, as far as it has been read.

    latest: by skill, the decision on what it does now, or did last.
    world: what was measured last, by name, as value and time.
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
        self.now = 0.0

    @property
    def runs(self) -> list[SkillExecution]:
        """Of skills, since the plan was made; those under way in any case."""
        return self._record.left.runs

    @property
    def site(self) -> str | None:
        """The digest of the site that governs."""
        site = self._record.left.sessions[-1].get("site") if self._record.left.sessions else None
        found = site.get("digest") if type(site) is dict else None
        return found if type(found) is str else None

    @property
    def is_paused(self) -> bool:
        """Whether the executor has said that it pauses."""
        changes = self._record.left.pause_changes
        return bool(changes) and changes[-1][1] == "paused"

    def read(self) -> None:
        """Whatever was written since."""
        audit, trace, samples = self._tails
        for line in audit.lines():
            if _is_record(line):
                self._on_record(line)
        for event in map(parse_event, trace.lines()):
            if event is not None:
                self._on_event(event)
        for sample in map(parse_sample, samples.lines()):
            if sample is not None:
                self._on_sample(*sample)

    def closest_bounds(self, site: Site | None) -> list[ClosestApproach]:
        """How near each rule is to being broken by what is under way now, the nearest first."""
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
            case "note" if left.notes:
                kind, details = left.notes[-1]
                if kind == "routed":
                    self.task_event, self.ended = details, None
                if kind in ("run-ended", "run-had-ended"):
                    self.ended = details
        left.decisions.clear()
        del left.notes[:-1], left.sessions[:-1], left.pause_changes[:-1]

    def _on_event(self, event: TraceEvent) -> None:
        self.events.append(event)
        self.now = max(self.now, event.time)
        if event.kind == "plan":
            self.plan = event
            runs = self._record.left.runs
            runs[:] = [run for run in runs if run.end_time is None or run.start_time >= event.time]

    def _on_sample(self, now: float, state: Mapping[str, Any]) -> None:
        self.now = max(self.now, now)
        for name, told in state.items():
            if type(told) is list and len(told) == 2 and type(told[1]) in (int, float):
                known = self.world.get(name)
                if known is None or known[1] <= told[1]:
                    self.world[name] = (told[0], told[1])


class _Tail:
    """A file of JSON lines that grows."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._position = 0
        self._rest = b""

    def lines(self) -> Iterator[dict[str, Any]]:
        """The objects in whole lines that were added since; what is none is passed over."""
        try:
            with self._path.open("rb") as file:
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
