"""The database is held against the record of changes: an older or edited one lifts nothing silently."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.runtime.audit import checkpoints
from aeros.runtime.audit.checkpoints import verify_signed
from aeros.runtime.audit.keys import make_key, read_signing_key
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.registry.change_log import LOG, anchor_of
from aeros.runtime.registry.control_page import ControlPage
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.runtime.registry.store import RegistryStore
from aeros.spec.diagnostics.errors import UserError
from tests.unit.runtime.registry.conftest import BASE
from tests.unit.runtime.registry.support.fixed_modules import FixedModules

BLOCK = OperatorBlock("worn", "a finger is worn", None, None, "grip")
LATER = OperatorBlock("wet", "wet floor", None, None, "wait")


@pytest.fixture(scope="module")
def template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """State folder in which `tidy` is active and a block in force, of which `older` knows nothing."""
    made = tmp_path_factory.mktemp("template") / "robot"
    registry = Registry(made)
    registry.set_policy(BASE / "site.yaml")
    registry.install(BASE / "tidy")
    shutil.copytree(registry.folder, made / "older")
    registry.configure("tidy")
    registry.activate("tidy")
    registry.add_block(BLOCK)
    return made


@pytest.fixture
def blocked(template: Path, tmp_path: Path) -> Registry:
    return Registry(shutil.copytree(template, tmp_path / "robot"))


def _database(registry: Registry) -> Path:
    return registry.folder / "registry.sqlite3"


def _put_back(registry: Registry) -> None:
    shutil.copy(registry.folder.parent / "older" / "registry.sqlite3", _database(registry))


def _edit(statement: str) -> Callable[[Registry], None]:
    def edit(registry: Registry) -> None:
        with closing(sqlite3.connect(_database(registry), isolation_level=None)) as database:
            database.execute(statement)

    return edit


def _cut_latest_change(registry: Registry) -> None:
    log = registry.folder / LOG
    lines = log.read_bytes().splitlines(keepends=True)
    latest = max(at for at, line in enumerate(lines) if b'"event":"registry-change",' in line)
    log.write_bytes(b"".join(lines[:latest]))


CONFIGURATION = cast(Configuration, SimpleNamespace(modules={}))


def _cut_with_anchor(registry: Registry) -> None:
    _cut_latest_change(registry)
    anchor_of(registry.folder).unlink()


Damage = tuple[Callable[[Registry], object], str]
"""Damage to a registry, and a part of the message that reports it."""


def _put_folder_back(registry: Registry) -> None:
    shutil.rmtree(registry.folder)
    shutil.copytree(registry.folder.parent / "older", registry.folder)


def _put_folder_back_without_anchor(registry: Registry) -> None:
    _put_folder_back(registry)
    anchor_of(registry.folder).unlink()


def _exchange_key(registry: Registry) -> None:
    key = registry.folder.parent / "audit.key"
    for path in (key, key.with_name("audit.key.pub")):
        path.unlink()
    make_key(key)


def _of_another_robot(registry: Registry) -> None:
    other = Registry(registry.folder.parent / "other")
    other.set_policy(BASE / "site.yaml")
    other.add_block(LATER)
    shutil.copy(_database(other), _database(registry))


def _with_journal(registry: Registry) -> None:
    """Put back the journal of a change that was under way, which SQLite then rolls back."""
    journal = _database(registry).with_name("registry.sqlite3-journal")
    with closing(sqlite3.connect(_database(registry), isolation_level=None)) as database:
        database.execute("PRAGMA cache_size = 1")
        database.execute("BEGIN")
        database.execute("DELETE FROM blocks")
        hot = journal.read_bytes()
        database.execute("COMMIT")
    journal.write_bytes(hot)


REPAIRABLE: dict[str, Damage] = {
    "an older database": (_put_back, "an older one"),
    "a deleted database": (lambda registry: _database(registry).unlink(), "an older one, or was lost"),
    "a lifted block": (_edit("DELETE FROM blocks"), "differs from the record"),
    "other contents": (_edit("UPDATE modules SET digest = '000'"), "and not in `modules/000/"),
    "a folder elsewhere": (_edit("UPDATE modules SET folder = '/elsewhere/tidy'"), "`/elsewhere/tidy`"),
    "a module made active": (_edit("UPDATE modules SET version = '9'"), "differs from the record"),
    "an empty database": (lambda registry: _database(registry).write_bytes(b""), "an older one, or was lost"),
    "a database cut short": (lambda registry: os.truncate(_database(registry), 6000), "cannot be used"),
    "a database of another robot": (_of_another_robot, "an older one"),
    "no database": (lambda registry: _database(registry).write_bytes(b"x" * 4096), "cannot be used"),
}
UNREPAIRABLE: dict[str, Damage] = {
    "a record cut short": (_cut_latest_change, "the log was cut"),
    "a record cut short, and the anchor gone": (_cut_with_anchor, "nothing shows that no record was cut off"),
    "an older folder, and the anchor gone": (_put_folder_back_without_anchor, "nothing shows that no record"),
    "a deleted anchor": (
        lambda registry: anchor_of(registry.folder).unlink(),
        "nothing shows that no record",
    ),
    "another key": (_exchange_key, "is not signed with this key"),
    "a deleted record": (lambda registry: (registry.folder / LOG).unlink(), "is the anchor of one"),
    "a deleted folder": (lambda registry: shutil.rmtree(registry.folder), "is the anchor of one"),
    "an older folder": (_put_folder_back, "the log was cut"),
    "an edited record": (
        lambda registry: (registry.folder / LOG).write_bytes(
            (registry.folder / LOG).read_bytes().replace(b"finger", b"singer")
        ),
        "its record of changes is damaged",
    ),
}


def _refusals(registry: Registry) -> list[str]:
    """The refusals of everything that reads the registry: a run of any kind, and each change."""
    configuration = FixedModules(CONFIGURATION)
    found = []
    for read in (
        registry.snapshot,
        registry.configuration,
        lambda: RegistryGovernor(registry),
        lambda: RegistryGovernor(registry, configuration),
        lambda: registry.add_block(LATER),
        lambda: registry.deactivate("tidy"),
    ):
        with pytest.raises(UserError) as refused:
            read()
        (one,) = refused.value.diagnostics
        assert one.code == "AE965"
        found.append(f"{one.headline}; {' '.join(one.help)}")
    return found


@pytest.mark.parametrize("damage", REPAIRABLE)
def test_the_last_recorded_change_is_put_in_force_again(blocked: Registry, damage: str) -> None:
    before = blocked.snapshot()
    change, message = REPAIRABLE[damage]
    change(blocked)
    for refusal in _refusals(blocked):
        assert message in refusal
        assert "`aeros repair`" in refusal
    repaired = blocked.repair()
    assert repaired is not None
    assert repaired.generation == before.generation + 1
    assert (repaired.blocks, repaired.modules) == ({"worn": BLOCK}, before.modules)
    assert [one.id for one in blocked.configuration()[0].site.blocks] == ["worn"]
    blocked.deactivate("tidy")
    assert blocked.repair() is None


@pytest.mark.parametrize("damage", UNREPAIRABLE)
def test_a_record_that_lost_changes_is_not_believed(blocked: Registry, damage: str) -> None:
    change, message = UNREPAIRABLE[damage]
    change(blocked)
    for refusal in _refusals(blocked):
        assert message in refusal
        assert "restore the newest copy of" in refusal
    with pytest.raises(UserError, match=message):
        blocked.repair()


def test_a_registry_put_back_with_its_anchor_is_not_noticed(tmp_path: Path) -> None:
    """Nothing on the disk is newer then; `docs/threat-model.md` says so."""
    registry = Registry(tmp_path / "robot")
    registry.set_policy(BASE / "site.yaml")
    shutil.copytree(tmp_path / "robot", tmp_path / "backup")
    registry.add_block(BLOCK)
    shutil.rmtree(tmp_path / "robot")
    (tmp_path / "backup").rename(tmp_path / "robot")
    assert Registry(tmp_path / "robot").snapshot().blocks == {}


def test_where_there_is_no_registry_nothing_is_repaired(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="there is none"):
        Registry(tmp_path / "none").repair()
    assert not (tmp_path / "none").exists()


class _Killed(BaseException):
    """The process ended there."""


def _steps_of(change: Callable[[], object], monkeypatch: pytest.MonkeyPatch, killed_at: int | None) -> int:
    """Count the writes to files that a change makes; kill it before the one of number `killed_at`."""
    done = 0
    with monkeypatch.context() as patched:
        for place, name in WRITES:
            original = getattr(place, name)

            def step(*given: Any, original: Any = original, **named: Any) -> object:
                nonlocal done
                if killed_at is not None and done >= killed_at:  # nothing more is written, by no clean-up
                    raise _Killed
                done += 1
                return original(*given, **named)

            patched.setattr(place, name, step)
        with suppress(_Killed):
            change()
    return done


WRITES = (
    (os, "pwrite"),
    (os, "fdatasync"),
    (checkpoints, "replace_durably"),
    (ControlPage, "publish"),
    (RegistryStore, "replace"),
    (ControlPage, "wait_until_idle"),
)


def test_a_change_that_is_killed_anywhere_is_made_whole_or_not_at_all(
    blocked: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once its record is signed it is made, though its process is killed, or an older database put back."""
    shutil.copytree(blocked.folder.parent, saved := blocked.folder.parent.with_name("saved"))
    before = blocked.snapshot()
    count = _steps_of(lambda: blocked.remove_block("worn"), monkeypatch, None)
    after = blocked.snapshot()
    assert (list(before.blocks), list(after.blocks)) == (["worn"], [])
    outcomes = []
    for place in range(count + 1):
        shutil.rmtree(blocked.folder.parent)
        shutil.copytree(saved, blocked.folder.parent)
        _steps_of(lambda: blocked.remove_block("worn"), monkeypatch, place)
        with RegistryGovernor(blocked, FixedModules(CONFIGURATION)) as governor:
            assert governor.configuration()[0] == blocked.snapshot().generation
        found = blocked.snapshot()
        assert found in (before, after)
        outcomes.append(found == after)
        assert blocked.repair() is None
        # The database of before the change is as good as the latest: the record decides.
        shutil.copy(saved / "registry" / "registry.sqlite3", _database(blocked))
        assert blocked.snapshot() == found
        blocked.add_block(LATER)
        assert blocked.snapshot().blocks == {**found.blocks, "wet": LATER}
    assert outcomes == sorted(outcomes)
    assert set(outcomes) == {False, True}


