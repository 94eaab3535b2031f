"""The audit record: append-only, hash-chained, and durable before `append` returns.

One line per record, canonical JSON that ends with its own hash:

    {"details":…,"event":…,"previous":HASH,"sequence":N,"written":T,"hash":HASH}

`hash` is the SHA-256 of the line without it, `previous` the hash of the record before.  So an edited,
deleted, inserted or reordered record is found by `verify_log`.

What a plain chain does not notice: a tail cut off at a record's end, and a log rewritten as a whole
with new hashes.  Both leave a sound, shorter or different, chain; noticing them needs signed
checkpoints whose head is kept elsewhere.

Whoever moves a motor appends first: `AuditError` means that nothing may move.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from aeros.runtime.audit_check import GENESIS, AuditReport, DecisionCounts, end_record, scan, verify_log
from aeros.runtime.canonical import canonical

__all__ = ["AuditError", "AuditLog", "AuditReport", "DecisionCounts", "verify_log"]

_OWNER_ONLY: Final = 0o600


class AuditError(Exception):
    """The record cannot be written, so nothing may move."""


class AuditLog:
    """The one writer of the log at `path`; another process that tries meanwhile gets an `AuditError`.

    Opening verifies the whole chain and refuses to continue one that is not sound.  A last line torn
    by a crash was never acknowledged: it is replaced by a `tail-mended` record that says so.
    clock: seconds since 1970, for people; nothing is decided by it.
    Assumes: `fdatasync` reaches the medium, and the process does not fork while it writes.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.time) -> None:
        self.path = path
        self._clock = clock
        self._lock = threading.Lock()
        self._sequence = 0
        self._head = GENESIS
        self._end = 0
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, _OWNER_ONLY)
        except OSError as failure:
            raise AuditError(f"the audit log `{path}` cannot be opened: {failure}") from failure
        # Why nothing can be appended; None while all is well.
        self._broken: str | None = None
        try:
            self._continue()
        except BaseException:
            self.close()
            raise

    def append(self, event: str, details: Mapping[str, Any]) -> int:
        """Write one record and return its sequence number once it is durable; else raise `AuditError`.

        After a failure nothing more can be appended: what the file then holds is unknown until it is
        opened again.
        """
        with self._lock:
            return self._append(event, details)

    def close(self) -> None:
        """Let another writer in; safe to call twice."""
        with self._lock:
            if self._file >= 0:
                os.close(self._file)
                self._file = -1
                self._broken = "it is closed"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # Inside.

    def _continue(self) -> None:
        """Take the lock, check what is there, and mend a torn tail."""
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with os.fdopen(os.dup(self._file), "rb") as file:
                found = scan(file)
                tail = b"" if found.torn is None else found.torn
            _sync_folder(self.path)
        except BlockingIOError as failure:
            raise AuditError(f"another process writes the audit log `{self.path}`") from failure
        except OSError as failure:
            raise AuditError(f"the audit log `{self.path}` cannot be read: {failure}") from failure
        if found.problem is not None and found.torn is None:
            raise AuditError(f"the audit log `{self.path}` is not sound: {found.problem}")
        self._sequence, self._head, self._end = found.records, found.head, found.end
        if found.torn is not None:
            # Written over the torn bytes, so no crash in between can lose the note.
            details = {"bytes": len(tail), "sha256": hashlib.sha256(tail).hexdigest()}
            self._append("tail-mended", details, cut=True)

    def _append(self, event: str, details: Mapping[str, Any], *, cut: bool = False) -> int:
        if self._broken is not None:
            raise AuditError(f"the audit log `{self.path}` cannot be written: {self._broken}")
        body = canonical(
            {
                "sequence": self._sequence,
                "previous": self._head,
                "written": self._clock(),
                "event": event,
                "details": dict(details),
            }
        )
        line, head = end_record(body)
        # Holds if anything, a signal for instance, ends the write half-way.
        self._broken = "an earlier record was not written"
        try:
            self._write(line, cut=cut)
        except OSError as failure:
            self._broken = str(failure)
            raise AuditError(f"the audit log `{self.path}` cannot be written: {failure}") from failure
        sequence = self._sequence
        self._sequence, self._head, self._end = sequence + 1, head, self._end + len(line)
        self._broken = None
        return sequence

    def _write(self, line: bytes, *, cut: bool) -> None:
        written = 0
        while written < len(line):
            written += os.pwrite(self._file, line[written:], self._end + written)
        if cut:
            os.ftruncate(self._file, self._end + len(line))
        os.fdatasync(self._file)


def _sync_folder(path: Path) -> None:
    """Make the file's own existence durable."""
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
