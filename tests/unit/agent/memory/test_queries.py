"""Queries of the memory: summaries of skills, searches, and every row."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from aeros.agent.errors import AgentError
from aeros.agent.identity import Identity
from aeros.agent.memory.evidence import DurationStats
from aeros.agent.memory.posterior import SuccessRecord
from aeros.agent.memory.queries import ContextSummary, EpisodeFilter, MemoryReader, open_memory_reader
from aeros.agent.memory.store import EpisodeEnd, EpisodeStart, Memory, open_memory

WRAP = EpisodeStart("d.make", "d", "wrap", "step", {"force": 0.5}, 1.0, {"wrapped": False}, '{"code": "1"}')
BOIL = replace(WRAP, skill="boil", task="d.cook", inputs={"salt": "50%_a!"}, context='{"code": "2"}')


def remember(
    memory: Memory, start: EpisodeStart, reason: str = "", *, counts: bool = True, seconds: float = 2.0
) -> None:
    outcome = None if reason else "done"
    ending = EpisodeEnd(
        "stopped" if reason else "finished",
        outcome,
        bool(reason),
        reason,
        1.0 + seconds,
        {"wrapped": not reason},
        counts,
    )
    memory.end_episode(memory.start_episode(start), ending)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight episodes of two skills in two sessions, some events and a fact."""
    path = tmp_path_factory.mktemp("memory") / "memory.sqlite3"
    who = Identity(uuid4(), "chef", "2026-11-21T00:00:00+00:00", 1)
    with open_memory(path, who) as memory:
        remember(memory, WRAP)
        remember(memory, WRAP, "Askew")
        remember(memory, WRAP, "Askew")
        remember(memory, WRAP, "torn")
        remember(memory, replace(WRAP, context='{"code": "0"}'), "late", counts=False)
        memory.add_event(5.0, "replan", {"number": 1})
    with open_memory(path, replace(who, sessions=2)) as memory:
        remember(memory, BOIL, seconds=4.0)
        remember(memory, replace(BOIL, context='{"code": "1"}'), seconds=6.0)
        memory.start_episode(BOIL)  # never ends
        memory.add_event(7.0, "broken-assumption", {"skill": "d.boil"})
        memory.add_event(8.0, "broken-assumption", {"skill": "d.wrap"})
        memory.set_fact("pot", {"x": 0.5}, "camera")
        memory.set_fact("bowl", [1], "operator")
    return path


@pytest.fixture
def reader(path: Path) -> Iterator[MemoryReader]:
    with open_memory_reader(path) as opened:
        yield opened


def test_a_skill_is_summed_up_over_all_its_contexts(reader: MemoryReader) -> None:
    boil, wrap = reader.skills()
    assert (boil.skill, boil.record) == ("d.boil", SuccessRecord(2, 0))
    assert boil.typical_duration == DurationStats(5.0, 4.5, 5.5, 2)
    assert boil.contexts == (
        ContextSummary({"code": "1"}, "", SuccessRecord(1, 0)),
        ContextSummary({"code": "2"}, "", SuccessRecord(1, 0)),
    )
    assert boil.reasons == ()
    assert (wrap.skill, wrap.record) == ("d.wrap", SuccessRecord(1, 3))
    assert wrap.contexts == (
        ContextSummary({"code": "1"}, "", SuccessRecord(1, 3)),  # what does not count makes none
    )


def test_reasons_come_by_how_often_they_were_given_and_at_most_three(
    reader: MemoryReader, tmp_path: Path
) -> None:
    (wrap,) = reader.skills("d.wrap")
    assert wrap.reasons == (("Askew", 2), ("late", 1), ("torn", 1))
    with open_memory(tmp_path / "memory", Identity(uuid4(), "chef", "", 1)) as memory:
        for reason in "abcd":
            remember(memory, WRAP, reason)
    with open_memory_reader(tmp_path / "memory") as other:
        (wrap,) = other.skills()
    assert wrap.reasons == (("d", 1), ("c", 1), ("b", 1))


def test_a_context_that_was_not_kept_is_none(reader: MemoryReader, tmp_path: Path) -> None:
    with open_memory(tmp_path / "memory", Identity(uuid4(), "chef", "", 1)) as memory:
        remember(memory, WRAP)
    with closing(sqlite3.connect(tmp_path / "memory")) as database, database:
        database.execute("UPDATE episodes SET context = NULL")
    with open_memory_reader(tmp_path / "memory") as other:
        (wrap,) = other.skills()
        (episode,) = other.search(EpisodeFilter(), 9)
    assert wrap.contexts == (ContextSummary(None, "", SuccessRecord(1, 0)),)
    assert episode["context"] is None


