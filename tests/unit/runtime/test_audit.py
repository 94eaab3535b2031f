from __future__ import annotations

import json
import os
from pathlib import Path
from random import Random

import pytest

from aeros.runtime.audit import AuditError, AuditLog, DecisionCounts, verify_log
from aeros.runtime.audit_check import end_record
from aeros.runtime.canonical import canonical
from aeros.runtime.decision import Verdict


@pytest.fixture
def log_path(tmp_path: Path) -> Path:
    return tmp_path / "audit.jsonl"


@pytest.fixture
def unsynced(monkeypatch: pytest.MonkeyPatch) -> None:
    """For tests of what is written rather than when: thousands of syncs take seconds."""
    monkeypatch.setattr(os, "fdatasync", lambda file: None)
    monkeypatch.setattr(os, "fsync", lambda file: None)


def write(path: Path, count: int = 5) -> list[bytes]:
    with AuditLog(path, clock=lambda: 1.5) as log:
        for number in range(count):
            assert log.append("event", {"number": number, "speed": 0.1}) == number
    return path.read_bytes().splitlines(keepends=True)


def test_a_log_is_one_sound_chain(log_path: Path) -> None:
    lines = write(log_path)
    report = verify_log(log_path)
    assert (report.sound, report.records, report.why) == (True, 5, "")
    records = [json.loads(line) for line in lines]
    assert [record["sequence"] for record in records] == [0, 1, 2, 3, 4]
    assert [record["previous"] for record in records[1:]] == [record["hash"] for record in records[:-1]]
    assert report.head == records[-1]["hash"]


def test_a_log_is_continued_where_it_ended(log_path: Path) -> None:
    write(log_path)
    with AuditLog(log_path) as log:
        assert log.append("event", {}) == 5
    assert verify_log(log_path).records == 6


