"""Audit log: append-only, hash-chained, and durable before `append` returns.

One line per record, canonical JSON that ends with its own hash:

    {"details":…,"event":…,"previous":HASH,"sequence":N,"written":T,"hash":HASH}

`hash` is the SHA-256 of the line without it, `previous` the hash of the record before. `verify_log` thus
finds any record that was edited, deleted, inserted or reordered.

A plain chain does not detect two changes: a tail cut off at the end of a record, and a log rewritten as a
whole with new hashes. Both leave a sound chain, shorter or different. Detecting them takes signed checkpoints
and an anchor (`checkpoints`).

The site chooses how soon a record is durable (`Durability`). In every mode the operating system has the
record before `append` returns, so it survives any end of this process; the modes differ in what a power
failure may lose.

Append before moving a motor: after an `AuditError` nothing may move.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from json.encoder import encode_basestring_ascii
from pathlib import Path
from typing import Any, Final, Self

from aeros.files import sync_folder
from aeros.runtime.audit.check import (
    CHECKPOINT,
    TAIL_REPAIRED,
    AuditReport,
    DecisionCounts,
    Record,
    RecordCheck,
    read_prefix,
    verify_log,
)
from aeros.runtime.audit.checkpoints import (
    CHECKPOINT_INTERVAL,
    AnchorError,
    AuditCheckpoint,
    SigningConfiguration,
    read_anchor,
    write_anchor,
)
from aeros.runtime.audit.format import explain_problem
from aeros.runtime.audit.prefix_memory import ResumableVerifier, read_remembered_prefix
from aeros.runtime.canonical_json import Encoded, seal_record, to_canonical_json
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.ports import LogHead
from aeros.spec.model.policy import Durability

__all__ = ["AuditError", "AuditLog", "AuditReport", "DecisionCounts", "verify_log"]

SYNC_BATCH: Final = 64
"""Records per sync if the site batches them."""

_OWNER_ONLY: Final = 0o600

_ENCODED_EVENTS: Final = ("state", "motion")
"""Details of a decision that come with the canonical text of which the record holds the digest."""


def _refuse_checkpoint(record: Record, own: str) -> str | None:
    """Implement `RecordCheck` for a writer without a key, whose records would look forged in a signed log."""
    if record["event"] != CHECKPOINT:
        return None
    return "it is signed, and can be continued only with its key"


class AuditError(Exception):
    """The record cannot be written, so nothing may move."""


class AuditLog:
    """The only writer of a log; a second process that opens the same log gets an `AuditError`.

    Opening verifies the whole chain and refuses to continue one that is not sound. A last line torn by a
    crash was never acknowledged, so it is replaced by a `tail-mended` record that says so.
    Assumes that `fdatasync` reaches the medium, and that the process does not fork while it writes.

    Args:
        path: the log; created, for its owner alone, if it does not exist.
        clock: seconds since 1970, for people; no decision depends on it.
        durability: which records must be durable before `append` returns.
        signing: sign a checkpoint now, every `CHECKPOINT_INTERVAL` records and on closing, and copy the
            newest to each anchor; None to sign nothing, which a log that was signed refuses.
        listener: called with the line of each record once it is safe, in order; must be quick and not raise.

    Raises:
        AuditError: the log cannot be opened or read, another process writes it, or it is not sound.
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
        self._unsynced = 0
        self._unsigned = 0
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, _OWNER_ONLY)
        except OSError as failure:
            raise AuditError(f"the audit log `{path}` cannot be opened: {failure}") from failure
        # Reason why nothing can be appended, or None.
        self._broken: str | None = "it is not open yet"
        try:
            self._open_existing()
        except BaseException:
            self.close()
            raise

    def append(self, event: str, details: Mapping[str, Any] | Encoded) -> int:
        """Write one record; return once it is safe.

        Safe means durable, unless the site's `Durability` says otherwise for this record. After a failure
        nothing more can be appended: the file's content is unknown until it is opened again.

        Args:
            event: name of the event.
            details: JSON-encodable values. Parts of them may come with their canonical text, and so may
                all of them if they fit into a record.

        Returns:
            Sequence number of the record, from 0.

        Raises:
            AuditError: the record cannot be written.
        """
        with self._lock:
            sequence = self._append(event, details)
            if self._signing is not None and self._unsigned >= CHECKPOINT_INTERVAL:
                self._sign(self._signing, closing=False)
            return sequence

    @property
    def head(self) -> LogHead:
        """Number of records, and hash of the last one."""
        return LogHead(self._sequence, self._head)

    def records_since(self, head: LogHead) -> list[Record] | None:
        """Read the records after an earlier head of this log.

        Args:
            head: earlier value of `head`.

        Returns:
            The records in order; None if the log never had that head.

        Raises:
            AuditError: the log is not sound.
        """
        records: list[Record] = []
        hashes = {0: head.hash}

        def look(record: Record, own: str) -> None:
            if record["sequence"] >= head.records:
                records.append(record)
            elif record["sequence"] == head.records - 1:
                hashes[head.records] = own

        report = verify_log(self.path, look)
        if not report.is_sound:
            why = explain_problem(self.path, report.reason)
            raise AuditError(f"the audit log `{self.path}` is not sound: {why}")
        return records if hashes.get(head.records) == head.hash else None

    def close(self) -> None:
        """Make all records durable, sign a closing checkpoint, and release the lock; safe to call twice.

        Raises:
            AuditError: that failed; the log is closed nevertheless.
        """
        with self._lock:
            if self._file == -1:
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

    def _open_existing(self) -> None:
        """Take the lock, check the existing records, repair a torn tail, and sign what is there.

        Raises:
            AuditError: the log is not sound, cannot be read, or is in use.
        """
        watch = _signature_check(self._signing, self.path)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with os.fdopen(os.dup(self._file), "rb") as file:
                if isinstance(watch, ResumableVerifier):
                    prefix = read_remembered_prefix(file, self.path, watch)
                else:
                    prefix = read_prefix(file, watch)
            if not prefix.records:  # else an earlier writer did so before it wrote the first record
                sync_folder(self.path.parent)
        except BlockingIOError as failure:
            raise AuditError(f"another process writes the audit log `{self.path}`") from failure
        except OSError as failure:
            raise AuditError(f"the audit log `{self.path}` cannot be read: {failure}") from failure
        problem = prefix.problem if prefix.torn_tail is None else None
        if problem is None and isinstance(watch, ResumableVerifier):
            problem = watch.missing_tail(prefix.records)
        if problem is not None:
            why = explain_problem(self.path, problem)
            raise AuditError(f"the audit log `{self.path}` is not sound: {why}")
        self._sequence, self._head, self._end = prefix.records, prefix.head, prefix.end
        self._id = prefix.first  # `GENESIS` until there is a first record
        self._broken = None
        if prefix.torn_tail is not None:
            # Overwrites the torn bytes, so no crash in between can lose the note.
            details = {"bytes": len(prefix.torn_tail), "sha256": hashlib.sha256(prefix.torn_tail).hexdigest()}
            self._append(TAIL_REPAIRED, details, cut=True)
        if self._signing is not None:
            if self._sequence == 0:
                # Random, so that no other log has the same first record.
                self._append("log-began", {"nonce": secrets.token_hex(16)})
            is_anchored = isinstance(watch, ResumableVerifier) and watch.anchors
            only_signs = is_anchored and not self._signing.anchors_opening
            self._sign(replace(self._signing, anchors=()) if only_signs else self._signing, closing=False)

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
        """Return the canonical JSON of a record without its hash."""
        sequence, previous = self._sequence, self._head
        if isinstance(details, Encoded):
            text = (
                f'{{"details":{details.text},"event":{encode_basestring_ascii(event)},"previous":"{previous}"'
                f',"sequence":{sequence},"written":{to_canonical_json(written).decode()}}}'
            )
            return text.encode("ascii")
        head = {"sequence": sequence, "previous": previous, "written": written, "event": event}
        return to_canonical_json({**head, "details": dict(details)}, _ENCODED_EVENTS)

    def _sign(self, signing: SigningConfiguration, *, closing: bool) -> None:
        """Append a checkpoint, then copy it to the anchors.

        Raises:
            AuditError: the log or an anchor cannot be written.
        """
        key, now = signing.key, self._clock()
        checkpoint = AuditCheckpoint(self._id, self._sequence, self._head, now, closing, key.public.id).sign(
            key
        )
        self._append(CHECKPOINT, checkpoint.details(), written=now)
        self._unsigned = 0
        for anchor in signing.anchors:
            try:
                write_anchor(anchor, checkpoint)
            except OSError as failure:
                self._broken = f"its anchor `{anchor}` cannot be written: {failure}"
                raise AuditError(
                    f"the audit log `{self.path}` cannot be written: {self._broken}"
                ) from failure

    def _must_sync(self, event: str, details: Mapping[str, Any] | Encoded) -> bool:
        """Return True if this record, and all before it, must be durable before anything else happens."""
        if self._durability is Durability.EVERY_RECORD or event == CHECKPOINT:
            return True
        if self._durability is Durability.BEFORE_MOTION:
            # Details that come as text are not parsed; they count as an allowed action.
            is_denial = isinstance(details, Mapping) and details.get("verdict") == DecisionKind.DENY.value
            return event == "decision" and not is_denial
        return self._unsynced + 1 >= SYNC_BATCH

    def _write(self, line: bytes, *, sync: bool, cut: bool = False) -> None:
        # Stays if anything, such as a signal, interrupts the write.
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


def _signature_check(signing: SigningConfiguration | None, path: Path) -> RecordCheck:
    """Return a check against key and anchors; without it the next checkpoint would hide tampering.

    Raises:
        AuditError: key or anchor cannot be read, or disagree with the log.
    """
    if signing is None:
        return _refuse_checkpoint
    key = signing.key.public
    try:
        found = [read_anchor(anchor, key) for anchor in signing.anchors]
        return ResumableVerifier(key, tuple(one for one in found if one is not None))
    except AnchorError as failure:
        raise AuditError(f"the audit log `{path}` cannot be continued: {failure}") from failure
