"""The audit record: append-only, hash-chained, and durable before `append` returns.

One line per record, canonical JSON that ends with its own hash:

    {"details":…,"event":…,"previous":HASH,"sequence":N,"written":T,"hash":HASH}

`hash` is the SHA-256 of the line without it, `previous` the hash of the record before.  So an edited,
deleted, inserted or reordered record is found by `verify_log`.

What a plain chain does not notice: a tail cut off at a record's end, and a log rewritten as a whole
with new hashes.  Both leave a sound, shorter or different, chain; noticing them takes signed
checkpoints and an anchor (`audit_checkpoints`).

How soon a record is durable is the site's choice (`Durability`).  Whatever it is, a record is with the
operating system before `append` returns, so that no end of this process loses it; the modes differ
in what a failure of power may take.

Whoever moves a motor appends first: `AuditError` means that nothing may move.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from json.encoder import encode_basestring_ascii
from pathlib import Path
from typing import Any, Final, Self

from aeros.files import sync_folder
from aeros.runtime.audit.check import (
    GENESIS,
    AuditReport,
    DecisionCounts,
    Record,
    read_prefix,
    seal_record,
    verify_log,
)
from aeros.runtime.audit.checkpoints import (
    CHECKPOINT,
    CHECKPOINT_INTERVAL,
    TAIL_REPAIRED,
    AnchorError,
    AuditCheckpoint,
    CheckpointVerifier,
    SigningConfiguration,
    read_anchor,
    write_anchor,
)
from aeros.runtime.audit.format import explain_problem
from aeros.runtime.canonical_json import Encoded, to_canonical_json
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.ports import LogHead
from aeros.spec.model.model import Durability

__all__ = ["AuditError", "AuditLog", "AuditReport", "DecisionCounts", "verify_log"]

SYNC_BATCH: Final = 64
"""Records that one sync makes durable where the site batches them."""

_OWNER_ONLY: Final = 0o600

_ENCODED_EVENTS: Final = ("state", "motion")
"""Details of a decision that come with their canonical text, as its digests are of that; ours alone."""


class AuditError(Exception):
    """The record cannot be written, so nothing may move."""


class AuditLog:
    """The one writer of the log at `path`; another process that tries meanwhile gets an `AuditError`.

    Opening verifies the whole chain and refuses to continue one that is not sound.  A last line torn
    by a crash was never acknowledged: it is replaced by a `tail-mended` record that says so.
    clock: seconds since 1970, for people; nothing is decided by it.
    signing: sign a checkpoint now, every `CHECKPOINT_INTERVAL` records and at the end, and keep the newest
        at the anchor.
    listener: is given the line of each record once that is safe, in order; must be quick and not raise.
    Assumes: `fdatasync` reaches the medium, and the process does not fork while it writes.
    """

    def __init__(
        self,
        path: Path,
        clock: Callable[[], float] = time.time,
        *,
        durability: Durability = Durability.EVERY_RECORD,
        signing: SigningConfiguration | None = None,
        listener: Callable[[bytes], None] | None = None,
    ) -> None:
        self.path = path
        self._clock = clock
        self._durability = durability
        self._signing = signing
        self._listener = listener
        self._lock = threading.Lock()
        self._sequence = 0
        self._head = GENESIS
        self._end = 0
        self._id = GENESIS  # the hash of the first record, once there is one
        self._unsynced = 0
        self._unsigned = 0
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, _OWNER_ONLY)
        except OSError as failure:
            raise AuditError(f"the audit log `{path}` cannot be opened: {failure}") from failure
        # Why nothing can be appended; None while all is well.
        self._broken: str | None = "it is not open yet"
        try:
            self._open_existing()
        except BaseException:
            self.close()
            raise

    def append(self, event: str, details: Mapping[str, Any] | Encoded) -> int:
        """Write one record and return its sequence number once it is safe; else raise `AuditError`.

        details: with the canonical text of parts of them, or of all: of a dict that a record has room for.
        Safe is durable, unless the site's `Durability` says otherwise of this record.  After a failure
        nothing more can be appended: what the file then holds is unknown until it is opened again.
        """
        with self._lock:
            sequence = self._append(event, details)
            if self._signing is not None and self._unsigned >= CHECKPOINT_INTERVAL:
                self._sign(self._signing, closing=False)
            return sequence

    @property
    def head(self) -> LogHead:
        """Where the log ends."""
        return LogHead(self._sequence, self._head)

    def records_since(self, head: LogHead) -> list[Record] | None:
        """The records after `head`; None where the log never ended so.  Raises `AuditError`."""
        found: list[Record] = []
        hashes = {0: head.hash}

        def look(record: Record, own: str) -> None:
            if record["sequence"] >= head.records:
                found.append(record)
            elif record["sequence"] == head.records - 1:
                hashes[head.records] = own

        report = verify_log(self.path, look)
        if not report.is_sound:
            why = explain_problem(self.path, report.reason)
            raise AuditError(f"the audit log `{self.path}` is not sound: {why}")
        return found if hashes.get(head.records) == head.hash else None

    def close(self) -> None:
        """Make durable and sign what is not yet, and let another writer in; safe to call twice.

        Raises `AuditError` where that fails; the log is closed then too.
        """
        with self._lock:
            if self._file < 0:
                return
            try:
                if self._broken is None and self._signing is not None:
                    self._sign(self._signing, closing=True)
                elif self._broken is None and self._unsynced:
                    self._write(b"", sync=True)
            finally:
                os.close(self._file)
                self._file = -1
                self._broken = "it is closed"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # Inside.

    def _open_existing(self) -> None:
        """Take the lock, check what is there, mend a torn tail, and sign what is there now."""
        watch = self._check_signatures()
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with os.fdopen(os.dup(self._file), "rb") as file:
                found = read_prefix(file, watch)
            sync_folder(self.path.parent)
        except BlockingIOError as failure:
            raise AuditError(f"another process writes the audit log `{self.path}`") from failure
        except OSError as failure:
            raise AuditError(f"the audit log `{self.path}` cannot be read: {failure}") from failure
        problem = found.problem if found.torn_tail is None else None
        if problem is None and watch is not None:
            problem = watch.missing_tail(found.records)
        if problem is not None:
            why = explain_problem(self.path, problem)
            raise AuditError(f"the audit log `{self.path}` is not sound: {why}")
        self._sequence, self._head, self._end = found.records, found.head, found.end
        self._id = found.first
        self._broken = None
        if found.torn_tail is not None:
            # Written over the torn bytes, so no crash in between can lose the note.
            details = {"bytes": len(found.torn_tail), "sha256": hashlib.sha256(found.torn_tail).hexdigest()}
            self._append(TAIL_REPAIRED, details, cut=True)
        if self._signing is not None:
            if self._sequence == 0:
                # Random, so that no other log has the same first record.
                self._append("log-began", {"nonce": secrets.token_hex(16)})
            self._sign(self._signing, closing=False)

    def _check_signatures(self) -> CheckpointVerifier | None:
        """Holds what is there against key and anchor, which the next checkpoint would otherwise hide."""
        if self._signing is None:
            return None
        key, anchor = self._signing.key.public, self._signing.anchor
        try:
            return CheckpointVerifier(key, None if anchor is None else read_anchor(anchor, key))
        except AnchorError as failure:
            raise AuditError(f"the audit log `{self.path}` cannot be continued: {failure}") from failure

    def _append(
        self,
        event: str,
        details: Mapping[str, Any] | Encoded,
        *,
        written: float | None = None,
        cut: bool = False,
    ) -> int:
        if self._broken is not None:
            raise AuditError(f"the audit log `{self.path}` cannot be written: {self._broken}")
        body = self._encode_record(event, details, self._clock() if written is None else written)
        line, head = seal_record(body)
        self._write(line, cut=cut, sync=self._must_sync(event, details))
        sequence = self._sequence
        self._sequence, self._head, self._end = sequence + 1, head, self._end + len(line)
        self._unsigned += 1
        if sequence == 0:
            self._id = head
        if self._listener is not None:
            self._listener(line)
        return sequence

    def _encode_record(self, event: str, details: Mapping[str, Any] | Encoded, written: float) -> bytes:
        """The canonical JSON of a record without its hash."""
        sequence, previous = self._sequence, self._head
        if isinstance(details, Encoded):
            text = (
                f'{{"details":{details.text},"event":{encode_basestring_ascii(event)}'
                f',"previous":"{previous}","sequence":{sequence},"written":{to_canonical_json(written).decode()}}}'
            )
            return text.encode("ascii")
        head = {"sequence": sequence, "previous": previous, "written": written, "event": event}
        return to_canonical_json({**head, "details": dict(details)}, _ENCODED_EVENTS)

    def _sign(self, signing: SigningConfiguration, *, closing: bool) -> None:
        """Append a checkpoint, and then keep it at the anchor too."""
        key, now = signing.key, self._clock()
        checkpoint = AuditCheckpoint(self._id, self._sequence, self._head, now, closing, key.public.id).sign(
            key
        )
        self._append(CHECKPOINT, checkpoint.details(), written=now)
        self._unsigned = 0
        if signing.anchor is not None:
            try:
                write_anchor(signing.anchor, checkpoint)
            except OSError as failure:
                self._broken = f"its anchor `{signing.anchor}` cannot be written: {failure}"
                raise AuditError(
                    f"the audit log `{self.path}` cannot be written: {self._broken}"
                ) from failure

    def _must_sync(self, event: str, details: Mapping[str, Any] | Encoded) -> bool:
        """Whether this record, with all before it, must be durable before anything else happens."""
        if self._durability is Durability.EVERY_RECORD or event == CHECKPOINT:
            return True
        if self._durability is Durability.BEFORE_MOTION:
            # Of what is told as text it is not read whether it allows anything.
            is_denial = isinstance(details, Mapping) and details.get("verdict") == DecisionKind.DENY.value
            return event == "decision" and not is_denial
        return self._unsynced + 1 >= SYNC_BATCH

    def _write(self, line: bytes, *, sync: bool, cut: bool = False) -> None:
        # Holds if anything, a signal for instance, ends the write half-way.
        self._broken = "an earlier record was not written"
        try:
            written = 0
            while written < len(line):
                written += os.pwrite(self._file, line[written:], self._end + written)
            if cut:
                os.ftruncate(self._file, self._end + len(line))
            if sync or cut:
                os.fdatasync(self._file)
        except OSError as failure:
            self._broken = str(failure)
            raise AuditError(f"the audit log `{self.path}` cannot be written: {failure}") from failure
        self._unsynced = 0 if sync or cut else self._unsynced + 1
        self._broken = None
