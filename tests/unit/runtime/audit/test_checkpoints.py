from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.check import GENESIS, verify_log
from aeros.runtime.audit.checkpoints import (
    CHECKPOINT_INTERVAL,
    AnchorError,
    AuditCheckpoint,
    CheckpointVerifier,
    SigningConfiguration,
    parse_checkpoint,
    verify_signed,
)
from aeros.runtime.audit.keys import (
    SigningKey,
    make_key,
    read_signing_key,
)
from aeros.runtime.audit.log import AuditError, AuditLog
from aeros.runtime.canonical_json import seal_record, to_canonical_json


@pytest.fixture(autouse=True)
def unsynced(monkeypatch: pytest.MonkeyPatch) -> None:
    """These are tests of what is written, not of when."""
    monkeypatch.setattr(os, "fdatasync", lambda file: None)
    monkeypatch.setattr(os, "fsync", lambda file: None)


@pytest.fixture
def key(tmp_path: Path) -> SigningKey:
    make_key(tmp_path / "key")
    return read_signing_key(tmp_path / "key")


@pytest.fixture
def stranger(tmp_path: Path) -> SigningKey:
    make_key(tmp_path / "stranger")
    return read_signing_key(tmp_path / "stranger")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "audit.jsonl"


@pytest.fixture
def anchor(tmp_path: Path) -> Path:
    return tmp_path / "anchor"


def write(log: Path, key: SigningKey, anchor: Path | None = None, count: int = 3) -> list[bytes]:
    with AuditLog(log, signing=SigningConfiguration(key, () if anchor is None else (anchor,))) as opened:
        for number in range(count):
            opened.append("event", {"number": number})
    return log.read_bytes().splitlines(keepends=True)


def rehashed(records: list[dict[str, Any]]) -> bytes:
    """Rewrite these records as somebody without the key can: to a sound chain."""
    lines, previous = [], GENESIS
    for sequence, record in enumerate(records):
        body = {**record, "sequence": sequence, "previous": previous}
        body.pop("hash", None)
        line, previous = seal_record(to_canonical_json(body))
        lines.append(line)
    return b"".join(lines)


def events(log: Path) -> list[str]:
    return [json.loads(line)["event"] for line in log.read_bytes().splitlines()]


# What is written.


def test_a_log_is_signed_when_it_is_opened_every_so_often_and_when_it_is_closed(
    log: Path, key: SigningKey
) -> None:
    assert CHECKPOINT_INTERVAL == 64
    write(log, key, count=CHECKPOINT_INTERVAL + 5)
    found = events(log)
    assert found[:2] == ["log-began", "checkpoint"]
    assert [place for place, event in enumerate(found) if event == "checkpoint"] == [
        1,
        CHECKPOINT_INTERVAL + 2,
        CHECKPOINT_INTERVAL + 8,
    ]
    assert found.count("event") == CHECKPOINT_INTERVAL + 5
    report = verify_signed(log, key.public)
    assert (report.chain.is_sound, report.signed, report.closed) == (True, len(found), True)
    assert report.anchored == 0


def test_a_log_started_without_a_key_is_signed_from_its_first_record(log: Path, key: SigningKey) -> None:
    with AuditLog(log) as opened:
        for number in range(2 * CHECKPOINT_INTERVAL):
            opened.append("event", {"number": number})
    write(log, key, count=0)
    assert verify_signed(log, key.public).signed == 2 * CHECKPOINT_INTERVAL + 2


def test_two_logs_started_at_the_same_time_differ(log: Path, key: SigningKey, tmp_path: Path) -> None:
    other = tmp_path / "other.jsonl"
    for path in (log, other):
        AuditLog(path, clock=lambda: 1.5, signing=SigningConfiguration(key)).close()
    assert log.read_bytes() != other.read_bytes()


