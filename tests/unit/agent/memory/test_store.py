from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.identity import Identity
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.schema import SCHEMA_VERSION
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, Memory, open_memory

WHO = Identity(uuid4(), "chef", "2026-11-21T00:00:00+00:00", 1)
STEP = EpisodeStart(
    "dumpling.make_dumplings", "dumpling", "wrap", "step", {"force": 0.5}, 1.0, {"wrapped": False}, "here"
)


def remember(
    memory: Memory, *, failed: bool = False, counts: bool = True, context: str = "here", seconds: float = 1.0
) -> None:
    outcome, after = None if failed else "wrapped", {"wrapped": not failed}
    ending = EpisodeEnd("finished", outcome, failed, "", 1.0 + seconds, after, counts)
    memory.end_episode(memory.start_episode(replace(STEP, context=context)), ending)


def database(path: Path, sql: str) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(path)) as connection, connection:
        return connection.execute(sql).fetchall()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "memory.sqlite3"


def test_the_record_of_a_skill_spans_sessions(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        remember(memory)
        remember(memory, failed=True)
    with open_memory(path, WHO) as memory:
        remember(memory, failed=True)
        remember(memory, failed=True, counts=False)
        memory.start_episode(STEP)
        assert memory.success_record("dumpling", "wrap") == SuccessRecord(1, 2)
        memory.mark_interrupted()
        assert memory.success_record("dumpling", "wrap") == SuccessRecord(1, 2)
        assert memory.success_record("dumpling", "boil") == SuccessRecord(0, 0)


def test_a_record_can_be_asked_for_in_one_context(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        remember(memory)
        remember(memory, context="there")
        remember(memory, failed=True, context="there")
        assert memory.success_record("dumpling", "wrap", "here") == SuccessRecord(1, 0)
        assert memory.success_record("dumpling", "wrap", "there") == SuccessRecord(1, 1)
        assert memory.success_record("dumpling", "wrap", "elsewhere") == SuccessRecord(0, 0)


def test_a_step_is_known_before_it_ends_and_interrupted_if_it_never_does(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        memory.start_episode(STEP)
        assert database(path, "SELECT skill, status FROM episodes") == [("wrap", None)]
    assert database(path, "SELECT skill, status FROM episodes") == [("wrap", "interrupted")]


def test_a_step_under_way_at_kill_9_is_found_by_the_next_session(path: Path) -> None:
    kill = f"""
import os, signal, sys
sys.path.insert(0, {os.getcwd()!r})
from tests.unit.agent.memory.test_store import *
with open_memory(Path({str(path)!r}), WHO) as memory:
    remember(memory)
    memory.start_episode(STEP)
    os.kill(os.getpid(), signal.SIGKILL)
"""
    assert subprocess.run([sys.executable, "-c", kill], check=False).returncode == -signal.SIGKILL
    with open_memory(path, WHO) as memory:
        assert memory.success_record("dumpling", "wrap") == SuccessRecord(1, 0)
        assert memory.mark_interrupted() == ["dumpling.wrap"]
        assert memory.mark_interrupted() == []


def test_facts_have_a_source_and_are_replaced(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        memory.set_fact("pot", {"x": 0.4}, "camera")
        memory.set_fact("pot", {"x": 0.5}, "operator")
    with open_memory(path, WHO) as memory:
        fact = memory.get_fact("pot")
        assert fact is not None
        assert (fact.value, fact.source) == ({"x": 0.5}, "operator")
        assert memory.get_fact("pan") is None


def test_writes_are_durable(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        connection = memory._database
        assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        assert connection.execute("PRAGMA synchronous").fetchone() == (2,)  # FULL
        assert connection.execute("PRAGMA user_version").fetchone() == (SCHEMA_VERSION,)


def test_a_newer_schema_is_refused(path: Path) -> None:
    with open_memory(path, WHO):
        pass
    database(path, f"PRAGMA user_version = {SCHEMA_VERSION + 1}")
    with (
        pytest.raises(
            AgentError, match=f"has schema {SCHEMA_VERSION + 1}; this version reads up to {SCHEMA_VERSION}"
        ),
        open_memory(path, WHO),
    ):
        pass


def test_a_foreign_database_is_refused(path: Path) -> None:
    database(path, "CREATE TABLE songs (title TEXT)")
    with pytest.raises(AgentError, match="not a database of this kind"), open_memory(path, WHO):
        pass


def test_a_file_that_is_no_database_is_refused_and_left_alone(path: Path) -> None:
    path.write_bytes(b"\x00garbage" * 1000)
    with pytest.raises(AgentError, match="damaged"), open_memory(path, WHO):
        pass
    assert path.read_bytes() == b"\x00garbage" * 1000


def test_a_torn_page_is_refused(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        for _ in range(200):
            remember(memory)
    content = bytearray(path.read_bytes())
    content[3 * 4096 : -4096] = b"\xff" * (len(content) - 4 * 4096)
    path.write_bytes(content)
    with pytest.raises(AgentError, match="damaged"), open_memory(path, WHO):
        pass


def test_a_folder_in_place_of_the_database_is_refused(path: Path) -> None:
    path.mkdir()
    with pytest.raises(AgentError, match="cannot be opened"), open_memory(path, WHO):
        pass


def test_a_failing_write_is_a_refusal_with_the_reason(path: Path) -> None:
    with open_memory(path, WHO) as memory:
        memory._database.execute("PRAGMA query_only = ON")
        with pytest.raises(AgentError, match="memory failed"):
            memory.start_episode(STEP)
        memory._database.execute("PRAGMA query_only = OFF")
