"""The table of docs/audit.md is true: each row is carried out, and checked with the means of each column."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.check import CHECKPOINT, GENESIS, TAIL_REPAIRED, verify_log
from aeros.runtime.audit.checkpoints import (
    CHECKPOINT_INTERVAL,
    SigningConfiguration,
    verify_signed,
)
from aeros.runtime.audit.keys import SigningKey, make_key, read_signing_key
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.canonical_json import seal_record, to_canonical_json

_PAGE = Path(__file__).parents[4] / "docs" / "audit.md"
_COUNT = CHECKPOINT_INTERVAL + 5


class Case:
    """A signed log with two anchors, of which an attacker cannot write the second, and an earlier state."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.log, self.anchor, self.second = (folder / name for name in ("log", "anchor", "second"))
        make_key(folder / "key")
        self.key = read_signing_key(folder / "key")
        self.write(self.log, self.key, self.anchor, self.second)
        self.earlier = self.log.read_bytes(), self.anchor.read_bytes()
        self.write(self.log, self.key, self.anchor, self.second)

    def write(self, log: Path, key: SigningKey, *anchors: Path, verdict: str = "ALLOW") -> None:
        with AuditLog(log, signing=SigningConfiguration(key, anchors)) as opened:
            for number in range(_COUNT):
                opened.append("decision", {"verdict": verdict, "number": number})

    @property
    def lines(self) -> list[bytes]:
        return self.log.read_bytes().splitlines(keepends=True)

    def put(self, lines: list[bytes]) -> None:
        self.log.write_bytes(b"".join(lines))

    def rehash(self, records: list[dict[str, Any]]) -> None:
        """Write these records as somebody without the key can: numbered and hashed anew."""
        lines, previous = [], GENESIS
        for sequence, record in enumerate(records):
            body = {**record, "sequence": sequence, "previous": previous}
            body.pop("hash", None)
            line, previous = seal_record(to_canonical_json(body))
            lines.append(line)
        self.put(lines)

    def records(self) -> list[dict[str, Any]]:
        return [json.loads(line) for line in self.lines]

    def columns(self) -> tuple[bool, ...]:
        """True for each column of the table that finds the tampering."""
        key = self.key.public
        given = ((), (self.anchor,), (self.anchor, self.second))
        by_key = [not verify_signed(self.log, key, *anchors).chain.is_sound for anchors in given]
        return (not verify_log(self.log).is_sound, *by_key)


def _edit(case: Case) -> None:
    case.log.write_bytes(case.log.read_bytes().replace(b'"ALLOW"', b'"DENY!"', 1))


def _move(case: Case) -> None:
    lines = case.lines
    lines[5], lines[6] = lines[6], lines[5]
    case.put(lines)


def _cut_short(case: Case) -> None:
    case.log.write_bytes(case.log.read_bytes()[:-7])


def _edit_and_rehash(case: Case) -> None:
    records = case.records()
    records[5]["details"]["verdict"] = "DENY"
    case.rehash(records)


def _drop_checkpoints(case: Case) -> None:
    case.rehash([one for one in case.records() if one["event"] != CHECKPOINT])


def _sign_with_another_key(case: Case) -> None:
    case.log.unlink()
    make_key(case.folder / "stranger")
    case.write(case.log, read_signing_key(case.folder / "stranger"), verdict="DENY")


def _add(case: Case) -> None:
    forged = {"event": "decision", "details": {"verdict": "DENY"}, "written": 1.5}
    case.rehash([*case.records(), forged])


def _add_behind_a_forged_checkpoint(case: Case) -> None:
    forged = {**case.records()[-1]["details"], "closing": False}
    checkpoint = {"event": CHECKPOINT, "details": forged, "written": 1.5}
    case.rehash([*case.records(), checkpoint, {"event": "note", "details": {}, "written": 1.5}])


def _add_in_a_note_of_a_repair(case: Case) -> None:
    forged = {"decision": "it was allowed", "bytes": 3, "sha256": "0" * 64}
    case.rehash([*case.records(), {"event": TAIL_REPAIRED, "details": forged, "written": 1.5}])


def _cut_after_a_checkpoint(case: Case) -> None:
    places = [place for place, record in enumerate(case.records()) if record["event"] == CHECKPOINT]
    case.put(case.lines[: places[-2] + 1])


def _exchange(case: Case) -> None:
    case.write(case.folder / "other", case.key)
    shutil.copy(case.folder / "other", case.log)


def _put_back(case: Case) -> None:
    case.log.write_bytes(case.earlier[0])
    case.anchor.write_bytes(case.earlier[1])


def _rewrite_with_the_key(case: Case) -> None:
    case.log.unlink()
    case.write(case.log, case.key, verdict="DENY")


def _rewrite_with_the_key_and_anchor(case: Case) -> None:
    case.log.unlink()
    case.anchor.unlink()
    case.write(case.log, case.key, case.anchor, verdict="DENY")


def _edit_an_unsigned_end(case: Case) -> None:
    opened = AuditLog(case.log, signing=SigningConfiguration(case.key, (case.anchor, case.second)))
    opened.append("decision", {"verdict": "ALLOW", "number": -1})
    os.close(opened._file)  # as a kill would
    records = case.records()
    records[-1]["details"]["verdict"] = "DENY"
    case.rehash(records)


ROWS: dict[str, Callable[[Case], None]] = {
    "a byte edited": _edit,
    "a record deleted, repeated or moved": _move,
    "the last record cut short, as by a crash": _cut_short,
    "a record edited, and all hashes recomputed": _edit_and_rehash,
    "all checkpoints removed, and all hashes recomputed": _drop_checkpoints,
    "the whole log signed with another key": _sign_with_another_key,
    "records added to a closed log, one or many": _add,
    "text added to a closed log in the note of a repair": _add_in_a_note_of_a_repair,
    "records added to a closed log behind a forged checkpoint": _add_behind_a_forged_checkpoint,
    "a tail cut off right after a checkpoint": _cut_after_a_checkpoint,
    "another log of the same key put in its place": _exchange,
    "an earlier log and its anchor put back together": _put_back,
    "rewritten by somebody who has the private key": _rewrite_with_the_key,
    "rewritten with the private key, and the anchor too": _rewrite_with_the_key_and_anchor,
    "in a log that was not closed: records after the newest checkpoint edited": _edit_an_unsigned_end,
}


def _table() -> dict[str, tuple[bool, ...]]:
    page = _PAGE.read_text("utf-8")
    lines = page[page.index("| tampering |") :].split("\n\n")[0].splitlines()[2:]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    assert {cell for row in rows for cell in row[1:]} == {"found", "no"}
    return {row[0]: tuple(cell == "found" for cell in row[1:]) for row in rows}


def test_every_row_of_the_table_is_carried_out() -> None:
    assert list(_table()) == list(ROWS)


@pytest.mark.parametrize("row", ROWS)
def test_a_tampering_is_found_with_what_the_page_says(
    row: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("fdatasync", "fsync"):
        monkeypatch.setattr(os, name, lambda file: None)
    case = Case(tmp_path)
    assert case.columns() == (False, False, False, False)
    ROWS[row](case)
    assert case.columns() == _table()[row]