def test_append_returns_only_after_fdatasync(log_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[bytes] = []
    real = os.fdatasync

    def spy(file: int) -> None:
        real(file)
        synced.append(log_path.read_bytes())

    with AuditLog(log_path) as log:
        monkeypatch.setattr(os, "fdatasync", spy)
        log.append("event", {"unique": "here"})
    assert len(synced) == 1
    assert b'"unique":"here"' in synced[0]


@pytest.mark.usefixtures("unsynced")
def test_a_crash_at_any_byte_of_the_last_record_is_mended_and_noted(log_path: Path) -> None:
    lines = write(log_path)
    sound = b"".join(lines[:-1])
    for kept in range(1, len(lines[-1])):
        log_path.write_bytes(sound + lines[-1][:kept])
        torn = verify_log(log_path)
        assert (torn.sound, torn.bad_record, torn.why) == (False, 4, "record 4 is cut short")
        with AuditLog(log_path) as log:
            assert log.append("event", {"after": "crash"}) == 5
        mended = [json.loads(line) for line in log_path.read_bytes().splitlines()]
        assert verify_log(log_path).records == len(mended) == 6
        assert mended[4]["event"] == "tail-mended"
        assert mended[4]["details"]["bytes"] == kept


@pytest.mark.usefixtures("unsynced")
def test_a_crash_while_mending_is_mended_too(log_path: Path) -> None:
    lines = write(log_path)
    sound, torn = b"".join(lines[:-1]), lines[-1][:-1] * 3
    log_path.write_bytes(sound + torn)
    AuditLog(log_path).close()
    note = log_path.read_bytes()[len(sound) :]
    for kept in range(len(note)):
        log_path.write_bytes(sound + note[:kept] + torn[kept:])
        with AuditLog(log_path) as log:
            log.append("event", {})
        assert verify_log(log_path).sound
        assert b"tail-mended" in log_path.read_bytes()


def test_a_last_record_with_a_hole_is_a_crash_and_an_earlier_one_is_not(log_path: Path) -> None:
    lines = write(log_path)
    log_path.write_bytes(b"".join(lines[:-1]) + b"\0" * 40 + lines[-1][40:])
    AuditLog(log_path).close()
    assert verify_log(log_path).records == 5
    log_path.write_bytes(lines[0] + b"\0" * 40 + b"".join(lines[1:])[40:])
    with pytest.raises(AuditError, match="record 1 was edited"):
        AuditLog(log_path)


def test_every_edited_byte_is_found(log_path: Path) -> None:
    content = b"".join(write(log_path))
    chance = Random(1)  # noqa: S311 - a test, the same every time
    for _ in range(500):
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
    assert (report.bad_record, report.why) == (bad, why)
    with pytest.raises(AuditError, match="is not sound"):
        AuditLog(log_path)


def test_a_forged_record_with_a_right_hash_breaks_the_chain_after_it(log_path: Path) -> None:
    lines = write(log_path)
    forged = {**json.loads(lines[2]), "event": "forged"}
    del forged["hash"]
    log_path.write_bytes(b"".join([*lines[:2], end_record(canonical(forged))[0], *lines[3:]]))
    report = verify_log(log_path)
    assert (report.bad_record, report.why) == (3, "record 3 does not follow the one before it")


@pytest.mark.parametrize("body", [b"[]", b"{}", b'{"sequence":true}', b'{"event":"decision"}', b"x" * 9])
def test_a_line_with_a_right_hash_that_is_no_record_is_found(log_path: Path, body: bytes) -> None:
    log_path.write_bytes(end_record(body)[0])
    assert verify_log(log_path).bad_record == 0


def test_a_cut_tail_at_a_record_boundary_is_not_noticed(log_path: Path) -> None:
    # Stated by the module's docstring; signed checkpoints are to close it.
    lines = write(log_path)
    log_path.write_bytes(b"".join(lines[:2]))
    assert verify_log(log_path).sound


def test_a_log_that_cannot_be_read_is_not_sound(log_path: Path) -> None:
    assert not verify_log(log_path).sound


def test_only_one_writer_at_a_time(log_path: Path) -> None:
    with AuditLog(log_path), pytest.raises(AuditError, match="another process writes"):
        AuditLog(log_path)
    AuditLog(log_path).close()


def test_after_a_failed_write_nothing_more_is_written(
    log_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(file: int) -> None:
        raise OSError(28, "No space left on device")

    log = AuditLog(log_path)
    with monkeypatch.context() as patch:
        patch.setattr(os, "fdatasync", full)
        with pytest.raises(AuditError, match="No space left"):
            log.append("event", {})
    with pytest.raises(AuditError, match="No space left"):
        log.append("event", {})
    log.close()
    with pytest.raises(AuditError, match="it is closed"):
        log.append("event", {})


def test_an_interrupted_write_is_never_written_over(log_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(file: int) -> None:
        raise KeyboardInterrupt

    log = AuditLog(log_path)
    with monkeypatch.context() as patch:
        patch.setattr(os, "fdatasync", interrupted)
        with pytest.raises(KeyboardInterrupt):
            log.append("event", {})
    with pytest.raises(AuditError, match="an earlier record was not written"):
        log.append("event", {})
    log.close()


def test_short_writes_are_continued(log_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.pwrite
    monkeypatch.setattr(os, "pwrite", lambda file, data, at: real(file, data[:7], at))
    write(log_path)
    assert verify_log(log_path).records == 5


def test_a_folder_that_is_not_there_is_an_audit_error(tmp_path: Path) -> None:
    with pytest.raises(AuditError, match="cannot be opened"):
        AuditLog(tmp_path / "absent" / "audit.jsonl")


def test_decisions_are_counted(log_path: Path) -> None:
    with AuditLog(log_path) as log:
        for verdict in (Verdict.ALLOW, Verdict.DENY, Verdict.ATTENUATE, Verdict.ALLOW):
            log.append("decision", {"verdict": verdict.value})
        log.append("note", {"verdict": "ALLOW"})
    assert verify_log(log_path).decisions == DecisionCounts(allowed=2, attenuated=1, denied=1)
