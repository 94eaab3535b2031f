from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.errors import RefusedError
from aeros.agent.identity import Identity, exclusive
from aeros.agent.memory.deletion import Forgotten, before, forget, of_session, of_skill
from aeros.agent.memory.posterior import Record
from aeros.agent.memory.queries import recollection
from aeros.agent.memory.store import Beginning, Ending, open_memory

MARKS = ("zyzzyva", "quagga")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Two sessions; steps of `cook.boil` and `cook.boiling`, with marks, events and facts."""
    path = tmp_path / "memory.sqlite3"
    for number, mark in enumerate(MARKS, 1):
        with open_memory(path, Identity(uuid4(), "chef", "", number)) as memory:
            for skill in ("boil", "boiling"):
                beginning = Beginning("cook.cook", "cook", skill, "step", {}, 0.0, {}, "{}")
                for _ in range(20):
                    ending = Ending("finished", None, True, f"{mark} by {skill}", 1.0, {}, counts=True)
                    memory.end(memory.begin(beginning), ending)
                memory.remember(1.0, "re-plan", {"reason": f"`cook.{skill}` failed: {mark} by {skill}"})
            memory.learn(f"last {mark}", {"reason": "`cook.boil` failed"}, f"session {number}")
    return path


def records(path: Path) -> dict[str, Record]:
    with recollection(path) as remembered:
        return {one.skill: one.record for one in remembered.skills()}


def bytes_of(path: Path) -> bytes:
    return b"".join(file.read_bytes() for file in path.parent.glob(f"{path.name}*"))


def test_a_skill_is_forgotten_with_all_that_names_it_and_nothing_else(path: Path) -> None:
    assert b"zyzzyva by boil" in bytes_of(path)
    assert forget(path.parent, path, of_skill("cook.boil")) == Forgotten(0, 40, 2, 2)
    assert records(path) == {"cook.boiling": Record(0, 40)}
    left = bytes_of(path)
    assert b"zyzzyva by boiling" in left
    assert b"zyzzyva by boil" not in left.replace(b"zyzzyva by boiling", b"")
    assert b"cook.boil`" not in left


def test_a_session_is_forgotten_as_a_whole(path: Path) -> None:
    assert forget(path.parent, path, of_session(1)) == Forgotten(1, 40, 2, 1)
    assert records(path) == dict.fromkeys(("cook.boil", "cook.boiling"), Record(0, 20))
    assert MARKS[0].encode() not in bytes_of(path)
    assert MARKS[1].encode() in bytes_of(path)


def test_what_is_older_is_forgotten(path: Path) -> None:
    now = datetime.now(UTC)
    assert forget(path.parent, path, before(now - timedelta(days=1))) == Forgotten(0, 0, 0, 0)
    assert forget(path.parent, path, before(now + timedelta(days=1))) == Forgotten(2, 80, 4, 2)
    assert not any(mark.encode() in bytes_of(path) for mark in MARKS)


def test_nothing_is_forgotten_while_an_agent_is_awake(path: Path) -> None:
    with exclusive(path.parent), pytest.raises(RefusedError, match="has an agent already: pid"):
        forget(path.parent, path, of_skill("cook.boil"))
    assert records(path)["cook.boil"] == Record(0, 40)


def test_where_nothing_is_remembered_nothing_is_made(tmp_path: Path) -> None:
    path = tmp_path / "nobody" / "memory.sqlite3"
    with pytest.raises(RefusedError, match="nothing is remembered here"):
        forget(path.parent, path, of_skill("cook.boil"))
    with pytest.raises(RefusedError, match="nothing is remembered here"), recollection(path):
        pass
    assert not path.parent.exists()


def test_forgetting_that_fails_midway_has_forgotten_nothing(path: Path) -> None:
    def half(database: object) -> None:
        of_session(1)(database)  # type: ignore[arg-type]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        forget(path.parent, path, half)
    assert records(path)["cook.boil"] == Record(0, 40)
