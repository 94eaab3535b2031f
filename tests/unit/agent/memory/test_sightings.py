"""Sightings outlive the session: the last value, the usual first one, and the source."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from uuid import uuid4

import pytest

from aeros.agent.identity import Identity
from aeros.agent.memory.deletion import filter_by_variable, forget
from aeros.agent.memory.queries import open_memory_reader
from aeros.agent.memory.sightings import REFRESH_S, Sighting, sightings_of, usual_value
from aeros.agent.memory.store import Memory, open_memory
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading
from tests.unit.agent.dumplings import STATE

HERE, NEAR, FAR = [1.0, 0.0, 0.4], [1.1, 0.0, 0.4], [3.0, 0.0, 0.0]


def seen(value: object, time: float = 1.0, name: str = "cup") -> Sighting:
    return Sighting(name, value, time, "camera", 0.01)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "memory.sqlite3"


def session(path: Path, *groups: Iterable[Sighting], plant: str = "physics") -> None:
    with open_memory(path, Identity(uuid4(), "chef", "", 1), plant) as memory:
        for group in groups:
            memory.note_sightings(group)


def test_the_last_value_and_the_usual_first_one_are_remembered(path: Path) -> None:
    for first in (HERE, FAR, NEAR):
        session(path, [seen(first)], [seen([0.0, 0.0, 0.0], 9.0)])
    with open_memory(path, Identity(uuid4(), "chef", "", 4), "physics") as memory:
        cup = memory.remembered_values()["cup"]
    assert (cup.value, cup.session, cup.source, cup.uncertainty) == ([0.0, 0.0, 0.0], 3, "camera", 0.01)
    assert (cup.usual, cup.usual_sessions, cup.sessions) == (NEAR, 2, 3)
    written = datetime.fromisoformat(cup.seen)
    assert cup.age(written + timedelta(seconds=90)) == 90.0


def test_another_plant_shows_nothing_of_this_one(path: Path) -> None:
    session(path, [seen(HERE)], plant="symbolic")
    with open_memory(path, Identity(uuid4(), "chef", "", 2), "physics") as memory:
        assert memory.remembered_values() == {}
    with open_memory_reader(path) as reader:
        assert reader.remembered_values() == []  # the latest session is on physics
        assert [one.variable for one in reader.remembered_values("symbolic")] == ["cup"]


def test_only_new_values_and_old_ages_are_written(path: Path) -> None:
    def writes(memory: Memory, *sightings: Sighting) -> int:
        before = memory._database.total_changes
        memory.note_sightings(sightings)
        return memory._database.total_changes - before

    with open_memory(path, Identity(uuid4(), "chef", "", 1), "physics") as memory:
        assert writes(memory, seen(HERE), seen(True, name="lid")) == 2
        assert writes(memory, seen(HERE, 2.0), seen(False, 2.0, name="lid")) == 1
        assert writes(memory, seen(HERE, 1.0 + REFRESH_S)) == 1
        assert writes(memory) == 0


def test_a_variable_can_be_forgotten(path: Path) -> None:
    session(path, [seen(HERE), seen(True, name="lid")])
    assert forget(path.parent, path, filter_by_variable("cup")).sightings == 1
    with open_memory_reader(path) as reader:
        assert [one.variable for one in reader.remembered_values()] == ["lid"]


@pytest.mark.parametrize(
    ("values", "usual"),
    [
        ([HERE], (HERE, 1)),
        ([HERE, FAR, NEAR], (NEAR, 2)),
        ([True, False, False], (False, 2)),
        (["red", "blue"], ("blue", 1)),  # of equally frequent ones the latest
        ([[0.1, 0.2], [0.1, 0.2], [5.0]], ([0.1, 0.2], 2)),
    ],
)
def test_the_usual_value_is_the_most_frequent_one(values: list[object], usual: tuple[object, int]) -> None:
    assert usual_value(values) == usual


def test_only_what_is_known_was_seen() -> None:
    world = world_from_readings(STATE, {"dumpling_cooked": Reading(True, 3.0)}, 3.0)
    (one,) = sightings_of(world, STATE)
    assert (one.variable, one.value, one.time, one.uncertainty) == ("dumpling_cooked", True, 3.0, None)


def test_a_value_from_memory_is_no_sighting() -> None:
    name = "wrapper_aligned"
    world = world_from_readings(STATE, {name: Reading(True, 1.0)}, 1.0)
    assert [one.variable for one in sightings_of(world, STATE)] == [name]
    recalled = {**STATE, name: replace(STATE[name], is_recalled=True)}
    assert list(sightings_of(world, recalled)) == []
