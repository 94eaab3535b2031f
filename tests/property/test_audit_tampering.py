"""Tampered logs: every record that key and anchor vouch for is as it was written.

A log of one or several sessions is written, and then one thing is done to it, with the hashes made anew or
left as they were.  Expected of a report that says "sound": without key, that nothing was done but a cut
or a rewrite; with a key, that the signed part is byte for byte the original; with an anchor, that the whole
anchored part is.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.audit.check import CHECKPOINT, GENESIS, read_prefix, verify_log
from aeros.runtime.audit.checkpoints import (
    CHECKPOINT_INTERVAL,
    AuditCheckpoint,
    SigningConfiguration,
    verify_signed,
)
from aeros.runtime.audit.keys import SigningKey, make_key, read_signing_key
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import seal_record, to_canonical_json


@dataclass
class Written:
    """A log as its writer left it, and what is done to it afterwards."""

    folder: Path
    key: SigningKey
    original: list[bytes]

    @property
    def log(self) -> Path:
        return self.folder / "audit.jsonl"

    @property
    def anchor(self) -> Path:
        return self.folder / "anchor"

    def records(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.original]


@contextmanager
def written(sessions: list[int]) -> Iterator[Written]:
    with (
        tempfile.TemporaryDirectory() as name,
        patch.object(os, "fdatasync", lambda file: None),
        patch.object(os, "fsync", lambda file: None),
    ):
        folder = Path(name)
        make_key(folder / "key")
        one = Written(folder, read_signing_key(folder / "key"), [])
        for count in sessions:
            with AuditLog(
                one.log, clock=lambda: 1.5, signing=SigningConfiguration(one.key, (one.anchor,))
            ) as log:
                for number in range(count):
                    log.append("event", {"number": number})
        one.original = one.log.read_bytes().splitlines(keepends=True)
        yield one


def chained(records: list[dict[str, Any]]) -> list[bytes]:
    """The records renumbered and hashed anew: all that somebody without the key can do."""
    lines, previous = [], GENESIS
    for sequence, record in enumerate(records):
        body = {**record, "sequence": sequence, "previous": previous}
        body.pop("hash", None)
        line, previous = seal_record(to_canonical_json(body))
        lines.append(line)
    return lines


Tampering = Callable[[list[Any], st.DataObject, Any], str]


def edit(items: list[Any], data: st.DataObject, made_up: Any) -> str:
    place = data.draw(st.integers(0, len(items) - 1))
    items[place] = made_up
    return "edit"


def delete(items: list[Any], data: st.DataObject, made_up: Any) -> str:
    place = data.draw(st.integers(0, len(items) - 1))
    kind = "cut" if place == len(items) - 1 else "delete"
    del items[place]
    return kind


def insert(items: list[Any], data: st.DataObject, made_up: Any) -> str:
    items.insert(data.draw(st.integers(0, len(items))), made_up)
    return "insert"


def reorder(items: list[Any], data: st.DataObject, made_up: Any) -> str:
    one = data.draw(st.integers(0, len(items) - 2))
    other = data.draw(st.integers(one + 1, len(items) - 1))
    items[one], items[other] = items[other], items[one]
    return "reorder"


def cut(items: list[Any], data: st.DataObject, made_up: Any) -> str:
    del items[data.draw(st.integers(0, len(items) - 1)) :]
    return "cut"


SESSIONS = st.lists(st.integers(0, 5) | st.just(CHECKPOINT_INTERVAL + 3), min_size=1, max_size=3)
ANY = st.sampled_from([edit, delete, insert, reorder, cut])


@given(sessions=SESSIONS, tamper=ANY, data=st.data())
def test_the_chain_alone_finds_all_but_a_cut(
    sessions: list[int], tamper: Tampering, data: st.DataObject
) -> None:
    with written(sessions) as one:
        lines = list(one.original)
        made_up = data.draw(st.sampled_from([b"x\n", b"{}\n", *chained([one.records()[0]] * 2)]))
        kind = tamper(lines, data, made_up)
        one.log.write_bytes(b"".join(lines))
        if lines == one.original:
            return
        assert verify_log(one.log).is_sound == (kind == "cut")
        assert not verify_signed(one.log, one.key.public, one.anchor).chain.is_sound


@given(sessions=SESSIONS, data=st.data())
def test_every_edited_byte_is_found(sessions: list[int], data: st.DataObject) -> None:
    with written(sessions) as one:
        content = b"".join(one.original)
        place = data.draw(st.integers(0, len(content) - 1))
        byte = data.draw(st.integers(0, 255).filter(lambda value: value != content[place]))
        one.log.write_bytes(content[:place] + bytes([byte]) + content[place + 1 :])
        assert verify_log(one.log).bad_record == content[:place].count(b"\n")


def without_checkpoints(records: list[dict[str, Any]], data: st.DataObject) -> list[dict[str, Any]]:
    """Those from some place on dropped: the end of the log is the attacker's own."""
    place = data.draw(st.integers(0, len(records)))
    return records[:place] + [one for one in records[place:] if one["event"] != CHECKPOINT]


