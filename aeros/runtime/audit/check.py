"""The checker of the audit record: names the first record that does not belong, and says why.

Reads only; see `audit` for the format and for what a chain cannot show.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, Final

from aeros.runtime.gate.decision import DecisionKind

GENESIS: Final = hashlib.sha256(b"aeros/audit/1").hexdigest()
"""`previous` of the first record; names the format."""

Record = dict[str, Any]
"""A record as it was read, without its own hash."""

RecordCheck = Callable[[Record, str], str | None]
"""Looks at each sound record and its hash, in order; says what is wrong with it beyond the chain, or None."""

_HASH_FIELD: Final = b',"hash":"'
_HASH_END: Final = b'"}\n'
_TYPES: Final = {
    "sequence": (int,),
    "previous": (str,),
    "written": (float, int),
    "event": (str,),
    "details": (dict,),
}
_HASH_SUFFIX_LENGTH: Final = len(_HASH_FIELD) + 64 + len(_HASH_END)


@dataclass(frozen=True, slots=True)
class DecisionCounts:
    """How many actions were allowed, attenuated and denied."""

    allowed: int = 0
    attenuated: int = 0
    denied: int = 0

    def with_decision(self, verdict: DecisionKind) -> DecisionCounts:
        """These and one decision more."""
        match verdict:
            case DecisionKind.ALLOW:
                return DecisionCounts(self.allowed + 1, self.attenuated, self.denied)
            case DecisionKind.ATTENUATE:
                return DecisionCounts(self.allowed, self.attenuated + 1, self.denied)
            case DecisionKind.DENY:
                return DecisionCounts(self.allowed, self.attenuated, self.denied + 1)


@dataclass(frozen=True, slots=True)
class AuditReport:
    """What a log holds up to its end or its first bad record.

    records: how many sound records come first.
    head: hash of the last of them.
    bad_record: place of the first bad record, from 0; None when all are sound.
    why: what is wrong with it; empty when all are sound.
    decisions: what the sound records decided.
    """

    records: int
    head: str
    bad_record: int | None
    reason: str
    decisions: DecisionCounts

    @property
    def is_sound(self) -> bool:
        """Whether the whole file is one unbroken chain."""
        return self.bad_record is None


@dataclass(frozen=True, slots=True)
class LogPrefix:
    """The sound beginning of a log, its length in bytes, and what follows it.

    first: hash of the first record, of none `GENESIS`.
    torn: the last line, where it looks like a write that a crash cut short; only opening mends it.
    """

    records: int
    first: str
    head: str
    end: int
    decisions: DecisionCounts
    problem: str | None = None
    torn_tail: bytes | None = None


def verify_log(path: Path, watch: RecordCheck | None = None) -> AuditReport:
    """Whether the log is one unbroken chain, and if not, which record is the first bad one and why.

    watch: is shown the sound records, and may find one bad.
    While a writer is at work its newest record may look cut short.
    """
    try:
        with path.open("rb") as file:
            found = read_prefix(file, watch)
    except OSError as failure:
        return AuditReport(0, GENESIS, 0, f"the log cannot be read: {failure}", DecisionCounts())
    bad = None if found.problem is None else found.records
    return AuditReport(found.records, found.head, bad, found.problem or "", found.decisions)


def seal_record(body: bytes) -> tuple[bytes, str]:
    """The line of a record, given its canonical JSON without hash, and the hash."""
    own = hashlib.sha256(body).hexdigest()
    return body[:-1] + _HASH_FIELD + own.encode("ascii") + _HASH_END, own


def read_prefix(file: BinaryIO, watch: RecordCheck | None = None) -> LogPrefix:
    """Read a log from its start up to its end or its first bad record."""
    file.seek(0)
    size = os.fstat(file.fileno()).st_size
    sound = LogPrefix(0, GENESIS, GENESIS, 0, DecisionCounts())
    for line in file:
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


def _check(line: bytes, before: LogPrefix, watch: RecordCheck | None) -> LogPrefix:
    """`before` and the record `line`, or `before` and why `line` cannot follow it."""
    place = before.records
    body = line[:-_HASH_SUFFIX_LENGTH] + b"}"
    expected, own = seal_record(body)
    if line != expected:
        return replace(before, problem=f"record {place} was edited: its hash is not that of its content")
    record = _parse(body)
    if record is None:
        return replace(before, problem=f"record {place} is not a record")
    if record["sequence"] != place:
        told = f"record {place} is missing or moved: number {record['sequence']} stands in its place"
        return replace(before, problem=told)
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
    """The record, or None for what no writer of ours wrote.

    A record has one spelling.  Another one, with a key given twice for instance, would mean one thing
    to one reader and something else to the next.
    """
    try:
        record = json.loads(body)
        spelt = json.dumps(record, sort_keys=True, separators=(",", ":"), allow_nan=False)
        if record["event"] == "decision":
            DecisionKind(record["details"]["verdict"])
        formed = record.keys() == _TYPES.keys() and all(
            type(record[name]) in types for name, types in _TYPES.items()
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
    return record if formed and spelt.encode("ascii") == body else None
