"""Read the files of a run: audit log, trace and samples.

Only the sound part of the audit log is read, and its texts may come from any module.  So each value is
checked for its type, and values of unknown form are skipped.
"""

from __future__ import annotations

import json
import re
from collections import defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain
from math import isfinite
from pathlib import Path
from typing import Any, Final

from aeros.apps.rule_causes import RuleCause, read_causes
from aeros.apps.stop_text import stop_text
from aeros.files import open_regular
from aeros.runtime.audit.check import CHECKPOINT, GENESIS, AuditReport, DecisionCounts, Record, verify_log
from aeros.runtime.bus.sample_file import FILE as SAMPLES
from aeros.sim.film_file import FILE as POSES
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.migrations import formats
from aeros.spec.migrations.format import Format, FormatVersionError
from aeros.spec.migrations.renamed_names import current_event

AUDIT: Final = "audit.jsonl"
TRACE: Final = "trace.jsonl"

_NAMES: Final = re.compile(r"\w+\.\w+")

_TRACE_ONLY_EVENTS: Final = frozenset(("fault-started", "fault-ended", "fault-not-triggered"))
"""Events that only the plant writes to the trace; the agent does not know of them."""


@dataclass(frozen=True, slots=True)
class TraceEvent:
    """An event of the trace.

    Attributes:
        time: Plant time (s).
        kind: Kind of event.
        text: One line for people.
        details: The event's data by name, JSON values.
    """

    time: float
    kind: str
    text: str
    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class RecordedDecision:
    """One decision of the gate.

    Attributes:
        sequence: Number of its record in the audit log.
        time: Plant time, s.
        decision: Kind of decision, as recorded.
        skill: The requesting skill, as `MODULE.SKILL`.
        kind: Action kind.
        requested: Parameters of the requested action, SI.
        decided: Parameters of the action that may be executed, SI; empty if it is denied.
        reasons: Code, rule and text of each reason.
        site: Digest of the site in force; None if the log does not name it.
        state: Measured values, as recorded.
        usage: Number of executed actions in the window of each quota.
        causes: Rules that bit, with the values that broke them.
        motion: The motion that was decided, as recorded; empty if there is none.
    """

    sequence: int
    time: float
    decision: str
    skill: str
    kind: str
    requested: Mapping[str, Any]
    decided: Mapping[str, Any]
    reasons: tuple[tuple[str, str, str], ...]
    site: str | None
    state: Mapping[str, Any]
    usage: Mapping[str, Any] = field(default_factory=dict)
    causes: tuple[RuleCause, ...] = ()
    motion: Mapping[str, Any] = field(default_factory=dict)


@dataclass(slots=True)
class SkillExecution:
    """One run of a skill, and the agent's judgement of it.

    Attributes:
        skill: The skill, as `MODULE.SKILL`.
        start_time, end_time: Plant time, s; `end_time` is None if no end is recorded.
        status: Kind of its end; `under way` if no end is recorded.
        reason: Text of the reason of its end; may be empty.
        role: `step`, `retry` or `recovery`.
        outcome: Id of the measured outcome; None if there is none.
        failed: The agent's judgement; None if none is recorded.
        previous: The run that ended last before this one began; None for none.
        causes: Rules that ended it, with the values that broke them.
    """

    skill: str
    start_time: float
    previous: SkillExecution | None = None
    end_time: float | None = None
    status: str = "under way"
    reason: str = ""
    role: str = "step"
    outcome: str | None = None
    failed: bool | None = None
    causes: tuple[RuleCause, ...] = ()

    @property
    def result_text(self) -> str:
        """The outcome if the skill finished and one was measured; otherwise its status."""
        return self.outcome if self.status == "finished" and self.outcome else self.status


@dataclass(slots=True)
class RunData:
    """Data of a run.

    Attributes:
        chain: Result of checking the audit log.
        decisions: The gate's decisions, in order.
        runs: Runs of skills, in order of their start.
        sessions: Details of each configuration in the log: digest, site and modules.
        notes: The agent's events in the audit log.
        events: The agent's events in the trace.
        samples: Plant time (s) and measured state.
        people: Plant time (s), and x and y of each simulated person in W (m), of recorded poses.
        pause_changes: Plant time (s), and `paused` or `resumed`.
        stops: Plant time at which each stop began (s), and its text.
        problems: Messages about files that cannot be read or contradict each other.
        is_under_way: True if the run goes on, so that its files are not complete.
    """

    chain: AuditReport = field(default_factory=lambda: AuditReport(0, GENESIS, None, "", DecisionCounts()))
    sessions: list[Mapping[str, Any]] = field(default_factory=list)
    decisions: list[RecordedDecision] = field(default_factory=list)
    runs: list[SkillExecution] = field(default_factory=list)
    notes: list[tuple[str, Mapping[str, Any]]] = field(default_factory=list)
    events: list[TraceEvent] = field(default_factory=list)
    samples: list[tuple[float, Mapping[str, Any]]] = field(default_factory=list)
    people: list[tuple[float, tuple[tuple[float, float], ...]]] = field(default_factory=list)
    pause_changes: list[tuple[float, str]] = field(default_factory=list)
    stops: list[tuple[float, str]] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    is_under_way: bool = False

    @property
    def ends_at(self) -> float:
        """Plant time of the last known event, in seconds."""
        times = [one.end_time if one.end_time is not None else one.start_time for one in self.runs]
        return max([0.0, *times, *(one.time for one in self.decisions), *(one.time for one in self.events)])


