"""A remembered beginning of a log saves checks, and never hides a change of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aeros.runtime.audit import prefix_memory
from aeros.runtime.audit.check import LogPrefix, Record, read_prefix
from aeros.runtime.audit.checkpoints import (
    AuditCheckpoint,
    CheckpointVerifier,
    SigningConfiguration,
    read_anchor,
)
from aeros.runtime.audit.keys import make_key, read_signing_key
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.audit.prefix_memory import ResumableVerifier, read_remembered_prefix
from tests.hypothesis_profiles import examples

_CHANGES = 3


class _Counting(ResumableVerifier):
    """A verifier that counts the records that it is asked about."""

    asked = 0

    def __call__(self, record: Record, own: str) -> str | None:
        type(self).asked += 1
        return super().__call__(record, own)


class _Log:
    """A signed log in a folder, with its anchor."""

    def __init__(self, folder: Path) -> None:
        self.path, self.anchor = folder / "audit.jsonl", folder / "anchor"
        make_key(folder / "key")
        self.key = read_signing_key(folder / "key")

    def grow(self) -> None:
        with AuditLog(self.path, signing=SigningConfiguration(self.key, (self.anchor,))) as log:
            log.append("happened", {"number": 1})

    @property
    def anchors(self) -> tuple[AuditCheckpoint, ...]:
        found = read_anchor(self.anchor, self.key.public)
        assert found is not None
        return (found,)

    def remembered(self) -> LogPrefix:
        with self.path.open("rb") as file:
            return read_remembered_prefix(file, self.path, _Counting(self.key.public, self.anchors))

    def defined(self) -> LogPrefix:
        with self.path.open("rb") as file:
            return read_prefix(file, CheckpointVerifier(self.key.public, self.anchors))

    def asked(self) -> int:
        _Counting.asked = 0
        assert self.remembered() == self.defined()
        return _Counting.asked


@pytest.fixture
def log(tmp_path: Path) -> Iterator[_Log]:
    made = _Log(tmp_path)
    for _ in range(_CHANGES):
        made.grow()
    yield made
    prefix_memory._REMEMBERED.clear()


def test_only_new_records_are_checked(log: _Log) -> None:
    prefix_memory._REMEMBERED.clear()  # of which the writer has its part
    assert log.asked() == 1 + 3 * _CHANGES
    assert log.asked() == 0
    log.grow()
    assert log.asked() == 3


@examples(30)
@given(share=st.floats(0, 1, exclude_max=True), byte=st.integers(0, 255), grows=st.booleans())
def test_a_log_that_was_changed_anywhere_is_refused_as_without_memory(
    log: _Log, share: float, byte: int, grows: bool
) -> None:
    log.remembered()
    kept, anchor = log.path.read_bytes(), log.anchor.read_bytes()
    if grows:
        log.grow()
    content = bytearray(log.path.read_bytes())
    at = int(share * len(kept))
    is_changed = content[at] != byte
    content[at] = byte
    log.path.write_bytes(content)
    found = log.remembered()
    assert found == log.defined()
    assert (found.problem is not None) == is_changed
    log.path.write_bytes(kept)
    log.anchor.write_bytes(anchor)
    assert log.remembered().problem is None


def test_a_log_that_was_cut_is_read_to_its_end(log: _Log) -> None:
    before = log.path.read_bytes()
    log.remembered()
    log.path.write_bytes(before[: before.index(b"\n", len(before) // 2) + 1])
    assert log.remembered() == log.defined()
    assert log.remembered().records < before.count(b"\n")


def test_an_anchor_that_the_remembered_records_do_not_hold_is_noticed(log: _Log, tmp_path: Path) -> None:
    log.remembered()
    (tmp_path / "other").mkdir()
    other = _Log(tmp_path / "other")
    other.key = log.key
    other.grow()
    log.anchor.write_bytes(other.anchor.read_bytes())
    found = log.remembered()
    assert found == log.defined()
    assert found.problem is not None


def test_remembered_findings_stay_as_they_are_when_the_log_grows(log: _Log) -> None:
    log.remembered()
    log.grow()
    first = log.remembered()
    log.grow()
    assert log.remembered().records > first.records
    assert log.asked() == 0