def signed_by(key: SigningKey, records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """All checkpoints made anew with another key, each for what now stands before it."""
    made: list[dict[str, Any]] = []
    for record in records:
        lines = chained(made)
        if record["event"] == CHECKPOINT and made:
            first, last = (json.loads(line)["hash"] for line in (lines[0], lines[-1]))
            new = AuditCheckpoint(first, len(made), last, record["written"], False, key.public.id).sign(key)
            record = {**record, "details": new.details()}
        made.append(record)
    return made


@given(sessions=SESSIONS, tamper=ANY, how=st.sampled_from(["kept", "dropped", "resigned"]), data=st.data())
def test_key_and_anchor_vouch_for_nothing_that_was_rewritten(
    sessions: list[int], tamper: Tampering, how: str, data: st.DataObject
) -> None:
    with written(sessions) as one:
        records = one.records()
        tamper(records, data, {"event": "made-up", "details": {}, "written": 1.5})
        if how == "dropped":
            records = without_checkpoints(records, data)
        elif how == "resigned":
            make_key(one.folder / "stranger")
            records = signed_by(read_signing_key(one.folder / "stranger"), records)
        lines = chained(records)
        one.log.write_bytes(b"".join(lines))
        with one.log.open("rb") as file:
            assert read_prefix(file).problem is None
        by_key = verify_signed(one.log, one.key.public)
        assert not by_key.chain.is_sound or lines[: by_key.signed] == one.original[: by_key.signed]
        # The anchor holds the last record of a log that was closed.
        by_anchor = verify_signed(one.log, one.key.public, one.anchor)
        assert by_anchor.chain.is_sound == (lines[: len(one.original)] == one.original)


@given(before=st.integers(0, 3), loose=st.integers(1, 5), data=st.data())
def test_after_a_crash_the_report_says_from_where_on_nothing_is_vouched_for(
    before: int, loose: int, data: st.DataObject
) -> None:
    with written([before]) as one:
        log = AuditLog(one.log, signing=SigningConfiguration(one.key, (one.anchor,)))
        for number in range(loose):
            log.append("event", {"number": number})
        os.close(log._file)  # as a kill would
        records = [json.loads(line) for line in one.log.read_bytes().splitlines()]
        report = verify_signed(one.log, one.key.public, one.anchor)
        assert (report.chain.is_sound, report.closed) == (True, False)
        assert report.signed == report.anchored == len(records) - loose
        place = data.draw(st.integers(0, len(records) - 1))
        records[place]["event"] = "made-up"
        one.log.write_bytes(b"".join(chained(records)))
        found = verify_signed(one.log, one.key.public, one.anchor)
        assert found.chain.is_sound == (place >= report.signed)
