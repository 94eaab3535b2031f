from __future__ import annotations

import json
import os
from collections.abc import Callable
from hashlib import sha256
from math import nan
from pathlib import Path

import pytest

from aeros.runtime.audit import log as module
from aeros.runtime.audit.check import GENESIS
from aeros.runtime.audit.checkpoints import SigningConfiguration
from aeros.runtime.audit.keys import make_key, read_signing_key
from aeros.runtime.audit.log import SYNC_BATCH, AuditError, AuditLog, DecisionCounts, verify_log
from aeros.runtime.canonical_json import MAX_SIZE, encode_with_size
from aeros.runtime.ports import LogHead
from aeros.spec.model.policy import Durability


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
    assert (report.is_sound, report.records, report.reason) == (True, 5, "")
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
        assert (torn.is_sound, torn.bad_record, torn.reason) == (False, 4, "record 4 is cut short")
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
        assert verify_log(log_path).is_sound
        assert b"tail-mended" in log_path.read_bytes()


def test_a_last_record_with_a_hole_is_a_crash_and_an_earlier_one_is_not(log_path: Path) -> None:
    lines = write(log_path)
    log_path.write_bytes(b"".join(lines[:-1]) + b"\0" * 40 + lines[-1][40:])
    AuditLog(log_path).close()
    assert verify_log(log_path).records == 5
    log_path.write_bytes(lines[0] + b"\0" * 40 + b"".join(lines[1:])[40:])
    with pytest.raises(AuditError, match="record 1 was edited"):
        AuditLog(log_path)


