"""The registry's database: what is stored comes back, and what is no database of this kind is refused."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aeros.runtime.registry.lifecycle import ModuleState
from aeros.runtime.registry.operator_block import OperatorBlock
from aeros.runtime.registry.store import InstalledModule, RegistrySnapshot, RegistryStore
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.migrations.formats import REGISTRY

FULL = RegistrySnapshot(
    7,
    "policies/a.yaml",
    {
        "grip": InstalledModule("grip", "2.0.0", "b" * 64, ModuleState.ACTIVE),
        "tidy": InstalledModule("tidy", "1.0.0", "a" * 64, ModuleState.INSTALLED),
    },
    {
        "one": OperatorBlock("one", "it's broken", "tidy", None, None, "<1.2", "c" * 64),
        "two": OperatorBlock("two", "", None, None, "wait"),
        "up": OperatorBlock("up", "", None, None, None, channel="internet", device="gpu"),
    },
    is_policy_set=True,
    withdrawn=frozenset({"old", "tidy"}),
)


def _refusal(folder: Path) -> str:
    with pytest.raises(UserError) as refused:
        RegistryStore(folder).read()
    (found,) = refused.value.diagnostics
    assert found.code == "AE965"
    assert f"`{folder / 'registry.sqlite3'}` cannot be used" in found.headline
    assert found.help
    return found.headline


def _execute(folder: Path, *statements: str) -> None:
    with closing(sqlite3.connect(folder / "registry.sqlite3", isolation_level=None)) as database:
        for statement in statements:
            database.execute(statement)


def test_a_module_is_in_the_folder_of_its_digest() -> None:
    made = InstalledModule("tidy", "1.0.0", "a" * 64, ModuleState.INSTALLED)
    assert made.folder == f"modules/{'a' * 64}/tidy"


@pytest.mark.parametrize("folder", ["/elsewhere/tidy", "modules/../tidy", "modules/b/grip", ""])
def test_a_module_in_any_other_folder_is_refused(tmp_path: Path, folder: str) -> None:
    RegistryStore(tmp_path).replace(FULL)
    with closing(sqlite3.connect(tmp_path / "registry.sqlite3", isolation_level=None)) as database:
        database.execute("UPDATE modules SET folder = ? WHERE name = 'tidy'", (folder,))
    assert f"`tidy` is in `{folder}`, and not in `modules/{'a' * 64}/tidy`" in _refusal(tmp_path)


_VERSION_2 = (
    "CREATE TABLE policy (only INTEGER PRIMARY KEY CHECK (only = 1), generation INTEGER NOT NULL, "
    "site TEXT NOT NULL) STRICT",
    "CREATE TABLE modules (name TEXT PRIMARY KEY, version TEXT NOT NULL, digest TEXT NOT NULL, "
    "folder TEXT NOT NULL, state TEXT NOT NULL) STRICT",
    "CREATE TABLE blocks (id TEXT PRIMARY KEY, reason TEXT NOT NULL, module TEXT, skill TEXT, "
    "action TEXT) STRICT",
    "INSERT INTO policy VALUES (1, 4, 'policies/a.yaml')",
    "INSERT INTO blocks VALUES ('one', 'worn', NULL, NULL, 'grip')",
    "PRAGMA user_version = 2",
)


def test_a_database_of_version_2_is_read_and_migrates_with_its_next_change(tmp_path: Path) -> None:
    _execute(tmp_path, *_VERSION_2)
    block = OperatorBlock("one", "worn", None, None, "grip")
    was = RegistrySnapshot(4, "policies/a.yaml", {}, {"one": block}, is_policy_set=True)
    store = RegistryStore(tmp_path)
    assert store.read() == was
    store.replace(FULL)
    assert store.read() == FULL
    with closing(sqlite3.connect(store.path)) as database:
        assert database.execute("PRAGMA user_version").fetchone() == (REGISTRY.version,)


def test_where_nothing_was_stored_nothing_is_created(tmp_path: Path) -> None:
    assert RegistryStore(tmp_path).read() == RegistrySnapshot(0, "", {}, {})
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_first_change_left_nothing(tmp_path: Path) -> None:
    (tmp_path / "registry.sqlite3").touch()
    assert RegistryStore(tmp_path).read() == RegistrySnapshot()
    RegistryStore(tmp_path).replace(FULL)
    assert RegistryStore(tmp_path).read() == FULL


def test_stored_values_come_back_in_the_order_of_names(tmp_path: Path) -> None:
    store = RegistryStore(tmp_path)
    turned = RegistrySnapshot(
        7,
        FULL.site,
        dict(reversed(list(FULL.modules.items()))),
        dict(reversed(list(FULL.blocks.items()))),
        is_policy_set=True,
        withdrawn=FULL.withdrawn,
    )
    store.replace(turned)
    found = store.read()
    assert found == FULL
    assert (list(found.modules), list(found.blocks)) == (["grip", "tidy"], ["one", "two", "up"])


def test_a_change_replaces_all_that_was_stored(tmp_path: Path) -> None:
    store = RegistryStore(tmp_path)
    store.replace(FULL)
    store.replace(RegistrySnapshot(8, "b.yaml"))
    assert store.read() == RegistrySnapshot(8, "b.yaml", {}, {})


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> RegistryStore:
    return RegistryStore(tmp_path_factory.mktemp("store"))


@settings(max_examples=15)
@given(st.integers(0, 2**62), st.text(st.characters(codec="utf-8", exclude_characters="\x00"), max_size=5))
def test_any_generation_and_text_come_back(shared: RegistryStore, generation: int, text: str) -> None:
    new = RegistrySnapshot(generation, text, {}, {"one": OperatorBlock("one", text, None, None, None)})
    shared.replace(new)
    assert shared.read() == new


def test_a_change_that_cannot_be_stored_whole_is_not_stored_at_all(tmp_path: Path) -> None:
    store = RegistryStore(tmp_path)
    store.replace(FULL)
    twice = {name: OperatorBlock("same", "", None, None, None) for name in ("one", "two")}
    with pytest.raises(UserError, match="AE965"):
        store.replace(RegistrySnapshot(8, "", {}, twice))
    assert store.read() == FULL


def test_a_database_of_another_version_is_refused(tmp_path: Path) -> None:
    RegistryStore(tmp_path).replace(FULL)
    _execute(tmp_path, f"PRAGMA user_version = {REGISTRY.version + 1}")
    assert str(REGISTRY.version + 1) in _refusal(tmp_path)
    with pytest.raises(UserError, match="AE965"):
        RegistryStore(tmp_path).replace(FULL)


def test_a_database_of_something_else_is_refused(tmp_path: Path) -> None:
    _execute(tmp_path, "CREATE TABLE notes (text TEXT)")
    assert _refusal(tmp_path).endswith("it is not a database of this kind")
    with pytest.raises(UserError, match="not a database of this kind"):
        RegistryStore(tmp_path).replace(FULL)


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("DELETE FROM policy", "it holds no policy"),
        ("UPDATE modules SET state = 'asleep'", "asleep"),
        ("DROP TABLE blocks", "no such table"),
    ],
)
def test_a_damaged_database_is_refused(tmp_path: Path, statement: str, message: str) -> None:
    RegistryStore(tmp_path).replace(FULL)
    _execute(tmp_path, statement)
    assert message in _refusal(tmp_path)


def test_a_folder_for_a_database_is_refused(tmp_path: Path) -> None:
    (tmp_path / "registry.sqlite3").mkdir()
    assert "unable to open" in _refusal(tmp_path)
    with pytest.raises(UserError, match="unable to open"):
        RegistryStore(tmp_path / "absent").replace(FULL)
