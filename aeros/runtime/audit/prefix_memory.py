"""Sound beginnings of logs that this process has checked: only records that are new since are checked again.

A beginning is remembered by the SHA-256 of all its bytes, together with the findings of the check that read
it.  All bytes are hashed each time.  So a log that was changed anywhere is checked from its first record on,
as is one that holds no longer what an anchor demands of it.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Hashable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, Final, Protocol, Self, cast

from aeros.runtime.audit.check import CHECKPOINT, LogPrefix, Record, read_prefix
from aeros.runtime.audit.checkpoints import AuditCheckpoint, CheckpointVerifier, parse_checkpoint
from aeros.runtime.audit.keys import PublicKey

_MAX_LOGS: Final = 16
"""Number of beginnings that are remembered; the least recently used one is forgotten."""

_BLOCK: Final = 1 << 20


class ResumableCheck(Protocol):
    """A `RecordCheck` whose findings on the beginning of a log can be copied and continued."""

    @property
    def premises(self) -> Hashable:
        """Everything but the records that its findings depend on, and its kind."""

    def __call__(self, record: Record, own: str) -> str | None:
        """Implement `RecordCheck`."""

    def copy(self) -> Self:
        """Copy the findings so far.

        Returns:
            A check with these findings, which stays as it is when this one goes on.
        """

    def resume(self, earlier: Any) -> bool:
        """Take over the findings of a check with the same premises.

        Args:
            earlier: the check, which stays as it is.

        Returns:
            False if those records do not suffice for this check, which must then read them itself.
        """


class _Remembered:
    """A sound beginning, the SHA-256 of its bytes, and the findings of the check that read it."""

    def __init__(self, prefix: LogPrefix, digest: bytes, check: ResumableCheck) -> None:
        self.prefix = prefix
        self.digest = digest
        self.check = check


_REMEMBERED: Final = OrderedDict[Hashable, _Remembered]()


def read_remembered_prefix(file: BinaryIO, path: Path, check: ResumableCheck) -> LogPrefix:
    """Read a log as `read_prefix` does; check only records that this process has not checked before.

    Args:
        file: the log, seekable; its position changes.
        path: its path, under which its beginning is remembered; nothing else depends on it.
        check: called with each sound record, or given the findings on those it has checked before.

    Returns:
        The sound beginning.

    Raises:
        LogReadError: the log cannot be read.
    """
    key = str(path), check.premises
    known = _REMEMBERED.get(key)
    begin, hasher = None, hashlib.sha256()
    if known is not None:
        found = _hash_beginning(file, known.prefix.end)
        if found.digest() == known.digest and check.resume(known.check):
            begin, hasher = known.prefix, found
    hashed = _HashedLines(file, hasher)
    prefix = read_prefix(cast(BinaryIO, hashed), check, begin)
    if prefix.problem is None:
        _REMEMBERED.pop(key, None)  # so that it comes last; another thread may have forgotten it
        _REMEMBERED[key] = _Remembered(prefix, hasher.digest(), check.copy())
        if len(_REMEMBERED) > _MAX_LOGS:
            _REMEMBERED.popitem(last=False)
    return prefix


def _hash_beginning(file: BinaryIO, length: int) -> Any:
    """Hash the first bytes of a file; none of one that cannot be read, which `read_prefix` reports."""
    hasher = hashlib.sha256()
    try:
        file.seek(0)
        while length and (block := file.read(min(length, _BLOCK))):
            hasher.update(block)
            length -= len(block)
    except OSError:
        return hashlib.sha256()
    return hasher


class _HashedLines:
    """A file of which each line is hashed as it is read."""

    def __init__(self, file: BinaryIO, hasher: Any) -> None:
        self._file = file
        self._hasher = hasher
        self.seek = file.seek
        self.fileno = file.fileno

    def __iter__(self) -> Iterator[bytes]:
        for line in self._file:
            self._hasher.update(line)
            yield line


class ResumableVerifier(CheckpointVerifier):
    """A `CheckpointVerifier` whose findings can be continued, also with newer anchors."""

    def __init__(self, key: PublicKey, anchors: tuple[AuditCheckpoint, ...] = ()) -> None:
        super().__init__(key, anchors)
        self.premises: Hashable = ("signatures", key.id)
        self._read = 0
        self._checkpoints: dict[int, AuditCheckpoint | None] = {}

    @property
    def anchors(self) -> tuple[AuditCheckpoint, ...]:
        """Checkpoints that the log must contain."""
        return self._anchors

    def __call__(self, record: Record, own: str) -> str | None:
        """Implement `RecordCheck`, and keep each checkpoint to compare later anchors with."""
        problem = super().__call__(record, own)
        self._read += problem is None
        if problem is None and record["event"] == CHECKPOINT:
            self._checkpoints[record["sequence"]] = parse_checkpoint(record["details"])
        return problem

    def copy(self) -> Self:
        """Implement `ResumableCheck.copy`."""
        made = type(self)(self._key)
        vars(made).update(vars(self), _checkpoints=dict(self._checkpoints))
        return made

    def resume(self, earlier: ResumableVerifier) -> bool:
        """Implement `ResumableCheck.resume`: the records must hold what the anchors demand of them."""
        anchors = self._anchors
        for anchor in anchors:
            is_read = anchor.sequence < earlier._read
            if anchor.log != earlier.log or (is_read and earlier._checkpoints.get(anchor.sequence) != anchor):
                return False
        vars(self).update(vars(earlier), _checkpoints=dict(earlier._checkpoints), _anchors=anchors)
        return True
