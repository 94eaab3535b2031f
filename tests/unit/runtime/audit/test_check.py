from __future__ import annotations

import json
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import BinaryIO

import pytest

from aeros.runtime.audit.check import GENESIS, AuditReport, LogPrefix, LogReadError, Record, read_prefix
from aeros.runtime.audit.log import AuditError, AuditLog, DecisionCounts, verify_log
from aeros.runtime.canonical_json import seal_record, to_canonical_json
from aeros.runtime.gate.decision import DecisionKind


@pytest.fixture
def log_path(tmp_path: Path) -> Path:
    return tmp_path / "audit.jsonl"


def write(path: Path, count: int = 5) -> list[bytes]:
    with AuditLog(path, clock=lambda: 1.5) as log:
        for number in range(count):
            assert log.append("event", {"number": number, "speed": 0.1}) == number
    return path.read_bytes().splitlines(keepends=True)


def test_every_edited_byte_is_found(log_path: Path) -> None:
    content = b"".join(write(log_path))
    chance = Random(1)  # noqa: S311 - a test, the same every time
    for _ in range(200):
        place = chance.randrange(len(content))
        byte = chance.choice([value for value in range(256) if value != content[place]])
        log_path.write_bytes(content[:place] + bytes([byte]) + content[place + 1 :])
        report = verify_log(log_path)
        assert report.bad_record == content[:place].count(b"\n"), (place, byte)


@pytest.mark.parametrize(
    ("order", "bad", "why"),
    [
        ([0, 2, 3, 4], 1, "record 1 is missing or moved: number 2 stands in its place"),
        ([0, 1, 1, 2, 3, 4], 2, "record 2 is missing or moved: number 1 stands in its place"),
        ([0, 2, 1, 3, 4], 1, "record 1 is missing or moved: number 2 stands in its place"),
        ([1, 2, 3, 4], 0, "record 0 is missing or moved: number 1 stands in its place"),
    ],
)
def test_deleted_repeated_and_reordered_records_are_found(
    log_path: Path, order: list[int], bad: int, why: str
) -> None:
    lines = write(log_path)
    log_path.write_bytes(b"".join(lines[number] for number in order))
    report = verify_log(log_path)
    assert (report.bad_record, report.reason) == (bad, why)
    with pytest.raises(AuditError, match="is not sound"):
        AuditLog(log_path)


def test_a_forged_record_with_a_right_hash_breaks_the_chain_after_it(log_path: Path) -> None:
    lines = write(log_path)
    forged = {**json.loads(lines[2]), "event": "forged"}
    del forged["hash"]
    log_path.write_bytes(b"".join([*lines[:2], seal_record(to_canonical_json(forged))[0], *lines[3:]]))
    report = verify_log(log_path)
    assert (report.bad_record, report.reason) == (3, "record 3 does not follow the one before it")


@pytest.mark.parametrize("body", [b"[]", b"{}", b'{"sequence":true}', b'{"event":"decision"}', b"x" * 9])
def test_a_line_with_a_right_hash_that_is_no_record_is_found(log_path: Path, body: bytes) -> None:
    log_path.write_bytes(seal_record(body)[0])
    assert verify_log(log_path).bad_record == 0


@pytest.mark.parametrize(
    "spelt",
    [
        b'{"details":{"verdict":"ALLOW","verdict":"DENY"},"event":"decision",%b,"written":1.5}',
        b'{"details":{},"event":"note", %b,"written":1.5}',
        b'{"details":{"speed":1e0},"event":"note",%b,"written":1.5}',
        b'{"details":{"speed":NaN},"event":"note",%b,"written":1.5}',
        b'{"details":{"kind":"\\u0061"},"event":"note",%b,"written":1.5}',
        b'{"written":1.5,"details":{},"event":"note",%b}',
        b'{"details":{},"event":"note","extra":1,%b,"written":1.5}',
        b'{"details":{},"event":"note",%b}',
        b'{"details":{},"event":"note",%b,"written":"1.5"}',
        b'{"details":{"verdict":"MAYBE"},"event":"decision",%b,"written":1.5}',
        b'{"details":{},"event":"decision",%b,"written":1.5}',
    ],
)
def test_a_record_with_a_right_hash_has_one_spelling(log_path: Path, spelt: bytes) -> None:
    place = b'"previous":"' + GENESIS.encode() + b'","sequence":0'
    log_path.write_bytes(seal_record(spelt % place)[0])
    assert (verify_log(log_path).bad_record, verify_log(log_path).reason) == (0, "record 0 is not a record")
    log_path.write_bytes(seal_record(b'{"details":{},"event":"note",%b,"written":1.5}' % place)[0])
    assert verify_log(log_path).is_sound