def test_a_record_of_values_too_large_or_too_deep_is_sound_too(log_path: Path) -> None:
    deep: list[object] = [nan]
    for _ in range(40):
        deep = [deep]
    with AuditLog(log_path) as log:
        log.append("event", {"deep": deep, "many": [nan] * (MAX_SIZE // 3), "long": "x" * MAX_SIZE})
    assert verify_log(log_path).is_sound


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
    with pytest.raises(AuditError, match=r"written: an earlier record was not written$"):
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


# What the site chooses: when records are durable.

RECORDS = [
    ("step-began", {}),
    ("decision", {"verdict": "DENY"}),
    ("decision", {"verdict": "ALLOW"}),
    ("note", {"verdict": "ALLOW"}),
    ("decision", {"verdict": "ATTENUATE"}),
    ("step-ended", {}),
]


def synced_after(log: AuditLog, monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """After which of `RECORDS`, and finally after closing, all is synced."""
    synced: list[int] = []
    after = []
    monkeypatch.setattr(os, "fdatasync", lambda file: synced.append(os.fstat(file).st_size))
    for event, details in RECORDS:
        log.append(event, details)
        after.append(bool(synced) and synced[-1] == log.path.stat().st_size)
    log.close()
    return [*after, synced[-1] == log.path.stat().st_size]


@pytest.mark.parametrize(
    ("durability", "expected"),
    [
        (Durability.EVERY_RECORD, [True] * 7),
        (Durability.BEFORE_MOTION, [False, False, True, False, True, False, True]),
        (Durability.BATCHED, [False] * 6 + [True]),
    ],
)
def test_a_record_is_durable_when_the_site_says(
    log_path: Path, durability: Durability, expected: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert synced_after(AuditLog(log_path, durability=durability), monkeypatch) == expected
    assert verify_log(log_path).records == len(RECORDS)


def test_a_batch_is_synced_when_it_is_full(log_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    with AuditLog(log_path, durability=Durability.BATCHED) as log:
        monkeypatch.setattr(os, "fdatasync", synced.append)
        counts = []
        for _ in range(2 * SYNC_BATCH):
            log.append("event", {})
            counts.append(len(synced))
        log.append("event", {})
    assert SYNC_BATCH == 64
    assert counts == [0] * (SYNC_BATCH - 1) + [1] * SYNC_BATCH + [2]
    assert len(synced) == 3  # on closing
    report = verify_log(log_path)
    assert (report.is_sound, report.records) == (True, 2 * SYNC_BATCH + 1)


@pytest.mark.parametrize("durability", [Durability.BEFORE_MOTION, Durability.BATCHED])
def test_a_failing_sync_is_an_audit_error_in_every_mode(
    log_path: Path, durability: Durability, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(file: int) -> None:
        raise OSError(5, "Input/output error")

    log = AuditLog(log_path, durability=durability)
    log.append("note", {})
    monkeypatch.setattr(os, "fdatasync", broken)
    if durability is Durability.BEFORE_MOTION:
        with pytest.raises(AuditError, match="Input/output error"):
            log.append("decision", {"verdict": "ALLOW"})
    else:
        with pytest.raises(AuditError, match="Input/output error"):
            log.close()
    log.close()


# What is in a record, and what its writer says.


def test_records_have_the_fields_of_their_writer(log_path: Path) -> None:
    times = iter((1.5, 2, 3.25))
    lines: list[bytes] = []
    with AuditLog(log_path, clock=lambda: next(times), listener=lines.append) as log:
        assert log.head == LogHead(0, GENESIS)
        log.append("event", {"b": 1, "a": nan})
        log.append("étrange", encode_with_size({"b": 1, "a": nan}))
        log.append("decision", {"verdict": "DENY", "state": encode_with_size({"x": 0.5})})
        head = log.head
    assert log_path.read_bytes().splitlines(keepends=True) == lines
    records = [json.loads(line) for line in lines]
    own = [record.pop("hash") for record in records]
    assert head == LogHead(3, own[-1])
    assert records == [
        {
            "sequence": number,
            "previous": previous,
            "written": written,
            "event": event,
            "details": details,
        }
        for number, (previous, written, event, details) in enumerate(
            (
                (GENESIS, 1.5, "event", {"a": {"float": "nan"}, "b": 1}),
                (own[0], 2, "étrange", {"a": {"float": "nan"}, "b": 1}),
                (own[1], 3.25, "decision", {"verdict": "DENY", "state": {"x": 0.5}}),
            )
        )
    ]
    assert verify_log(log_path).decisions == DecisionCounts(denied=1)


def test_records_are_read_from_a_head_that_the_log_had(log_path: Path) -> None:
    with AuditLog(log_path) as log:
        heads = [log.head]
        for number in range(3):
            log.append("event", {"number": number})
            heads.append(log.head)
        for count, head in enumerate(heads):
            found = log.records_since(head)
            assert found is not None
            assert [one["details"]["number"] for one in found] == list(range(count, 3))
        assert log.records_since(LogHead(0, "0" * 64)) == log.records_since(heads[0])
        for unknown in (LogHead(2, heads[1].hash), LogHead(1, GENESIS), LogHead(4, heads[3].hash)):
            assert log.records_since(unknown) is None
        content = log_path.read_bytes()
        log_path.write_bytes(content.replace(b'"number":1', b'"number":7'))
        with pytest.raises(AuditError) as caught:
            log.records_since(heads[0])
        why = "record 1 was edited: its hash does not match its content"
        assert str(caught.value) == f"the audit log `{log_path}` is not sound: {why}"


def test_a_log_is_opened_for_its_owner_alone(log_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[tuple[Path, int, int]] = []
    original = os.open

    def spy(path: Path, flags: int, mode: int = 0o777) -> int:
        opened.append((path, flags, mode))
        return original(path, flags, mode)

    monkeypatch.setattr(os, "open", spy)
    before = os.umask(0)
    try:
        AuditLog(log_path).close()
    finally:
        os.umask(before)
    assert opened[0] == (log_path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    assert log_path.stat().st_mode & 0o777 == 0o600


def test_a_torn_line_is_replaced_by_a_note_of_its_length_and_hash(log_path: Path) -> None:
    lines = write(log_path, 2)
    torn = lines[1][:-5] + b"x" * 500
    log_path.write_bytes(lines[0] + torn)
    with AuditLog(log_path, durability=Durability.BATCHED) as log:
        assert log.head.records == 2
    (_, note) = (json.loads(line) for line in log_path.read_bytes().splitlines())
    assert note["event"] == "tail-mended"
    assert note["details"] == {"bytes": len(torn), "sha256": sha256(torn).hexdigest()}


def test_messages_of_a_writer_name_the_log_and_the_cause(
    log_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def message(work: Callable[[], object]) -> str:
        with pytest.raises(AuditError) as caught:
            work()
        return str(caught.value)

    absent = tmp_path / "absent" / "log"
    assert message(lambda: AuditLog(absent)) == (
        f"the audit log `{absent}` cannot be opened: [Errno 2] No such file or directory: '{absent}'"
    )
    log = AuditLog(log_path)
    assert message(lambda: AuditLog(log_path)) == f"another process writes the audit log `{log_path}`"

    def full(file: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fdatasync", full)
        refused = f"the audit log `{log_path}` cannot be written: [Errno 28] No space left on device"
        assert message(lambda: log.append("event", {})) == refused
    assert message(lambda: log.append("event", {})) == refused
    log.close()
    log.close()
    closed = f"the audit log `{log_path}` cannot be written: it is closed"
    assert message(lambda: log.append("event", {})) == closed

    def broken(file: object, watch: object) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("aeros.runtime.audit.log.read_prefix", broken)
    assert message(lambda: AuditLog(log_path)) == (
        f"the audit log `{log_path}` cannot be read: [Errno 5] Input/output error"
    )


def test_a_log_that_could_not_be_opened_is_free_for_others(log_path: Path) -> None:
    lines = write(log_path)
    log_path.write_bytes(b"".join(lines[1:]))
    with pytest.raises(AuditError, match="is not sound: record 0 is missing or moved"):
        AuditLog(log_path)
    log_path.write_bytes(b"".join(lines))
    AuditLog(log_path).close()


def test_a_signed_log_begins_with_a_random_number_and_signs_with_the_time_of_the_record(
    log_path: Path, tmp_path: Path
) -> None:
    make_key(tmp_path / "key")
    key = read_signing_key(tmp_path / "key")
    times = iter(range(1, 10))
    AuditLog(log_path, clock=lambda: next(times), signing=SigningConfiguration(key)).close()
    began, first, last = (json.loads(line) for line in log_path.read_bytes().splitlines())
    assert (began["event"], list(began["details"])) == ("log-began", ["nonce"])
    assert len(bytes.fromhex(began["details"]["nonce"])) == 16
    for place, record, closing in ((1, first, False), (2, last, True)):
        details = {**record["details"], "signature": ""}
        assert details == {
            "log": began["hash"],
            "sequence": place,
            "head": (began, first)[place - 1]["hash"],
            "time": record["written"],
            "closing": closing,
            "key": key.public.id,
            "signature": "",
        }
    assert [began["written"], first["written"], last["written"]] == [1, 2, 3]


@pytest.mark.parametrize(("event", "synced"), [("decision", True), ("note", False)])
def test_details_that_come_as_text_count_as_an_allowed_action(
    log_path: Path, event: str, synced: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    syncs: list[int] = []
    with AuditLog(log_path, durability=Durability.BEFORE_MOTION) as log:
        monkeypatch.setattr(os, "fdatasync", syncs.append)
        log.append(event, encode_with_size({"verdict": "DENY"}))
        assert bool(syncs) is synced


def test_all_that_the_module_exports_is_there(log_path: Path) -> None:
    module.AuditLog(log_path).close()
    assert {getattr(module, name).__name__ for name in module.__all__} == set(module.__all__)
