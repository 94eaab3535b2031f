from __future__ import annotations

import shutil
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.identity import Identity
from aeros.agent.memory import schema as memory_schema
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.queries import open_memory_reader
from aeros.agent.memory.schema import SCHEMA_VERSION, open_database
from aeros.agent.memory.store import Fact, open_memory
from aeros.spec.migrations.renamed_names import current_event

OLD = Path(__file__).parents[1] / "data" / "memory_schema_1.sqlite3"
"""Written by the code that had schema 1: two sessions, six episodes, the last of them interrupted."""


def content(path: Path) -> dict[str, list[tuple[object, ...]]]:
    with closing(sqlite3.connect(path)) as database:
        schema = database.execute("SELECT name, sql FROM sqlite_schema ORDER BY name").fetchall()
        tables = ("sessions", "episodes", "events", "facts")
        rows = {
            name: database.execute(f"SELECT * FROM {name} ORDER BY 1").fetchall()  # noqa: S608  names of ours
            for name in tables
        }
        return {"version": database.execute("PRAGMA user_version").fetchall(), "schema": schema, **rows}


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copy(OLD, tmp_path / "memory.sqlite3"))


def test_the_kept_file_is_of_schema_1() -> None:
    assert content(OLD)["version"] == [(1,)]


def test_memory_of_schema_1_is_still_read(old: Path) -> None:
    before = content(old)
    with open_memory(old, Identity(uuid4(), "chef", "", 3)) as memory:
        # Nobody knows which plant it was on, so it is no evidence.
        assert memory.success_record("make_dumplings", "wrap") == SuccessRecord(0, 0)
        assert memory.typical_duration("make_dumplings", "boil") is None
        assert memory.get_fact("last run of make_dumplings.make_dumplings") == Fact(
            {"reached": True}, "session 1"
        )
    with open_memory_reader(old) as reader:
        boil, wrap = reader.skills()
        # One success; one failure; a denial that may have been due to somebody nearby, and a cancellation.
        assert (wrap.skill, wrap.record) == ("make_dumplings.wrap", SuccessRecord(1, 1))
        assert (boil.skill, boil.record) == ("make_dumplings.boil", SuccessRecord(1, 0))
        assert boil.typical_duration is not None
        assert boil.typical_duration.median == 18.5
    after = content(old)
    assert after["version"] == [(SCHEMA_VERSION,)]
    assert [row[: len(before["episodes"][0])] for row in after["episodes"]] == before["episodes"]
    assert after["sessions"][:2] == [(*row, None) for row in before["sessions"]]
    assert after["facts"] == before["facts"]
    assert [kind for *_, kind, _ in before["events"]] != [kind for *_, kind, _ in after["events"]]
    assert after["events"] == [(*row[:3], current_event(str(row[3])), row[4]) for row in before["events"]]


def test_a_migrated_memory_has_the_schema_of_a_new_one(old: Path, tmp_path: Path) -> None:
    open_database(old).close()
    open_database(tmp_path / "new.sqlite3").close()
    assert content(old)["schema"] == content(tmp_path / "new.sqlite3")["schema"]


def remembering(path: Path) -> bytes:
    """A memory of several pages; its bytes."""
    with open_memory(path, Identity(uuid4(), "chef", "", 1)) as memory:
        for number in range(40):
            memory.set_fact(f"fact {number}", "x" * 1000, "a test")
    return path.read_bytes()


def test_a_memory_that_was_cut_off_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    whole = remembering(path)
    assert len(whole) > 10 * 4096
    for size in (
        0,
        1,
        15,
        16,
        99,
        100,
        512,
        4095,
        4096,
        4097,
        8192,
        len(whole) // 2,
        len(whole) - 4096,
        len(whole) - 1,
    ):
        path.write_bytes(whole[:size])
        with pytest.raises(
            AgentError, match=r"is empty: it was cut off|is damaged|not a database of this kind"
        ):
            open_database(path)
        assert path.read_bytes() == whole[:size], size
    path.write_bytes(whole)
    open_database(path).close()


@pytest.mark.parametrize("filler", [b"\0", b"\xff"])
def test_a_memory_of_zeros_or_ones_is_refused(filler: bytes, tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    path.write_bytes(filler * 8192)
    with pytest.raises(AgentError, match=r"cannot be used|not a database"):
        open_database(path)


def test_a_new_memory_is_made_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "memory.sqlite3"

    def full(target: Path, content: bytes) -> None:
        target.with_name(target.name + ".new").write_bytes(content[:100])
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(memory_schema, "replace_durably", full)
        with pytest.raises(AgentError, match=r"cannot be opened: .*No space left"):
            open_database(path)
    assert not path.exists()
    open_database(path).close()
    assert content(path)["version"] == [(SCHEMA_VERSION,)]


def test_a_journal_of_a_memory_that_is_gone_is_not_replayed(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    database = open_database(path)
    database.execute("INSERT INTO facts VALUES ('old', '1', 'a test', 'now')")
    journal = tmp_path / "memory.sqlite3-wal"
    frames = journal.read_bytes()
    assert frames
    database.close()
    path.unlink()
    journal.write_bytes(frames)
    database = open_database(path)
    assert database.execute("SELECT count(*) FROM facts").fetchall() == [(0,)]
    database.close()


@pytest.mark.parametrize("failing", range(len(memory_schema._MIGRATION_2)))
def test_a_migration_that_fails_anywhere_has_changed_nothing(
    old: Path, monkeypatch: pytest.MonkeyPatch, failing: int
) -> None:
    before = content(old)
    statements = list(memory_schema._MIGRATION_2)
    statements[failing] = "no SQL"
    with monkeypatch.context() as broken:
        broken.setattr(memory_schema, "_MIGRATIONS", (memory_schema._MIGRATION_1, tuple(statements)))
        with pytest.raises(AgentError, match="damaged or cannot be used"):
            open_database(old)
    assert content(old) == before
    open_database(old).close()
    assert content(old)["version"] == [(SCHEMA_VERSION,)]


def test_a_migration_is_killed_before_or_after_but_never_halfway(old: Path) -> None:
    """Killed at each statement of it, in a process of its own."""
    for statement in range(len(memory_schema._MIGRATION_2) + 4):
        path = Path(shutil.copy(OLD, old))
        kill = f"""
import os, signal, sqlite3, sys
from pathlib import Path
from aeros.agent.memory import schema as memory_schema
class Dying:
    def __init__(self, real): self.real, self.left = real, {statement}
    def execute(self, sql):
        if self.left == 0: os.kill(os.getpid(), signal.SIGKILL)
        self.left -= 1
        return self.real.execute(sql)
memory_schema._migrate(Dying(sqlite3.connect({str(path)!r}, isolation_level=None)))
"""
        assert subprocess.run([sys.executable, "-c", kill], check=False).returncode == -signal.SIGKILL
        assert content(path) == content(OLD)
        open_database(path).close()
        assert content(path)["version"] == [(SCHEMA_VERSION,)]