def test_the_anchor_is_the_newest_checkpoint(log: Path, key: SigningKey, anchor: Path) -> None:
    lines = write(log, key, anchor)
    assert json.loads(anchor.read_bytes()) == json.loads(lines[-1])["details"]
    report = verify_signed(log, key.public, anchor)
    assert (report.chain.reason, report.anchored) == ("", len(lines))


def test_the_log_is_durable_before_its_anchor_names_it(
    log: Path, key: SigningKey, anchor: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    replace = Path.replace
    monkeypatch.setattr(os, "fdatasync", lambda file: done.append("log synced"))

    def spy(path: Path, target: Path) -> Path:
        done.append("anchored")
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", spy)
    AuditLog(log, signing=SigningConfiguration(key, () if anchor is None else (anchor,))).close()
    assert done == ["log synced", "log synced", "anchored", "log synced", "anchored"]


def test_an_anchor_that_cannot_be_written_is_an_audit_error(
    log: Path, key: SigningKey, tmp_path: Path
) -> None:
    with pytest.raises(AuditError, match=r"its anchor .* cannot be written"):
        AuditLog(log, signing=SigningConfiguration(key, (tmp_path / "absent" / "anchor",)))
    opened = AuditLog(log, signing=SigningConfiguration(key, (tmp_path / "anchor",)))
    (tmp_path / "anchor.new").mkdir()
    for number in range(CHECKPOINT_INTERVAL - 1):
        opened.append("event", {"number": number})
    with pytest.raises(AuditError, match=r"its anchor .* cannot be written"):
        opened.append("event", {})
    with pytest.raises(AuditError, match=r"its anchor .* cannot be written"):
        opened.append("event", {})
    opened.close()


def test_a_crash_is_mended_in_a_signed_log(log: Path, key: SigningKey, anchor: Path) -> None:
    opened = AuditLog(log, signing=SigningConfiguration(key, () if anchor is None else (anchor,)))
    for number in range(CHECKPOINT_INTERVAL - 1):
        opened.append("event", {"number": number})
    os.close(opened._file)  # as a kill would
    with log.open("ab") as file:
        file.write(b'{"torn')
    assert (
        verify_signed(log, key.public, anchor).chain.reason
        == f"record {CHECKPOINT_INTERVAL + 1} is cut short"
    )
    write(log, key, anchor, count=CHECKPOINT_INTERVAL)
    assert events(log)[CHECKPOINT_INTERVAL + 1 : CHECKPOINT_INTERVAL + 3] == ["tail-mended", "checkpoint"]
    assert verify_signed(log, key.public, anchor).chain.is_sound


def test_the_signature_covers_every_field_and_the_format() -> None:
    checkpoint = AuditCheckpoint("1" * 64, 3, "2" * 64, 1.5, True, "3" * 64, "4" * 128)
    assert checkpoint.signed_bytes() == (
        b'{"closing":true,"format":"aeros/audit-checkpoint/1","head":"%b","key":"%b","log":"%b",'
        b'"sequence":3,"signature":"","time":1.5}' % (b"2" * 64, b"3" * 64, b"1" * 64)
    )
    assert parse_checkpoint(checkpoint.details()) == checkpoint
    for name, odd in {"log": 1, "sequence": 3.0, "time": "1.5", "closing": 1, "key": None}.items():
        assert parse_checkpoint({**checkpoint.details(), name: odd}) is None, name
    assert parse_checkpoint({**checkpoint.details(), "more": 1}) is None
    assert parse_checkpoint({**checkpoint.details(), "time": 1}) is not None


# What is noticed.


def test_a_cut_tail_is_noticed_by_the_anchor_alone(log: Path, key: SigningKey, anchor: Path) -> None:
    lines = write(log, key, anchor)
    log.write_bytes(b"".join(lines[:2]))
    assert verify_log(log).is_sound
    by_key = verify_signed(log, key.public)
    assert (by_key.chain.is_sound, by_key.closed) == (True, False)
    by_anchor = verify_signed(log, key.public, anchor).chain
    assert (by_anchor.bad_record, by_anchor.reason) == (
        2,
        "the log was cut: it ends before record 5, which the anchor holds",
    )
    log.write_bytes(b"".join(lines[:5]))
    report = verify_signed(log, key.public, anchor)
    assert (report.chain.bad_record, report.anchored, report.signed) == (5, 0, 2)
    log.write_bytes(b"")
    assert verify_signed(log, key.public, anchor).chain.reason == (
        "the log is empty, but the anchor is of a log with records; each log has its own anchor"
    )


def test_a_rewrite_of_the_whole_is_noticed_by_the_key(log: Path, key: SigningKey) -> None:
    records = [json.loads(line) for line in write(log, key)]
    records[3]["details"] = {"number": 7}
    log.write_bytes(rehashed(records))
    assert verify_log(log).is_sound
    found = verify_signed(log, key.public).chain
    assert found.bad_record == 5
    assert found.reason == "the checkpoint in record 5 was signed for other records than those before it"


def test_a_rewrite_with_another_key_is_noticed(log: Path, key: SigningKey, stranger: SigningKey) -> None:
    write(log, stranger)
    assert (
        verify_signed(log, key.public).chain.reason
        == "the checkpoint in record 1 is not signed with this key"
    )


def test_a_log_without_checkpoints_is_not_signed(log: Path, key: SigningKey) -> None:
    for count in (0, 2):
        with AuditLog(log) as opened:
            for number in range(count):
                opened.append("event", {"number": number})
        found = verify_signed(log, key.public).chain
        assert (found.bad_record, found.reason) == (count, "no checkpoint of this key is in the log")


def test_an_end_that_should_hold_checkpoints_and_does_not_is_noticed(log: Path, key: SigningKey) -> None:
    records = [json.loads(line) for line in write(log, key, count=2 * CHECKPOINT_INTERVAL)]
    kept = [record for record in records if record["event"] != "checkpoint" or record["sequence"] == 1]
    log.write_bytes(rehashed(kept[: CHECKPOINT_INTERVAL + 2]))
    assert verify_signed(log, key.public).signed == 2
    log.write_bytes(rehashed(kept[: CHECKPOINT_INTERVAL + 3]))
    found = verify_signed(log, key.public).chain
    assert found.reason == (
        f"record {CHECKPOINT_INTERVAL + 2} should be a checkpoint: "
        f"{CHECKPOINT_INTERVAL} records before it are not signed"
    )


def test_another_log_of_the_same_key_is_noticed_by_the_anchor(
    log: Path, key: SigningKey, anchor: Path, tmp_path: Path
) -> None:
    write(log, key, anchor)
    write(tmp_path / "other", key)
    assert verify_signed(tmp_path / "other", key.public).chain.is_sound
    found = verify_signed(tmp_path / "other", key.public, anchor).chain
    assert found.reason == "the anchor is of another log, or this one was rewritten from its first record"


def test_the_holder_of_the_key_cannot_rewrite_anchored_records(
    log: Path, key: SigningKey, anchor: Path
) -> None:
    before = write(log, key, anchor, count=0)
    log.write_bytes(b"".join(before[:2]))
    for number in range(2):
        write(log, key, count=number)
    assert verify_signed(log, key.public).chain.is_sound
    found = verify_signed(log, key.public, anchor).chain
    assert found.reason == "record 2 is not the checkpoint that the anchor holds: the log was rewritten"


def test_a_forged_checkpoint_is_noticed_field_by_field(log: Path, key: SigningKey) -> None:
    lines = write(log, key)
    last = json.loads(lines[-1])
    changes: dict[str, Any] = {
        "log": "0" * 64,
        "sequence": 4,
        "head": "0" * 64,
        "time": 1.5,
        "closing": False,
        "key": "0" * 64,
        "signature": last["details"]["signature"].upper(),
    }
    assert changes.keys() == last["details"].keys()
    for name, value in changes.items():
        forged = {**last, "details": {**last["details"], name: value}}
        log.write_bytes(rehashed([*map(json.loads, lines[:-1]), forged]))
        assert verify_signed(log, key.public).chain.bad_record == 5, name
    for forged in ({**last, "written": 1.5}, {**last, "details": {}}):
        log.write_bytes(rehashed([*map(json.loads, lines[:-1]), forged]))
        assert verify_signed(log, key.public).chain.bad_record == 5


def test_a_note_of_what_the_anchor_holds_is_not_its_checkpoint(
    log: Path, key: SigningKey, anchor: Path
) -> None:
    *before, last = (json.loads(line) for line in write(log, key, anchor))
    log.write_bytes(rehashed([*before, {**last, "event": "note"}]))
    assert verify_signed(log, key.public).chain.is_sound
    found = verify_signed(log, key.public, anchor).chain
    assert found.reason == "record 5 is not the checkpoint that the anchor holds: the log was rewritten"


def test_nothing_is_signed_before_the_first_record(key: SigningKey) -> None:
    verifier = CheckpointVerifier(key.public)
    assert (verifier.log, verifier.signed, verifier.closed) == (None, 0, False)
    assert verifier.missing_tail(0) is None


# Continuing hides nothing.


def test_a_log_that_was_cut_is_not_continued_over_its_anchor(
    log: Path, key: SigningKey, anchor: Path
) -> None:
    lines = write(log, key, anchor)
    before = anchor.read_bytes()
    for kept, why in ((2, "the log was cut"), (0, "each log has its own anchor")):
        log.write_bytes(b"".join(lines[:kept]))
        with pytest.raises(AuditError, match=why):
            AuditLog(log, signing=SigningConfiguration(key, () if anchor is None else (anchor,)))
        assert log.read_bytes() == b"".join(lines[:kept])
    assert anchor.read_bytes() == before


def test_a_log_of_another_key_is_not_continued(log: Path, key: SigningKey, stranger: SigningKey) -> None:
    write(log, stranger)
    with pytest.raises(AuditError, match="not signed with this key"):
        AuditLog(log, signing=SigningConfiguration(key))


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "is not an anchor"),
        (b"[1]", "is not an anchor"),
        (b"{}", "is not an anchor"),
        (b"\xff", "is not"),
    ],
)
def test_a_file_that_is_not_an_anchor_is_refused(
    content: bytes, why: str, log: Path, key: SigningKey, anchor: Path
) -> None:
    write(log, key)
    with pytest.raises(AnchorError, match="there is no anchor"):
        verify_signed(log, key.public, anchor)
    anchor.write_bytes(content)
    with pytest.raises(AnchorError, match=why):
        verify_signed(log, key.public, anchor)
    with pytest.raises(AuditError, match=f"^the audit log `{log}` cannot be continued: .*{why}"):
        AuditLog(log, signing=SigningConfiguration(key, () if anchor is None else (anchor,)))
    assert anchor.read_bytes() == content


