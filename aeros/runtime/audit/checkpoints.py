"""Signed checkpoints of the audit log, and the anchor: they detect what a plain hash chain cannot.

A checkpoint is a record that signs the head of the chain before it. Without the key nobody can rewrite what
comes before a checkpoint. An anchor is a copy of the newest checkpoint, stored where a writer of the log
has no write access. It proves a minimum length of the log, so no tail can be cut off up to there. A log may
have several anchors; an attacker who puts an earlier log back must put an earlier copy of each anchor back.

A checkpoint is durable before it is anchored, so an anchor is never ahead of its log.
A writer that opens a closed log signs at once, so after a closing checkpoint only the note of a repair and
another checkpoint may stand. In a log that was not closed, changes to the records after the newest
checkpoint, at most `CHECKPOINT_INTERVAL`, are not detected. With a key but without an anchor, two more
changes go undetected: a log cut off right after an earlier checkpoint, and a log replaced by another one
that the key signed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from aeros.files import open_regular, replace_durably
from aeros.runtime.audit.check import CHECKPOINT, AuditReport, Record, is_repair_note, verify_log
from aeros.runtime.audit.keys import PublicKey, SigningKey
from aeros.runtime.canonical_json import to_canonical_json

CHECKPOINT_INTERVAL: Final = 64
"""Limit on the records between two checkpoints."""

_FORMAT: Final = "aeros/audit-checkpoint/1"
_MAX_ANCHOR_BYTES: Final = 10_000


class AnchorError(Exception):
    """The file at the anchor's path is not an anchor of this key; the message says why."""


@dataclass(frozen=True)
class SigningConfiguration:
    """Key and anchors with which a writer signs checkpoints.

    Attributes:
        key: signing key.
        anchors: paths of the anchors, the copies of the last checkpoint outside the log.
        anchors_opening: copy also the checkpoint with which the log is opened. False for a log of which
            records count only once it is closed; then only the first one ever is copied.
    """

    key: SigningKey
    anchors: tuple[Path, ...] = ()
    anchors_opening: bool = True


@dataclass(frozen=True, slots=True)
class AuditCheckpoint:
    """Statement that a log held a number of records and ended with a given hash.

    Attributes:
        log: hash of the log's first record, which identifies the log.
        sequence: number of records before the checkpoint.
        head: hash of the last of them.
        time: seconds since 1970.
        closing: the writer ended its work with this checkpoint.
        key: id of the key that signs.
        signature: in hexadecimal; empty until signed.
    """

    log: str
    sequence: int
    head: str
    time: float
    closing: bool
    key: str
    signature: str = ""

    def signed_bytes(self) -> bytes:
        """Encode the statement that the signature covers.

        Returns:
            Canonical JSON of the checkpoint without signature, and of the format's name.
        """
        return to_canonical_json({**self.details(), "signature": "", "format": _FORMAT})

    def sign(self, key: SigningKey) -> AuditCheckpoint:
        """Sign the checkpoint.

        Args:
            key: its public id must be `self.key`.

        Returns:
            The checkpoint with the signature.
        """
        return replace(self, signature=key.sign(self.signed_bytes()))

    def is_signed_by(self, key: PublicKey) -> bool:
        """Verify the signature of this statement.

        Args:
            key: public key that must have signed.

        Returns:
            True if it is valid for exactly this statement.
        """
        return self.key == key.id and key.verify(self.signature, self.signed_bytes())

    def details(self) -> dict[str, Any]:
        """Convert to the form that the record and the anchor hold.

        Returns:
            Fields by name.
        """
        return {name: getattr(self, name) for name in _TYPES}


_TYPES: Final = {
    "log": (str,),
    "sequence": (int,),
    "head": (str,),
    "time": (float, int),
    "closing": (bool,),
    "key": (str,),
    "signature": (str,),
}


def parse_checkpoint(details: Mapping[str, Any]) -> AuditCheckpoint | None:
    """Parse the checkpoint in a record or an anchor.

    Args:
        details: decoded JSON object.

    Returns:
        The checkpoint; None if the fields or their types differ. The signature is not checked.
    """
    if details.keys() != _TYPES.keys():
        return None
    if not all(type(details[name]) in types for name, types in _TYPES.items()):
        return None
    return AuditCheckpoint(**details)


