"""Signed checkpoints of the audit record, and the anchor: what a plain chain cannot notice, they do.

A checkpoint is a record of the log that signs the head of the chain before it, so nobody without the
key can rewrite what comes before a checkpoint.  The anchor is a copy of the newest checkpoint, kept
where whoever can write the log cannot write: it says how long the log was at least, so that no
tail can be cut off up to there.

A checkpoint is durable before it is anchored, so an anchor is never ahead of the log it belongs to.
What neither shows: the records after the newest checkpoint, at most `CHECKPOINT_INTERVAL`, and with a key but
without an anchor, a log cut off right after an earlier checkpoint or exchanged for another one that the key
signed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from aeros.files import replace_durably
from aeros.runtime.audit.check import AuditReport, Record, verify_log
from aeros.runtime.audit.keys import PublicKey, SigningKey
from aeros.runtime.canonical_json import to_canonical_json

CHECKPOINT: Final = "checkpoint"
"""The event of a record that is a checkpoint."""

TAIL_REPAIRED: Final = "tail-mended"
"""The event of the note that a torn last line was replaced."""

CHECKPOINT_INTERVAL: Final = 64
"""Records after which the next is a checkpoint, at the latest."""

_FORMAT: Final = "aeros/audit-checkpoint/1"
_MAX_ANCHOR_BYTES: Final = 10_000


class AnchorError(Exception):
    """There is something at the anchor's path that is no anchor of ours; the message says why."""


@dataclass(frozen=True)
class SigningConfiguration:
    """What a writer signs with, and where it keeps the newest checkpoint besides the log."""

    key: SigningKey
    anchor: Path | None = None


@dataclass(frozen=True, slots=True)
class AuditCheckpoint:
    """That the log `log` held `sequence` records, the last of which has the hash `head`, at `time`.

    log: the hash of its first record.
    closing: the writer ended its work with this checkpoint.
    key: id of the key that signs.
    """

    log: str
    sequence: int
    head: str
    time: float
    closing: bool
    key: str
    signature: str = ""

    def signed_bytes(self) -> bytes:
        """What is signed."""
        return to_canonical_json({**self.details(), "signature": "", "format": _FORMAT})

    def sign(self, key: SigningKey) -> AuditCheckpoint:
        """The same with `key`'s signature."""
        return replace(self, signature=key.sign(self.signed_bytes()))

    def is_signed_by(self, key: PublicKey) -> bool:
        """Whether the signature is `key`'s over this very statement."""
        return self.key == key.id and key.verify(self.signature, self.signed_bytes())

    def details(self) -> dict[str, Any]:
        """As the record and the anchor hold it."""
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
    """The checkpoint that a record or an anchor holds, or None for what is none."""
    if details.keys() != _TYPES.keys():
        return None
    if not all(type(details[name]) in types for name, types in _TYPES.items()):
        return None
    return AuditCheckpoint(**details)


class CheckpointVerifier:
    """Watches a log being read for what its checkpoints and its anchor say of it.

    signed: how many records the checkpoints met so far vouch for, themselves included.
    closed: whether the last record is one that closes the log.
    """

    def __init__(self, key: PublicKey, anchor: AuditCheckpoint | None = None) -> None:
        self.log: str | None = None
        self.signed = 0
        self.closed = False
        self._key = key
        self._anchor = anchor
        self._bare = 0  # records since the last checkpoint, without notes of crashes in between

    def __call__(self, record: Record, own: str) -> str | None:
        """What is wrong with this record, or None; see `audit_check.RecordCheck`."""
        place = record["sequence"]
        if place == 0:
            self.log = own
            if self._anchor is not None and self._anchor.log != own:
                return "the anchor is of another log, or this one was rewritten from its first record"
        found = parse_checkpoint(record["details"]) if record["event"] == CHECKPOINT else None
        if self._anchor is not None and self._anchor.sequence == place and found != self._anchor:
            return f"record {place} is not the checkpoint that the anchor holds: the log was rewritten"
        self.closed = False
        if record["event"] != CHECKPOINT:
            self._bare += record["event"] != TAIL_REPAIRED
            if self.signed and self._bare > CHECKPOINT_INTERVAL:
                return f"record {place} should be a checkpoint: {CHECKPOINT_INTERVAL} records before it are not signed"
            return None
        if found is None or not found.is_signed_by(self._key):
            return f"the checkpoint in record {place} is not signed with this key"
        # Times as they are spelt: 1 and 1.0 are equal.
        said = (found.log, found.sequence, found.head, repr(found.time))
        if said != (self.log, place, record["previous"], repr(record["written"])):
            return f"the checkpoint in record {place} was signed for other records than those before it"
        self.signed, self.closed, self._bare = place + 1, found.closing, 0
        return None

    def missing_tail(self, records: int) -> str | None:
        """What a log of that many records lacks at its end, or None."""
        if self._anchor is None or self._anchor.sequence < records:
            return None
        if records == 0:
            return (
                "it is empty, and the anchor holds a record of one that is not; each log has its own anchor"
            )
        return f"the log was cut: it ends before record {self._anchor.sequence}, which the anchor holds"


@dataclass(frozen=True, slots=True)
class SignatureReport:
    """What chain, signatures and anchor together say of a log.

    signed: how many records, from the first on, the key vouches for.
    anchored: how many records, from the first on, the anchor shows to be there still; 0 without one.
    closed: whether the writer ended the log; otherwise it is at work still, or was killed.
    """

    chain: AuditReport
    signed: int
    anchored: int
    closed: bool


def verify_signed(path: Path, key: PublicKey, anchor: Path | None = None) -> SignatureReport:
    """Whether the log is an unbroken chain that `key` signed, and reaches to where its anchor says.

    Raises `AnchorError` where `anchor` is given and is none, or not signed with `key`.
    """
    anchored = None if anchor is None else read_anchor(anchor, key)
    if anchor is not None and anchored is None:
        raise AnchorError(f"there is no anchor at `{anchor}`")
    watch = CheckpointVerifier(key, anchored)
    chain = verify_log(path, watch)
    if chain.is_sound:
        unsigned = None if watch.signed else "no checkpoint of this key is in the log"
        why = watch.missing_tail(chain.records) or unsigned
        chain = chain if why is None else replace(chain, bad_record=chain.records, reason=why)
    reached = anchored.sequence + 1 if anchored is not None and chain.is_sound else 0
    return SignatureReport(chain, watch.signed, reached, watch.closed)


def read_anchor(path: Path, key: PublicKey) -> AuditCheckpoint | None:
    """The checkpoint at `path`, signed with `key`; None where there is no file."""
    try:
        with path.open("rb") as file:
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
    """Put `checkpoint` at `path`, whole or not at all, and durable; raises `OSError`."""
    replace_durably(path, to_canonical_json(checkpoint.details()) + b"\n")