def test_an_anchor_that_cannot_be_read_or_is_too_long_is_refused(
    log: Path, key: SigningKey, anchor: Path
) -> None:
    write(log, key, anchor)
    content = anchor.read_bytes().rstrip()
    anchor.write_bytes(b" " * (10_000 - len(content)) + content + b" more")
    assert verify_signed(log, key.public, anchor).chain.is_sound
    anchor.write_bytes(b" " * (10_001 - len(content)) + content)
    with pytest.raises(AnchorError, match=f"^`{anchor}` is not an anchor of an audit log$"):
        verify_signed(log, key.public, anchor)
    anchor.unlink()
    with pytest.raises(AnchorError, match=f"^there is no anchor at `{anchor}`$"):
        verify_signed(log, key.public, anchor)
    anchor.mkdir()
    with pytest.raises(
        AnchorError, match=f"^the anchor `{anchor}` cannot be read: it is not a regular file$"
    ):
        verify_signed(log, key.public, anchor)


def test_an_anchor_without_our_signature_is_refused(log: Path, key: SigningKey, anchor: Path) -> None:
    write(log, key, anchor)
    anchor.write_bytes(to_canonical_json({**json.loads(anchor.read_bytes()), "sequence": 2}))
    with pytest.raises(AnchorError, match="is not signed with this key"):
        verify_signed(log, key.public, anchor)