def plan_step_states(plan: TraceEvent, runs: Iterable[SkillExecution]) -> Iterator[tuple[str, str]]:
    """Yield the parts of a plan with their state.

    Args:
        plan: The event of the plan.
        runs: Runs of skills since the plan was made.  A run belongs to each part that names its skill.

    Yields:
        The part's text, and `to come`, `under way`, `done` or `failed`.
    """
    parts = plan.details.get("steps")
    since = list(runs)
    for part in parts if type(parts) is list else []:
        text = str(part)
        named = set(_NAMES.findall(text))
        own = [run for run in since if run.skill in named]
        if any(run.end_time is None for run in own):
            yield text, "under way"
        elif own:
            yield text, "failed" if own[-1].failed else "done"
        else:
            yield text, "to come"


def read_run_data(folder: Path) -> RunData:
    """Read the folder of a run.

    Args:
        folder: The folder.  The audit log must exist; trace and samples may be missing.

    Returns:
        The data; problems with files are listed in it.
    """
    reading = RecordReader()
    left = reading.left
    left.chain = verify_log(folder / AUDIT, reading.add_record)
    left.events = [
        event
        for line in _lines(folder / TRACE, formats.TRACE, left, oldest_version=1)
        if (event := parse_event(line)) is not None
    ]
    traced = [(one.kind, one.details) for one in left.events if one.kind not in _TRACE_ONLY_EVENTS]
    if left.events and _canonical_events(traced) != _canonical_events(left.notes):
        left.problems.append(f"{TRACE} disagrees with the audit log")
    left.samples = [
        sample for line in _lines(folder / SAMPLES, formats.MEASURED, left) if (sample := parse_sample(line))
    ]
    left.samples.sort(key=lambda sample: sample[0])
    left.people = list(_people(folder / POSES))
    return left


def _people(path: Path) -> Iterator[tuple[float, tuple[tuple[float, float], ...]]]:
    """Yield where people were, of the lines of recorded poses that say so; other lines are skipped."""
    with suppress(OSError), open_regular(path) as file:
        for line in file:
            if b'"people"' in line and (found := _parse_people(line)) is not None:
                yield found


def _parse_people(line: bytes) -> tuple[float, tuple[tuple[float, float], ...]] | None:
    try:
        content = json.loads(line)
        time, people = float(content["t"]), tuple((float(x), float(y)) for x, y, *_ in content["people"])
    except (ValueError, TypeError, KeyError, RecursionError, OverflowError):
        return None
    return (time, people) if all(map(isfinite, (time, *chain.from_iterable(people)))) else None


def _canonical_events(events: list[tuple[str, Mapping[str, Any]]]) -> str:
    return json.dumps(events, sort_keys=True)


def _lines(
    path: Path, format_: Format, left: RunData, oldest_version: int | None = None
) -> Iterator[Mapping[str, Any]]:
    """Yield the objects of a file of JSON lines; count lines of other form as one problem.

    Lines of the current version are read, and older ones down to `oldest_version` if it is given.
    """
    readable = range(oldest_version or format_.version, format_.version)
    bad = 0
    try:
        with open_regular(path) as file:
            for line in file:
                try:
                    found = json.loads(line)
                except (ValueError, RecursionError):
                    found = None
                if type(found) is dict:
                    if format_.version_of(found) not in readable:
                        format_.require_current(found, path)
                    yield found
                else:
                    bad += 1
    except OSError as error:
        left.problems.append(f"{path.name} cannot be read: {error.strerror}")
    except FormatVersionError as error:
        left.problems.append(str(error))
    if bad:
        left.problems.append(f"{path.name}: {bad} lines not understood")


