"""Each change is in the audit record before it is made, signed, and can be read back from there."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.checkpoints import SigningConfiguration, verify_signed
from aeros.runtime.audit.keys import make_key, read_signing_key
from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.canonical_json import seal_record, to_canonical_json
from aeros.runtime.registry.change_log import (
    LOG,
    RecordedState,
    anchor_of,
    read_recorded_state,
    record_change,
    recorded_changes,
    recorded_configurations,
)
from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot
from aeros.spec.diagnostics.errors import UserError

TIDY = InstalledModule("tidy", "1.2.0", "d" * 64, ModuleState.ACTIVE)
BLOCK = OperatorBlock("no_welder", "it is being repaired", "welder", None, "weld")
OLD = RegistrySnapshot(4, "sites/a.yaml", {}, {})
LATER = RegistrySnapshot(7, "sites/a.yaml", {}, {})
NEW = RegistrySnapshot(5, "sites/b.yaml", {"tidy": TIDY}, {"no_welder": BLOCK})


def changes_in(log: Path) -> list[Any]:
    records = map(json.loads, log.read_text().splitlines())
    return [one for one in records if one["event"] not in ("log-began", "checkpoint")]


def test_a_change_is_recorded_whole_and_comes_back_as_it_was(tmp_path: Path) -> None:
    record_change(tmp_path, tmp_path / "no-key", OLD, NEW, "activate tidy", "c" * 64)
    assert verify_log(tmp_path / LOG).is_sound
    (record,) = changes_in(tmp_path / LOG)
    details = record["details"]
    assert record["event"] == "registry-change"
    assert (details["change"], details["from"], details["to"]) == ("activate tidy", 4, 5)
    assert details["by"].keys() == {"user", "host", "pid"}
    assert details["by"]["pid"] == os.getpid()
    assert recorded_configurations(tmp_path) == {"c" * 64: NEW}


def test_of_several_changes_to_one_configuration_the_newest_counts(tmp_path: Path) -> None:
    newer = RegistrySnapshot(7, NEW.site, NEW.modules, {})
    for old, new, digest in ((OLD, NEW, "c"), (NEW, OLD, "o"), (OLD, newer, "c")):
        record_change(tmp_path, tmp_path / "no-key", old, new, "x", digest)
    assert recorded_configurations(tmp_path) == {"c": newer, "o": OLD}


@pytest.mark.parametrize("is_there", [False, True])
def test_the_record_is_signed_with_a_key_that_is_there_or_made(tmp_path: Path, *, is_there: bool) -> None:
    if is_there:
        make_key(tmp_path / "key")
    record_change(tmp_path, tmp_path / "key", OLD, NEW, "x", "c")
    key = read_signing_key(tmp_path / "key")
    assert verify_signed(tmp_path / LOG, key.public).signed > 0
    assert recorded_configurations(tmp_path) == {"c": NEW}


def test_an_action_that_cannot_be_recorded_is_not_executed(tmp_path: Path) -> None:
    (tmp_path / LOG).mkdir()
    with pytest.raises(UserError, match="the change cannot be recorded"):
        record_change(tmp_path, tmp_path / "no-key", OLD, NEW, "x", "c")
    (tmp_path / "key").write_text("none")
    (tmp_path / "other").mkdir()
    with pytest.raises(UserError) as refused:
        record_change(tmp_path / "other", tmp_path / "key", OLD, NEW, "x", "c")
    assert [one.code for one in refused.value.diagnostics] == ["AE965"]
    assert not (tmp_path / "other" / LOG).exists()


def test_records_of_another_form_and_after_a_break_are_passed_over(tmp_path: Path) -> None:
    record_change(tmp_path, tmp_path / "no-key", OLD, NEW, "x", "c")
    signing = SigningConfiguration(read_signing_key(tmp_path / "no-key"))
    with AuditLog(tmp_path / LOG, signing=signing) as log:
        log.append("registry-change", {"configuration": "other"})
        log.append("note", {"configuration": "c"})
    record_change(tmp_path, tmp_path / "no-key", NEW, OLD, "x", "o")
    assert recorded_configurations(tmp_path) == {"c": NEW, "o": OLD}
    lines = (tmp_path / LOG).read_text().splitlines(keepends=True)
    (tmp_path / LOG).write_text("".join([*lines[:-2], lines[-2].replace("sites/a", "sites/z"), lines[-1]]))
    assert recorded_configurations(tmp_path) == {"c": NEW}


def test_where_nothing_was_ever_changed_nothing_is_adopted(tmp_path: Path) -> None:
    assert recorded_configurations(tmp_path) == {}


def test_a_user_without_a_name_is_a_number(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def nameless() -> str:
        raise KeyError("uid")

    monkeypatch.setattr("getpass.getuser", nameless)
    record_change(tmp_path, tmp_path / "no-key", OLD, NEW, "x", "c")
    (record,) = changes_in(tmp_path / LOG)
    assert record["details"]["by"]["user"] == str(os.getuid())


def test_the_recorded_state_is_that_of_the_latest_change(tmp_path: Path) -> None:
    folder, key = tmp_path / "registry", tmp_path / "key"
    folder.mkdir()
    assert read_recorded_state(folder, key) == RecordedState()
    record_change(folder, key, OLD, NEW, "x", "c")
    assert read_recorded_state(folder, key) == RecordedState(NEW)
    newer = RegistrySnapshot(6, NEW.site, {}, {}, is_policy_set=True, withdrawn=frozenset({"tidy"}))
    record_change(folder, key, NEW, newer, "x", "c")
    found = read_recorded_state(folder, key)
    assert found == RecordedState(newer, NEW)
    assert found.disagreement(newer) is None
    assert [found.is_unfinished(one) for one in (OLD, NEW, newer)] == [False, True, False]
    for one, text in ((NEW, "an older one"), (replace(newer, site=""), "differs"), (LATER, "are missing")):
        assert text in (found.disagreement(one) or "")
    # The public key suffices to read.
    key.unlink()
    assert read_recorded_state(folder, key) == found


def _cut(folder: Path, kept: int, more: bytes = b"") -> None:
    """Keep the records up to the latest change, and `kept` more."""
    lines = (folder / LOG).read_bytes().splitlines(keepends=True)
    latest = max(at for at, line in enumerate(lines) if b'"event":"registry-change",' in line)
    (folder / LOG).write_bytes(b"".join(lines[: latest + kept]) + more)


@pytest.mark.parametrize(("kept", "more"), [(0, b'{"details"'), (1, b""), (1, b'{"details":')])
def test_a_change_counts_only_once_a_closing_checkpoint_signs_it(
    tmp_path: Path, kept: int, more: bytes
) -> None:
    """The rest of the log was never written, as its writer was killed."""
    folder, key = tmp_path / "registry", tmp_path / "key"
    folder.mkdir()
    record_change(folder, key, OLD, NEW, "x", "c")
    anchor = anchor_of(folder).read_bytes()
    record_change(folder, key, NEW, OLD, "x", "c")
    _cut(folder, kept, more)
    anchor_of(folder).write_bytes(anchor)
    assert read_recorded_state(folder, key) == RecordedState(NEW)
    # The next writer signs what it finds, and does not make it count by that.
    record_change(folder, key, NEW, LATER, "x", "c")
    assert read_recorded_state(folder, key) == RecordedState(LATER, NEW)


def _append_hashed(log: Path, event: str, details: dict[str, Any]) -> None:
    """Append a record as somebody without the key can."""
    last = json.loads(log.read_text().splitlines()[-1])
    body = {"event": event, "details": details, "written": 1.5, "previous": last["hash"]}
    line, _ = seal_record(to_canonical_json({**body, "sequence": last["sequence"] + 1}))
    with log.open("ab") as file:
        file.write(line)


def test_a_change_that_somebody_without_the_key_appends_never_counts(tmp_path: Path) -> None:
    folder, key = tmp_path / "registry", tmp_path / "key"
    folder.mkdir()
    record_change(folder, key, OLD, NEW, "x", "c")
    (made,) = changes_in(folder / LOG)
    forged = {**made["details"], "from": 5, "to": 6, "blocks": {}}
    whole = (folder / LOG).read_bytes()
    _append_hashed(folder / LOG, "registry-change", forged)
    assert "without the key" in (read_recorded_state(folder, key).damage or "")
    # After a checkpoint that closes nothing it may stand, as after a kill, and never counts.
    (folder / LOG).write_bytes(whole)
    signing = SigningConfiguration(read_signing_key(key), (anchor_of(folder),))
    os.close(AuditLog(folder / LOG, signing=signing)._file)  # as a kill would
    _append_hashed(folder / LOG, "registry-change", forged)
    assert read_recorded_state(folder, key) == RecordedState(NEW)
    record_change(folder, key, NEW, LATER, "x", "c")
    assert read_recorded_state(folder, key) == RecordedState(LATER, NEW)


def test_an_unsigned_log_is_read_and_not_believed(tmp_path: Path) -> None:
    folder, key = tmp_path / "registry", tmp_path / "key"
    folder.mkdir()
    record_change(folder, key, OLD, NEW, "x", "c")
    (made,) = changes_in(folder / LOG)
    (folder / LOG).unlink()
    anchor_of(folder).unlink()
    with AuditLog(folder / LOG) as log:
        log.append("registry-change", made["details"])
        log.append("registry-change-made", {"to": 5})
    found = read_recorded_state(folder, key)
    assert (found.latest, found.is_signed) == (NEW, False)
    assert "is not signed" in (found.disagreement(NEW) or "")
    assert found.is_complete_for(NEW)
    # What `aeros repair` does.
    record_change(folder, key, NEW, replace(NEW, generation=6), "repair", "c")
    assert read_recorded_state(folder, key) == RecordedState(replace(NEW, generation=6), NEW)


def test_a_writer_that_died_before_it_anchored_a_new_log_leaves_no_damage(tmp_path: Path) -> None:
    folder, key = tmp_path / "registry", tmp_path / "key"
    folder.mkdir()
    make_key(key)
    signing = SigningConfiguration(read_signing_key(key), (anchor_of(folder),))
    os.close(AuditLog(folder / LOG, signing=signing)._file)  # as a kill would
    anchor_of(folder).unlink()
    assert read_recorded_state(folder, key) == RecordedState()
    record_change(folder, key, OLD, NEW, "x", "c")
    assert read_recorded_state(folder, key) == RecordedState(NEW)


def _forge_with_another_key(folder: Path, key: Path) -> None:
    (folder / LOG).unlink()
    anchor_of(folder).unlink()
    record_change(folder, key.with_name("stranger"), OLD, LATER, "x", "c")


def _lose_the_keys(folder: Path, key: Path) -> None:
    key.unlink()
    key.with_name("key.pub").unlink()


@pytest.mark.parametrize(
    ("damage", "text"),
    [
        (_forge_with_another_key, "is not signed with this key"),
        (_lose_the_keys, "is signed, and the key"),
        (lambda folder, key: key.write_text("none"), "as PEM; restore the key from a backup"),
        (lambda folder, key: shutil.rmtree(folder), "is the anchor of one"),
        (lambda folder, key: anchor_of(folder).write_text("none"), "is not an anchor"),
        (lambda folder, key: anchor_of(folder).unlink(), "its anchor `"),
        (lambda folder, key: _cut(folder, 0), "the log was cut"),
    ],
)
def test_a_log_that_does_not_fit_key_and_anchor_is_damaged(
    tmp_path: Path, damage: Callable[[Path, Path], object], text: str
) -> None:
    folder, key = tmp_path / "registry", tmp_path / "key"
    folder.mkdir()
    record_change(folder, key, OLD, NEW, "x", "c")
    damage(folder, key)
    found = read_recorded_state(folder, key)
    assert text in (found.damage or "")
    assert "damaged" in (found.disagreement(found.latest) or "")
    assert not found.is_complete_for(RegistrySnapshot())


def test_a_record_of_another_form_is_damage(tmp_path: Path) -> None:
    with AuditLog(tmp_path / LOG) as log:
        log.append("registry-change", {"configuration": "other"})
    found = read_recorded_state(tmp_path, tmp_path / "no-key")
    assert found.damage == "record 0 is not of the form of a change"


def test_every_change_is_listed_in_order(tmp_path: Path) -> None:
    for old, new, digest in ((OLD, NEW, "c"), (NEW, OLD, "o"), (OLD, NEW, "c")):
        record_change(tmp_path, tmp_path / "no-key", old, new, "x", digest)
    assert recorded_changes(tmp_path) == [("c", NEW), ("o", OLD), ("c", NEW)]
