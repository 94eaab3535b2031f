"""Checker of the audit log: finds the first record that does not belong, and says why.

Reads only. `log` documents the format, and what a hash chain cannot detect.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, Final

from aeros.files import open_regular
from aeros.runtime.canonical_json import HASH_SUFFIX_LENGTH, seal_record
from aeros.runtime.gate.decision import DecisionKind

GENESIS: Final = hashlib.sha256(b"aeros/audit/1").hexdigest()
"""`previous` of the first record; names the format and its version."""

CHECKPOINT: Final = "checkpoint"
"""Event of a checkpoint record."""

TAIL_REPAIRED: Final = "tail-mended"
"""Event of the note that a torn last line was replaced."""

_SHA256: Final = re.compile(r"[0-9a-f]{64}")

Record = dict[str, Any]
"""A parsed record, without its own hash."""

RecordCheck = Callable[[Record, str], str | None]
"""Called with each sound record and its hash, in order; returns another problem with it, or None."""

_TYPES: Final = {
    "sequence": (int,),
    "previous": (str,),
    "written": (float, int),
    "event": (str,),
    "details": (dict,),
}


@dataclass(frozen=True, slots=True)
class DecisionCounts:
    """Numbers of decisions by kind.

    Attributes:
        allowed: number of allowed actions.
        attenuated: number of attenuated actions.
        denied: number of denied actions.
    """

    allowed: int = 0
    attenuated: int = 0
    denied: int = 0

    def with_decision(self, verdict: DecisionKind) -> DecisionCounts:
        """Count one decision more.

        Args:
            verdict: kind of the decision.

        Returns:
            New counts.
        """
        match verdict:
            case DecisionKind.ALLOW:
                return DecisionCounts(self.allowed + 1, self.attenuated, self.denied)
            case DecisionKind.ATTENUATE:
                return DecisionCounts(self.allowed, self.attenuated + 1, self.denied)
            case DecisionKind.DENY:
                return DecisionCounts(self.allowed, self.attenuated, self.denied + 1)


@dataclass(frozen=True, slots=True)
class AuditReport:
    """Result of checking a log, up to its end or its first bad record.

    Attributes:
        records: number of sound records before the first bad one.
        head: hash of the last of them.
        bad_record: index of the first bad record, from 0; None if all are sound.
        reason: why that record is bad; empty if all are sound.
        decisions: counts of the decisions in the sound records.
    """

    records: int
    head: str
    bad_record: int | None
    reason: str
    decisions: DecisionCounts

    @property
    def is_sound(self) -> bool:
        """True if the whole file is one unbroken chain."""
        return self.bad_record is None


@dataclass(frozen=True, slots=True)
class LogPrefix:
    """The sound beginning of a log.

    Attributes:
        records: number of sound records.
        first: hash of the first record; `GENESIS` if there is none.
        head: hash of the last record; `GENESIS` if there is none.
        end: length in bytes.
        decisions: counts of the decisions in it.
        problem: why the record after it is bad; None if the log ends there.
        torn_tail: the last line, if a crash seems to have cut its write short. The next writer that opens
            the log repairs it.
    """

    records: int
    first: str
    head: str
    end: int
    decisions: DecisionCounts
    problem: str | None = None
    torn_tail: bytes | None = None


class LogReadError(OSError):
    """The log cannot be read; an error of a `RecordCheck`, such as a closed pipe, is none of these."""


def verify_log(path: Path, watch: RecordCheck | None = None) -> AuditReport:
    """Check that a log is one unbroken chain.

    While a writer is at work, the newest record may look cut short.

    Args:
        path: the log.
        watch: called with each sound record; may reject it.

    Returns:
        The report, with the first bad record if there is one. A log that cannot be read is bad from record 0.
    """
    try:
        opened = open_regular(path)
    except OSError as failure:
        return _unreadable(failure)
    with opened as file:
        try:
            prefix = read_prefix(file, ClosedLogCheck(watch))
        except LogReadError as failure:
            return _unreadable(failure)
    bad = None if prefix.problem is None else prefix.records
    return AuditReport(prefix.records, prefix.head, bad, prefix.problem or "", prefix.decisions)


class ClosedLogCheck:
    """Check that nothing was added to a closed log, before another check; implements `RecordCheck`.

    It needs no key. Somebody without the key can evade it with a forged checkpoint, which only the key tells.
    """

    def __init__(self, watch: RecordCheck | None) -> None:
        self._watch = watch
        self._is_closed = False

    def __call__(self, record: Record, own: str) -> str | None:
        """Implement `RecordCheck`."""
        event = record["event"]
        if self._is_closed and event != CHECKPOINT and not is_repair_note(record):
            return f"record {record['sequence']} was added to a closed log by a writer without the key"
        if event == CHECKPOINT:
            self._is_closed = record["details"].get("closing") is True
        return None if self._watch is None else self._watch(record, own)


def is_repair_note(record: Record) -> bool:
    """Say if a record is the note that a torn last line was replaced, as a writer writes it.

    Args:
        record: a record.

    Returns:
        True if its details are length and SHA-256 of that line, and nothing else.
    """
    details = record["details"]
    return (
        record["event"] == TAIL_REPAIRED
        and details.keys() == {"bytes", "sha256"}
        and type(details["bytes"]) is int
        and _SHA256.fullmatch(str(details["sha256"])) is not None
    )


def _unreadable(failure: OSError) -> AuditReport:
    return AuditReport(
        0, GENESIS, 0, f"the log cannot be read: {failure.strerror or failure}", DecisionCounts()
    )


def read_prefix(
    file: BinaryIO, watch: RecordCheck | None = None, begin: LogPrefix | None = None
) -> LogPrefix:
    """Read a log from its start to its end or its first bad record.

    Args:
        file: the log, seekable; its position changes.
        watch: called with each sound record; may reject it.
        begin: sound beginning of exactly this file, from whose end on it is read; None to read all of it.

    Returns:
        The sound beginning.

    Raises:
        LogReadError: the log cannot be read.
    """
    sound = LogPrefix(0, GENESIS, GENESIS, 0, DecisionCounts()) if begin is None else begin
    file.seek(sound.end)
    size = os.fstat(file.fileno()).st_size
    for line in _read_lines(file):
        if not line.endswith(b"\n"):
            return replace(sound, problem=f"record {sound.records} is cut short", torn_tail=line)
        if b"\0" in line and sound.end + len(line) == size:
            # A crash can persist a later block of a record and not an earlier one.
            return replace(sound, problem=f"record {sound.records} is half written", torn_tail=line)
        checked = _check(line, sound, watch)
        if checked.problem is not None:
            return checked
        sound = checked
    return sound


def _read_lines(file: BinaryIO) -> Iterator[bytes]:
    try:
        yield from file
    except OSError as failure:
        raise LogReadError(*failure.args) from failure


def _check(line: bytes, before: LogPrefix, watch: RecordCheck | None) -> LogPrefix:
    """Return `before` extended by the record in `line`; or `before` with the reason why it cannot follow."""
    place = before.records
    body = line[:-HASH_SUFFIX_LENGTH] + b"}"
    expected, own = seal_record(body)
    if line != expected:
        return replace(before, problem=f"record {place} was edited: its hash does not match its content")
    record = _parse(body)
    if record is None:
        return replace(before, problem=f"record {place} is not a record")
    if record["sequence"] != place:
        problem = f"record {place} is missing or moved: number {record['sequence']} stands in its place"
        return replace(before, problem=problem)
    if record["previous"] != before.head:
        return replace(before, problem=f"record {place} does not follow the one before it")
    objection = None if watch is None else watch(record, own)
    if objection is not None:
        return replace(before, problem=objection)
    decisions = before.decisions
    if record["event"] == "decision":
        decisions = decisions.with_decision(DecisionKind(record["details"]["verdict"]))
    first = own if place == 0 else before.first
    return LogPrefix(place + 1, first, own, before.end + len(line), decisions)


def _parse(body: bytes) -> Record | None:
    """Return the record; None if no writer of ours wrote it.

    A record has exactly one spelling. Another spelling, with a duplicate key for instance, could mean
    different things to different readers.
    """
    try:
        record = json.loads(body)
        spelling = json.dumps(record, sort_keys=True, separators=(",", ":"), allow_nan=False)
        if record["event"] == "decision":
            DecisionKind(record["details"]["verdict"])
        formed = record.keys() == _TYPES.keys() and all(
            type(record[name]) in types for name, types in _TYPES.items()
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
    return record if formed and spelling.encode("ascii") == body else None
