from __future__ import annotations

import json
import re
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.identity import Identity, lock_folder
from aeros.agent.memory.deletion import (
    DeletedRows,
    filter_before,
    filter_by_session,
    filter_by_skill,
    filter_by_variable,
    forget,
)
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.queries import open_memory_reader
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, open_memory

MARKS = ("zyzzyva", "quagga")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Two sessions; steps of `cook.boil` and `cook.boiling`, with marks, events and facts."""
    path = tmp_path / "memory.sqlite3"
    for number, mark in enumerate(MARKS, 1):
        with open_memory(path, Identity(uuid4(), "chef", "", number)) as memory:
            for skill in ("boil", "boiling"):
                beginning = EpisodeStart("cook.cook", "cook", skill, "step", {}, 0.0, {}, "{}")
                for _ in range(20):
                    ending = EpisodeEnd(
                        "finished", None, True, f"{mark} by {skill}", 1.0, {}, counts_toward_record=True
                    )
                    memory.end_episode(memory.start_episode(beginning), ending)
                memory.add_event(1.0, "replan", {"reason": f"`cook.{skill}` failed: {mark} by {skill}"})
            memory.set_fact(f"last {mark}", {"reason": "`cook.boil` failed"}, f"session {number}")
    return path


def records(path: Path) -> dict[str, SuccessRecord]:
    with open_memory_reader(path) as remembered:
        return {one.skill: one.record for one in remembered.skills()}


def bytes_of(path: Path) -> bytes:
    return b"".join(file.read_bytes() for file in path.parent.glob(f"{path.name}*"))


def test_a_skill_is_forgotten_with_all_that_names_it_and_nothing_else(path: Path) -> None:
    assert b"zyzzyva by boil" in bytes_of(path)
    assert forget(path.parent, path, filter_by_skill("cook.boil")) == DeletedRows(0, 40, 2, 2, 0)
    assert records(path) == {"cook.boiling": SuccessRecord(0, 40)}
    left = bytes_of(path)
    assert b"zyzzyva by boiling" in left
    assert b"zyzzyva by boil" not in left.replace(b"zyzzyva by boiling", b"")
    assert b"cook.boil`" not in left


def test_a_session_is_forgotten_as_a_whole(path: Path) -> None:
    assert forget(path.parent, path, filter_by_session(1)) == DeletedRows(1, 40, 2, 1, 0)
    assert records(path) == dict.fromkeys(("cook.boil", "cook.boiling"), SuccessRecord(0, 20))
    assert MARKS[0].encode() not in bytes_of(path)
    assert MARKS[1].encode() in bytes_of(path)


def test_records_before_a_date_are_deleted(path: Path) -> None:
    now = datetime.now(UTC)
    assert forget(path.parent, path, filter_before(now - timedelta(days=1))) == DeletedRows(0, 0, 0, 0, 0)
    assert forget(path.parent, path, filter_before(now + timedelta(days=1))) == DeletedRows(2, 80, 4, 2, 0)
    assert not any(mark.encode() in bytes_of(path) for mark in MARKS)


def test_nothing_is_forgotten_while_an_agent_is_awake(path: Path) -> None:
    with lock_folder(path.parent), pytest.raises(AgentError, match="has an agent already: pid"):
        forget(path.parent, path, filter_by_skill("cook.boil"))
    assert records(path)["cook.boil"] == SuccessRecord(0, 40)


def test_where_nothing_is_remembered_nothing_is_made(tmp_path: Path) -> None:
    path = tmp_path / "nobody" / "memory.sqlite3"
    with pytest.raises(AgentError, match="nothing is remembered here"):
        forget(path.parent, path, filter_by_skill("cook.boil"))
    with pytest.raises(AgentError, match="nothing is remembered here"), open_memory_reader(path):
        pass
    assert not path.parent.exists()


def test_forgetting_that_fails_midway_has_forgotten_nothing(path: Path) -> None:
    def half(database: object) -> None:
        filter_by_session(1)(database)  # type: ignore[arg-type]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        forget(path.parent, path, half)
    assert records(path)["cook.boil"] == SuccessRecord(0, 40)


@pytest.mark.parametrize("name", ["", " ", "(", "task", "failed", "zyzzyva"])
def test_a_word_that_is_no_remembered_variable_deletes_nothing(path: Path, name: str) -> None:
    assert not any(asdict(forget(path.parent, path, filter_by_variable(name))).values())
    assert b"zyzzyva by boil" in bytes_of(path)


def test_a_variable_of_the_site_is_forgotten_by_its_value_in_an_episode(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    with open_memory(path, Identity(uuid4(), "chef", "", 1)) as memory:
        memory.start_episode(
            EpisodeStart("cook.cook", "cook", "boil", "step", {}, 0.0, {"lid_on": True}, "{}")
        )
        memory.add_event(1.0, "goal-unmet", {"text": "lid_on is true"})
    assert forget(tmp_path, path, filter_by_variable("lid_on")) == DeletedRows(0, 0, 1, 0, 0, values=1)


def test_a_variable_is_forgotten_with_its_values_in_episodes_events_and_facts(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    context = json.dumps({"task": "cook.cook", "code": "", "predicates": {"cook.lid_on": True}})
    with open_memory(path, Identity(uuid4(), "chef", "", 1)) as memory:
        values = {"cook.lid_on": True, "cook.lid_on_hook": False}
        start = EpisodeStart("cook.cook", "cook", "boil", "step", {}, 0.0, values, context)
        ending = EpisodeEnd(
            "finished", None, True, "cook.lid_on is true", 1.0, values, True, [{"at": "cook.lid_on"}]
        )
        memory.end_episode(memory.start_episode(start), ending)
        memory.add_event(1.0, "goal-unmet", {"text": "cook.lid_on is true"})
        memory.add_event(1.0, "goal-unmet", {"text": "cook.lid_on_hook is true"})
        memory.set_fact("last run", {"measured": {"cook.lid_on": True}}, "session 1")
    assert forget(tmp_path, path, filter_by_variable("cook.lid_on")) == DeletedRows(0, 0, 1, 1, 0, values=5)
    with open_memory_reader(path) as reader:
        rows = json.dumps(list(reader.all_rows()))
        (boil,) = reader.skills()
    assert "cook.lid_on_hook" in rows
    assert not re.search(r"cook\.lid_on\b(?!_)", rows)
    assert boil.record == SuccessRecord(0, 1)
    (only,) = boil.contexts
    assert only.context is None