def test_a_skill_that_was_never_tried_has_no_summary(reader: MemoryReader) -> None:
    assert list(reader.skills("d.fly")) == []


@pytest.mark.parametrize(
    ("asked", "ids"),
    [
        (EpisodeFilter(), [8, 7, 6, 5, 4, 3, 2, 1]),
        (EpisodeFilter(text="aSKEW"), [3, 2]),
        (EpisodeFilter(text="finished"), [7, 6, 1]),
        (EpisodeFilter(text="done"), [7, 6, 1]),
        (EpisodeFilter(text="force"), [5, 4, 3, 2, 1]),
        (EpisodeFilter(text="50%_a!"), [8, 7, 6]),
        (EpisodeFilter(text="%"), [8, 7, 6]),
        (EpisodeFilter(text="5_%"), []),
        (EpisodeFilter(skill="d.boil"), [8, 7, 6]),
        (EpisodeFilter(task="d.cook", session=2), [8, 7, 6]),
        (EpisodeFilter(outcome="done"), [7, 6, 1]),
        (EpisodeFilter(failed=True), [5, 4, 3, 2]),
        (EpisodeFilter(failed=False), [7, 6, 1]),
        (EpisodeFilter(session=1, failed=False), [1]),
        (EpisodeFilter(text="torn", skill="d.boil"), []),
    ],
)
def test_a_search_finds_what_matches_in_every_field(
    reader: MemoryReader, asked: EpisodeFilter, ids: list[int]
) -> None:
    assert [row["id"] for row in reader.search(asked, 99)] == ids


def test_a_search_gives_the_latest_with_their_json_decoded(reader: MemoryReader) -> None:
    (last,) = reader.search(EpisodeFilter(failed=False), 1)
    assert (last["id"], last["inputs"], last["before"], last["after"], last["ended"]) == (
        7,
        {"salt": "50%_a!"},
        {"wrapped": False},
        {"wrapped": True},
        7.0,
    )
    assert reader.search(EpisodeFilter(), 0) == []


def test_broken_assumptions_come_in_order_with_their_details(reader: MemoryReader) -> None:
    assert reader.broken_assumptions() == [
        {"session": 2, "time": 7.0, "skill": "d.boil"},
        {"session": 2, "time": 8.0, "skill": "d.wrap"},
    ]


def test_facts_come_by_their_keys(reader: MemoryReader) -> None:
    assert [(row["key"], row["value"], row["source"]) for row in reader.facts()] == [
        ("bowl", [1], "operator"),
        ("pot", {"x": 0.5}, "camera"),
    ]


def test_sessions_say_how_many_episodes_they_had(reader: MemoryReader) -> None:
    assert [(row["id"], row["episodes"]) for row in reader.sessions()] == [(1, 5), (2, 3)]


def test_all_rows_are_of_every_table_and_say_of_which(reader: MemoryReader) -> None:
    rows = list(reader.all_rows())
    kinds = [row["row"] for row in rows]
    assert kinds == ["session"] * 2 + ["episode"] * 8 + ["event"] * 3 + ["fact"] * 2
    events: list[Any] = [(row["kind"], row["details"]) for row in rows if row["row"] == "event"]
    assert events[0] == ("replan", {"number": 1})


def test_where_nothing_is_remembered_nothing_is_made(tmp_path: Path) -> None:
    with (
        pytest.raises(AgentError, match=r"nothing is remembered here: there is no .*/none"),
        open_memory_reader(tmp_path / "none"),
    ):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_memory_that_fails_while_it_is_read_is_reported(path: Path) -> None:
    with (
        pytest.raises(
            AgentError, match=r"memory\.sqlite3 is damaged or cannot be used: no such table: songs"
        ),
        open_memory_reader(path) as reader,
    ):
        reader._rows("SELECT * FROM songs")


def test_inputs_and_obstacles_are_summed_up_where_there_are_several(tmp_path: Path) -> None:
    person = {"kind": "rule", "rule": "separation", "text": "human_distance >= 500 mm"}
    with open_memory(tmp_path / "memory", Identity(uuid4(), "chef", "", 1)) as memory:
        for force, failed in ((5.0, False), (5.0, False), (2.0, True), (2.0, False)):
            causes = [person, {"kind": "outcome", "rule": "d.wrap", "text": ""}] if failed else []
            ending = EpisodeEnd("finished", None, failed, "", 2.0, {}, True, causes)
            memory.end_episode(memory.start_episode(replace(WRAP, inputs={"force": force})), ending)
    with open_memory_reader(tmp_path / "memory") as reader:
        (wrap,) = reader.skills()
    assert wrap.inputs == (({"force": 5.0}, SuccessRecord(2, 0)), ({"force": 2.0}, SuccessRecord(1, 1)))
    assert wrap.obstacles == (("rule", "separation", 1),)