def test_a_cut_tail_at_a_record_boundary_is_not_noticed(log_path: Path) -> None:
    # Stated by the module's docstring; it takes an anchor (test_audit_checkpoints).
    lines = write(log_path)
    log_path.write_bytes(b"".join(lines[:2]))
    assert verify_log(log_path).is_sound


def test_a_log_that_cannot_be_read_is_not_sound(log_path: Path) -> None:
    assert not verify_log(log_path).is_sound


def test_decisions_are_counted(log_path: Path) -> None:
    with AuditLog(log_path) as log:
        for verdict in (DecisionKind.ALLOW, DecisionKind.DENY, DecisionKind.ATTENUATE, DecisionKind.ALLOW):
            log.append("decision", {"verdict": verdict.value})
        log.append("note", {"verdict": "ALLOW"})
    assert verify_log(log_path).decisions == DecisionCounts(allowed=2, attenuated=1, denied=1)


def test_a_log_that_is_not_there_is_bad_from_its_first_record(log_path: Path) -> None:
    report = verify_log(log_path)
    why = "the log cannot be read: No such file or directory"
    assert report == AuditReport(0, GENESIS, 0, why, DecisionCounts())


def test_a_log_whose_medium_fails_is_bad_from_its_first_record(
    log_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(log_path)

    def fail(file: BinaryIO) -> Iterator[bytes]:
        raise LogReadError(5, "Input/output error")

    monkeypatch.setattr("aeros.runtime.audit.check._read_lines", fail)
    report = verify_log(log_path)
    assert (report.bad_record, report.reason) == (0, "the log cannot be read: Input/output error")


def test_the_first_record_follows_the_name_of_the_format() -> None:
    assert sha256(b"aeros/audit/1").hexdigest() == GENESIS


def test_an_empty_log_is_sound(log_path: Path) -> None:
    log_path.touch()
    report = verify_log(log_path)
    assert (report.is_sound, report.records, report.head, report.reason) == (True, 0, GENESIS, "")
    with log_path.open("rb") as file:
        assert read_prefix(file) == LogPrefix(0, GENESIS, GENESIS, 0, DecisionCounts())


def test_a_sealed_record_ends_with_the_hash_of_its_body() -> None:
    # echo -n '{"a":1}' | sha256sum
    expected = "015abd7f5cc57a2dd94b7590f04ad8084273905ee33ec5cebeae62276a97f862"
    assert seal_record(b'{"a":1}') == (b'{"a":1,"hash":"%s"}\n' % expected.encode(), expected)


def test_the_prefix_says_where_the_sound_records_end(log_path: Path) -> None:
    lines = write(log_path, 3)
    log_path.write_bytes(lines[0] + lines[1] + lines[2][:10])
    with log_path.open("rb") as file:
        file.read(7)
        prefix = read_prefix(file)
    first, second = (json.loads(line)["hash"] for line in lines[:2])
    assert (prefix.records, prefix.first, prefix.head) == (2, first, second)
    assert prefix.end == len(lines[0]) + len(lines[1])
    assert (prefix.problem, prefix.torn_tail) == ("record 2 is cut short", lines[2][:10])


def test_a_hole_in_the_last_record_is_half_written_and_one_before_it_an_edit(log_path: Path) -> None:
    lines = write(log_path, 3)
    torn = b"\0" * 40 + lines[2][40:]
    log_path.write_bytes(lines[0] + lines[1] + torn)
    with log_path.open("rb") as file:
        prefix = read_prefix(file)
    assert (prefix.problem, prefix.torn_tail) == ("record 2 is half written", torn)
    log_path.write_bytes(lines[0] + b"\0" * 40 + lines[1][40:] + lines[2])
    with log_path.open("rb") as file:
        prefix = read_prefix(file)
    assert (prefix.records, prefix.torn_tail) == (1, None)
    assert prefix.problem == "record 1 was edited: its hash does not match its content"


def test_a_caller_sees_each_sound_record_with_its_hash_and_may_reject_it(log_path: Path) -> None:
    lines = write(log_path, 3)
    hashes = [json.loads(line)["hash"] for line in lines]
    seen: list[tuple[int, str]] = []

    def reject_the_last(record: Record, own: str) -> str | None:
        seen.append((record["details"]["number"], own))
        return "number 2 is unlucky" if record["details"]["number"] == 2 else None

    report = verify_log(log_path, reject_the_last)
    assert seen == [(0, hashes[0]), (1, hashes[1]), (2, hashes[2])]
    assert (report.records, report.head) == (2, hashes[1])
    assert (report.bad_record, report.reason) == (2, "number 2 is unlucky")


def test_a_record_that_is_no_object_or_no_text_is_not_a_record(log_path: Path) -> None:
    for body in (b"17", b"null", b'"x"', b"\xff\xfe", b"[" * 5000 + b"]" * 5000):
        log_path.write_bytes(seal_record(body)[0])
        assert verify_log(log_path).bad_record == 0, body[:9]