class CheckpointVerifier:
    """Check of a log's checkpoints and anchor, as `RecordCheck` for `verify_log`.

    Attributes:
        log: hash of the first record; None before it was read.
        signed: number of records that the checkpoints so far cover, themselves included.
        closed: True if the last record closes the log.

    Args:
        key: public key that must have signed every checkpoint.
        anchors: checkpoints that the log must contain.
    """

    def __init__(self, key: PublicKey, anchors: Sequence[AuditCheckpoint] = ()) -> None:
        self.log: str | None = None
        self.signed = 0
        self.closed = False
        self._key = key
        self._anchors = tuple(anchors)
        self._is_ended = False  # after a closing checkpoint, until a writer opens the log and signs again
        self._bare = 0  # records since the last checkpoint, not counting notes of repairs

    def __call__(self, record: Record, own: str) -> str | None:
        """Implement `check.RecordCheck`."""
        place = record["sequence"]
        if place == 0:
            self.log = own
            if any(anchor.log != own for anchor in self._anchors):
                return "the anchor is of another log, or this one was rewritten from its first record"
        found = parse_checkpoint(record["details"]) if record["event"] == CHECKPOINT else None
        if any(anchor.sequence == place and found != anchor for anchor in self._anchors):
            return f"record {place} is not the checkpoint that the anchor holds: the log was rewritten"
        self.closed = False
        if record["event"] != CHECKPOINT:
            if self._is_ended and not is_repair_note(record):
                return f"record {place} was added to a closed log by a writer without the key"
            self._bare += not is_repair_note(record)
            if self.signed and self._bare > CHECKPOINT_INTERVAL:
                return (
                    f"record {place} should be a checkpoint: "
                    f"{CHECKPOINT_INTERVAL} records before it are not signed"
                )
            return None
        if found is None or not found.is_signed_by(self._key):
            return f"the checkpoint in record {place} is not signed with this key"
        # Times by spelling, because 1 and 1.0 are equal.
        claimed = (found.log, found.sequence, found.head, repr(found.time))
        if claimed != (self.log, place, record["previous"], repr(record["written"])):
            return f"the checkpoint in record {place} was signed for other records than those before it"
        self.signed, self.closed, self._is_ended, self._bare = place + 1, found.closing, found.closing, 0
        return None

    def missing_tail(self, records: int) -> str | None:
        """Compare the length of the log with its anchor, after all records were checked.

        Args:
            records: number of records in the log.

        Returns:
            What is missing at the end, in words; None if nothing is.
        """
        for anchor in self._anchors:
            if anchor.sequence < records:
                continue
            if records == 0:
                return (
                    "the log is empty, but the anchor is of a log with records; each log has its own anchor"
                )
            return f"the log was cut: it ends before record {anchor.sequence}, which the anchor holds"
        return None


@dataclass(frozen=True, slots=True)
class SignatureReport:
    """Result of checking chain, signatures and anchor of a log.

    Attributes:
        chain: result for the chain, with problems of signatures and anchor.
        signed: number of records, from the first on, that the key's checkpoints cover.
        anchored: number of records, from the first on, that the anchors prove to be there; 0 without one.
        closed: the writer closed the log; otherwise it is still at work, or was killed.
    """

    chain: AuditReport
    signed: int
    anchored: int
    closed: bool


def verify_signed(path: Path, key: PublicKey, *anchors: Path) -> SignatureReport:
    """Check that a log is an unbroken chain, signed by `key`, that reaches at least to each of its anchors.

    Args:
        path: the log.
        key: public key of its writer.
        anchors: paths of the log's anchors.

    Returns:
        The report.

    Raises:
        AnchorError: an anchor is missing, is not an anchor, or is not signed with `key`.
    """
    anchored = []
    for anchor in anchors:
        found = read_anchor(anchor, key)
        if found is None:
            raise AnchorError(f"there is no anchor at `{anchor}`")
        anchored.append(found)
    watch = CheckpointVerifier(key, anchored)
    chain = verify_log(path, watch)
    if chain.is_sound:
        unsigned = None if watch.signed else "no checkpoint of this key is in the log"
        why = watch.missing_tail(chain.records) or unsigned
        chain = chain if why is None else replace(chain, bad_record=chain.records, reason=why)
    reached = max((one.sequence + 1 for one in anchored), default=0) if chain.is_sound else 0
    return SignatureReport(chain, watch.signed, reached, watch.closed)


def read_anchor(path: Path, key: PublicKey) -> AuditCheckpoint | None:
    """Read an anchor and check its signature.

    Args:
        path: the anchor.
        key: public key that must have signed it.

    Returns:
        The checkpoint; None if there is no file.

    Raises:
        AnchorError: the file cannot be read, is not an anchor, or is not signed with `key`.
    """
    try:
        with open_regular(path) as file:
            content = file.read(_MAX_ANCHOR_BYTES)
        found = parse_checkpoint(dict(json.loads(content)))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise AnchorError(f"the anchor `{path}` cannot be read: {error.strerror}") from error
    except (ValueError, TypeError, RecursionError):
        found = None
    if found is None:
        raise AnchorError(f"`{path}` is not an anchor of an audit log")
    if not found.is_signed_by(key):
        raise AnchorError(f"the anchor `{path}` is not signed with this key")
    return found


def write_anchor(path: Path, checkpoint: AuditCheckpoint) -> None:
    """Write an anchor atomically and durably.

    Args:
        path: the anchor; replaced if it exists.
        checkpoint: newest checkpoint of the log.

    Raises:
        OSError: it cannot be written.
    """
    replace_durably(path, to_canonical_json(checkpoint.details()) + b"\n")