# After a closing checkpoint nothing is added without the key.


@pytest.mark.parametrize("count", [1, 2, 60, 70])
@pytest.mark.parametrize("event", ["note", "decision", "log-began", "event"])
@pytest.mark.parametrize("is_anchored", [False, True])
def test_records_forged_onto_a_closed_log_are_rejected(
    count: int, event: str, log: Path, key: SigningKey, anchor: Path, *, is_anchored: bool
) -> None:
    lines = write(log, key, anchor)
    forged = {"event": event, "details": {"verdict": "DENY"}, "written": 1.5}
    log.write_bytes(rehashed([*map(json.loads, lines), *[forged] * count]))
    assert "was added to a closed log" in verify_log(log).reason  # the key is not needed for that
    found = verify_signed(log, key.public, *([anchor] if is_anchored else [])).chain
    assert (found.bad_record, found.reason) == (
        len(lines),
        f"record {len(lines)} was added to a closed log by a writer without the key",
    )
    with pytest.raises(AuditError, match="was added to a closed log"):
        AuditLog(log, signing=SigningConfiguration(key, (anchor,)))


def test_a_record_forged_after_a_repair_note_is_rejected_too(log: Path, key: SigningKey) -> None:
    records = [json.loads(line) for line in write(log, key)]
    note = {"event": "tail-mended", "details": {"bytes": 1, "sha256": "0" * 64}, "written": 1.5}
    log.write_bytes(rehashed([*records, note]))
    report = verify_signed(log, key.public)
    assert (report.chain.is_sound, report.closed) == (True, False)
    log.write_bytes(rehashed([*records, note, {"event": "note", "details": {}, "written": 1.5}]))
    assert verify_signed(log, key.public).chain.bad_record == len(records) + 1