class RecordReader:
    """Collector of audit records, which are added in order.

    Attributes:
        left: Data of the records so far.
        now: Plant time of the latest record, in seconds.
    """

    def __init__(self) -> None:
        self.left = RunData()
        self._sites: dict[str, str] = {}
        self.now = 0.0
        self._under_way: defaultdict[str, deque[SkillExecution]] = defaultdict(deque)
        self._ended: SkillExecution | None = None

    def add_record(self, record: Record, _own: str = "") -> None:
        """Add one record.

        Args:
            record: A record of a sound chain.
            _own: Its hash, which is not used.
        """
        details: dict[str, Any] = record["details"]
        # The time of a checkpoint is the time of day.
        time = None if record["event"] == CHECKPOINT else _number(details.get("time"))
        self.now = self.now if time is None else time
        skill = f"{details.get('module')}.{details.get('skill')}"
        match record["event"]:
            case "session-opened" | "configuration-changed":
                self._on_configuration(details)
            case "decision":
                self._decide(record["sequence"], details, skill)
            case "step-began":
                run = SkillExecution(skill, self.now, self._ended)
                self.left.runs.append(run)
                self._under_way[skill].append(run)
            case "step-ended" | "step-broken" as event:
                self._end(skill, details, "broken off" if event == "step-broken" else "ended")
            case "note":
                self._note(details.get("event"), details.get("details"))
            case "stopped":
                began = _number(details.get("began"))
                self.left.stops.append((self.now if began is None else began, stop_text(details)))
            case "paused" | "resumed" as event:
                self.left.pause_changes.append((self.now, event))

    def _on_configuration(self, details: Mapping[str, Any]) -> None:
        self.left.sessions.append(details)
        digest = _inner(details, "site").get("digest")
        if type(digest) is str:
            self._sites[str(details.get("configuration"))] = digest

    def _decide(self, sequence: int, details: Mapping[str, Any], skill: str) -> None:
        asked, decided = _inner(details, "asked"), _inner(details, "decided")
        reasons = details.get("reasons")
        listed = reasons if type(reasons) is list else []
        self.left.decisions.append(
            RecordedDecision(
                sequence,
                self.now,
                str(details["verdict"]),
                skill,
                str(asked.get("kind")),
                _inner(asked, "parameters"),
                _inner(decided, "parameters"),
                tuple((str(a), str(b), str(c)) for a, b, c in (one for one in listed if _is_triple(one))),
                self._sites.get(str(details.get("configuration"))),
                _inner(details, "state"),
                _inner(details, "usage"),
                read_causes(details.get("causes")),
                _inner(details, "motion"),
            )
        )

    def _end(self, skill: str, details: Mapping[str, Any], otherwise: str) -> None:
        if self._under_way[skill]:
            run = self._ended = self._under_way[skill].popleft()
            run.end_time = self.now
            run.status = str(details.get("status", otherwise))
            run.reason = str(details.get("reason", ""))
            run.causes = read_causes(details.get("causes"))

    def _note(self, kind: object, details: object) -> None:
        if type(kind) is not str or type(details) is not dict:
            return
        self.left.notes.append((current_event(kind), details))
        if kind != "step-ended":
            return
        skill = details.get("skill")
        run = next((one for one in reversed(self.left.runs) if one.skill == skill), None)
        if run is not None and run.end_time is not None and run.failed is None:
            run.role = str(details.get("role", "step"))
            run.outcome = None if details.get("outcome") is None else str(details["outcome"])
            run.failed = details.get("failed") is not False


def parse_event(line: Mapping[str, Any]) -> TraceEvent | None:
    """Parse a line of the trace.

    Args:
        line: The line as a JSON object.

    Returns:
        The event; None if the line has another form.
    """
    time, kind, text, details = (line.get(name) for name in ("time", "kind", "text", "details"))
    seconds = _number(time)
    if seconds is None or type(kind) is not str or type(text) is not str or type(details) is not dict:
        return None
    return TraceEvent(seconds, current_event(kind), text, details)


def parse_sample(line: Mapping[str, Any]) -> tuple[float, Mapping[str, Any]] | None:
    """Parse a line of the samples.

    Args:
        line: The line as a JSON object.

    Returns:
        Plant time (s) and measured state; None if the line has another form.
    """
    time = _number(line.get("time"))
    return None if time is None else (time, _inner(line, "state"))


def _inner(details: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    found = details.get(name)
    return found if type(found) is dict else {}


def _is_triple(one: object) -> bool:
    return type(one) is list and len(one) == 3


def _number(value: object) -> float | None:
    return float(value) if type(value) in (float, int) and isfinite(value) else None  # type: ignore[arg-type]


def shortened(text: str, max_chars: int) -> str:
    """Make text visible and shorten it.

    Args:
        text: Any text.
        max_chars: Largest number of characters of the result.

    Returns:
        The text without invisible characters; it ends with `…` if it was cut.
    """
    shown = escape_invisible(text)
    return shown if len(shown) <= max_chars else shown[: max_chars - 1] + "…"
