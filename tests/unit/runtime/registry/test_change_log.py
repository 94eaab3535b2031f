"""Each change is in the audit record before it is made, and can be read back from there."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.checkpoints import SigningConfiguration, verify_signed
from aeros.runtime.audit.keys import make_key, read_signing_key
from aeros.runtime.audit.log import AuditLog, verify_log
from aeros.runtime.registry.change_log import (
    LOG,
    read_recorded_state,
    record_change,
    record_made,
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


def test_what_cannot_be_recorded_is_not_done(tmp_path: Path) -> None:
    (tmp_path / LOG).mkdir()
    with pytest.raises(UserError, match="the change cannot be recorded, so it is not made"):
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
    key = tmp_path / "no-key"
    assert read_recorded_state(tmp_path).latest == RegistrySnapshot()
    record_change(tmp_path, key, OLD, NEW, "x", "c")
    unmarked = read_recorded_state(tmp_path)
    assert (unmarked.latest, unmarked.is_made, unmarked.before, unmarked.damage) == (NEW, False, None, None)
    assert record_made(tmp_path, key, NEW.generation) is None
    newer = RegistrySnapshot(6, NEW.site, {}, {}, is_policy_set=True, withdrawn=frozenset({"tidy"}))
    for _ in range(2):  # the first was killed
        record_change(tmp_path, key, NEW, newer, "x", "c")
    found = read_recorded_state(tmp_path)
    assert (found.latest, found.is_made, found.before) == (newer, False, NEW)
    assert found.disagreement(newer) is None
    assert found.disagreement(NEW) is None
    record_made(tmp_path, key, 6)
    assert "an older one" in (read_recorded_state(tmp_path).disagreement(NEW) or "")


def test_a_record_that_a_crash_cut_short_does_not_count(tmp_path: Path) -> None:
    key = tmp_path / "no-key"
    record_change(tmp_path, key, OLD, NEW, "x", "c")
    record_change(tmp_path, key, NEW, OLD, "x", "c")
    log = tmp_path / LOG
    lines = log.read_bytes().splitlines(keepends=True)
    last = max(
        at for at, line in enumerate(lines) if b'"event":"registry-change",' in line
    )  # signatures follow
    log.write_bytes(b"".join(lines[:last]) + lines[last][:-10])
    assert read_recorded_state(tmp_path).latest == NEW


def test_a_record_of_another_form_is_damage(tmp_path: Path) -> None:
    with AuditLog(tmp_path / LOG) as log:
        log.append("registry-change", {"configuration": "other"})
    damage = read_recorded_state(tmp_path).damage
    assert damage == "record 0 is not of the form of a change"
    assert "damaged" in (read_recorded_state(tmp_path).disagreement(RegistrySnapshot()) or "")


def test_every_change_is_listed_in_order(tmp_path: Path) -> None:
    for old, new, digest in ((OLD, NEW, "c"), (NEW, OLD, "o"), (OLD, NEW, "c")):
        record_change(tmp_path, tmp_path / "no-key", old, new, "x", digest)
    assert recorded_changes(tmp_path) == [("c", NEW), ("o", OLD), ("c", NEW)]
