"""The database is held against the record of changes: an older or edited one lifts nothing silently."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from aeros.runtime.registry.change_log import LOG
from aeros.runtime.registry.control_page import ControlPage
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.registry import Registry
from aeros.runtime.registry.registry_governor import RegistryGovernor
from aeros.runtime.registry.store import RegistryStore
from aeros.spec.diagnostics.errors import UserError
from tests.unit.runtime.registry.conftest import Author
from tests.unit.runtime.registry.fixed_modules import FixedModules

BLOCK = OperatorBlock("worn", "a finger is worn", None, None, "grip")
LATER = OperatorBlock("wet", "wet floor", None, None, "wait")


@pytest.fixture
def blocked(registry: Registry, write: Author) -> Registry:
    """With `tidy` active and a block, of which `older.sqlite3` knows nothing."""
    registry.install(write())
    registry.configure("tidy")
    registry.activate("tidy")
    shutil.copy(_database(registry), registry.folder.parent / "older.sqlite3")
    registry.add_block(BLOCK)
    return registry


def _database(registry: Registry) -> Path:
    return registry.folder / "registry.sqlite3"


def _put_back(registry: Registry) -> None:
    shutil.copy(registry.folder.parent / "older.sqlite3", _database(registry))


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


Damage = tuple[Callable[[Registry], object], str]
"""Damage to a registry, and a part of the message that reports it."""

REPAIRABLE: dict[str, Damage] = {
    "an older database": (_put_back, "an older one"),
    "a deleted database": (lambda registry: _database(registry).unlink(), "an older one, or was lost"),
    "a lifted block": (_edit("DELETE FROM blocks"), "differs from the record"),
    "other contents": (_edit("UPDATE modules SET digest = '000'"), "and not in `modules/000/"),
    "a folder elsewhere": (_edit("UPDATE modules SET folder = '/elsewhere/tidy'"), "`/elsewhere/tidy`"),
    "a module made active": (_edit("UPDATE modules SET version = '9'"), "differs from the record"),
    "no database": (lambda registry: _database(registry).write_bytes(b"x" * 4096), "cannot be used"),
}
UNREPAIRABLE: dict[str, Damage] = {
    "a record cut short": (_cut_latest_change, "records are missing"),
    "a deleted record": (lambda registry: (registry.folder / LOG).unlink(), "records are missing"),
    "an edited record": (
        lambda registry: (registry.folder / LOG).write_bytes(
            (registry.folder / LOG).read_bytes().replace(b"finger", b"singer")
        ),
        "its record of changes is damaged",
    ),
}


def _refusals(registry: Registry) -> list[str]:
    """The refusals of everything that reads the registry: a run of any kind, and each change."""
    configuration = FixedModules(None)  # type: ignore[arg-type]
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
        assert "restore the folder from a backup" in refusal
    with pytest.raises(UserError, match=message):
        blocked.repair()


def test_where_there_is_no_registry_nothing_is_repaired(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="there is none"):
        Registry(tmp_path / "none").repair()
    assert not (tmp_path / "none").exists()


def test_a_change_that_was_killed_before_it_was_stored_needs_no_repair(
    blocked: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = blocked.snapshot()

    def killed(*_: object) -> None:
        raise SystemExit

    for _ in range(2):
        with monkeypatch.context() as patched:
            patched.setattr(RegistryStore, "replace", killed)
            with pytest.raises(SystemExit):
                blocked.remove_block("worn")
        assert blocked.snapshot() == before
        assert blocked.repair() is None
    blocked.remove_block("worn")
    assert blocked.snapshot().blocks == {}


def test_a_change_that_was_killed_before_its_mark_is_made(
    blocked: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    def killed(*_: object) -> None:
        raise SystemExit

    with monkeypatch.context() as patched:
        patched.setattr("aeros.runtime.registry.transaction.record_made", killed)
        with pytest.raises(SystemExit):
            blocked.add_block(LATER)
    assert blocked.snapshot().blocks.keys() == {"worn", "wet"}
    blocked.remove_block("wet")
    _put_back(blocked)
    with pytest.raises(UserError, match="an older one"):
        blocked.snapshot()


def test_a_mark_that_cannot_be_recorded_is_reported_and_the_change_is_in_force(
    blocked: Registry, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = RegistryStore.replace

    def full(store: RegistryStore, *given: object) -> None:
        replace(store, *given)  # type: ignore[arg-type]
        (blocked.folder.parent / "audit.key").write_text("none")

    monkeypatch.setattr(RegistryStore, "replace", full)
    with pytest.raises(UserError, match="the change is in force, but its record cannot be completed"):
        blocked.add_block(LATER)
    assert blocked.snapshot().blocks.keys() == {"worn", "wet"}


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