def test_a_writer_without_the_key_does_not_continue_a_signed_log(log: Path, key: SigningKey) -> None:
    lines = write(log, key)
    with pytest.raises(AuditError, match=r"sound: it is signed, and can be continued only with its key$"):
        AuditLog(log)
    assert log.read_bytes() == b"".join(lines)


def test_of_two_anchors_the_one_that_was_not_put_back_finds_the_earlier_log(
    log: Path, key: SigningKey, anchor: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    with AuditLog(log, signing=SigningConfiguration(key, (anchor, other))):
        pass
    earlier = log.read_bytes(), anchor.read_bytes()
    with AuditLog(log, signing=SigningConfiguration(key, (anchor, other))):
        pass
    assert anchor.read_bytes() == other.read_bytes()
    log.write_bytes(earlier[0])
    anchor.write_bytes(earlier[1])
    assert verify_signed(log, key.public, anchor).chain.is_sound
    for anchors in ((anchor, other), (other, anchor)):
        assert "the log was cut" in verify_signed(log, key.public, *anchors).chain.reason
    with pytest.raises(AuditError, match="the log was cut"):
        AuditLog(log, signing=SigningConfiguration(key, (anchor, other)))


def test_a_kill_between_two_anchors_leaves_a_log_that_both_accept(
    log: Path, key: SigningKey, anchor: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    with AuditLog(log, signing=SigningConfiguration(key, (anchor, other))):
        before = other.read_bytes()
    other.write_bytes(before)
    assert before != anchor.read_bytes()
    assert verify_signed(log, key.public, anchor, other).chain.is_sound
    write(log, key, anchor)