def test_a_change_that_cannot_be_stored_lets_nothing_start_until_it_is(
    blocked: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(store: RegistryStore, *_: object) -> None:
        raise store._damaged("disk full")

    with RegistryGovernor(blocked, FixedModules(CONFIGURATION)) as governor:
        followed = governor.generation
        with monkeypatch.context() as patched:
            patched.setattr(RegistryStore, "replace", full)
            with pytest.raises(UserError, match="disk full"):
                blocked.add_block(LATER)
            with governor.hold_generation(followed) as is_in_force:
                assert not is_in_force
            for read in (governor.configuration, blocked.snapshot):
                with pytest.raises(UserError, match="disk full") as refused:
                    read()
                assert "no action starts on this robot" in refused.value.diagnostics[0].help[-1]
        assert governor.configuration()[0] == followed + 1
    assert blocked.snapshot().blocks.keys() == {"worn", "wet"}


def test_an_anchor_that_cannot_be_written_is_reported_and_the_change_is_in_force(
    blocked: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, checkpoint: checkpoints.AuditCheckpoint) -> None:
        if checkpoint.closing:
            raise OSError("no space left")
        write(path, checkpoint)

    write = checkpoints.write_anchor
    monkeypatch.setattr("aeros.runtime.audit.log.write_anchor", full)
    with pytest.raises(UserError, match=r"the change is in force, though .* no space left"):
        blocked.add_block(LATER)
    assert blocked.snapshot().blocks.keys() == {"worn", "wet"}


def test_a_record_that_is_not_signed_is_signed_by_a_repair(blocked: Registry) -> None:
    """As a release without signatures left it, or somebody without the key wrote it."""
    log = blocked.folder / LOG
    changes = [one for one in map(json.loads, log.read_text().splitlines()) if "change" in one["event"]]
    log.unlink()
    anchor_of(blocked.folder).unlink()
    with AuditLog(log) as unsigned:
        for one in changes:
            unsigned.append(one["event"], one["details"])
    for refusal in _refusals(blocked):
        assert "is not signed, so anybody may have written it" in refusal
        assert "`aeros repair` signs it" in refusal
    assert blocked.repair() is not None
    assert blocked.snapshot().blocks == {"worn": BLOCK}
    key = read_signing_key(blocked.folder.parent / "audit.key").public
    assert verify_signed(log, key, anchor_of(blocked.folder)).closed


def test_a_change_between_two_readings_is_no_disagreement(
    blocked: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The database is read before a change, and the record after it."""
    stale = blocked.snapshot()
    blocked.add_block(LATER)
    readings = [stale]
    read = RegistryStore.read
    monkeypatch.setattr(RegistryStore, "read", lambda store: readings.pop() if readings else read(store))
    assert blocked.snapshot().blocks.keys() == {"worn", "wet"}


def test_a_link_in_place_of_the_kept_files_is_refused(blocked: Registry, tmp_path: Path) -> None:
    (kept,) = (blocked.folder / "modules").iterdir()
    kept.rename(tmp_path / "elsewhere")
    kept.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UserError, match="but outside of it"):
        blocked.configuration()


def test_a_repair_reaches_runs(blocked: Registry) -> None:
    _put_back(blocked)
    with ControlPage(blocked.folder) as page:
        before = page.generation
        blocked.repair()
        assert page.generation == before + 1
