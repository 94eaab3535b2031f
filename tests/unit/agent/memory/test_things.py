"""Each attribute of a thing is remembered with its own age, and under its kind."""

from __future__ import annotations

from pathlib import Path
from uuid import uuid4

from aeros.agent.identity import Identity
from aeros.agent.memory.deletion import filter_by_variable, forget
from aeros.agent.memory.sightings import Sighting
from aeros.agent.memory.store import open_memory
from aeros.agent.memory.things import remembered_things, sightings_of_things
from aeros.agent.world.things import ThingState
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import Reading
from tests.unit.agent.world.test_things import DECLARED


def sightings(thing: ThingState) -> list[Sighting]:
    readings = {"place": Reading((0.5, 0.0, 0.0), 3.0)}
    return list(sightings_of_things([thing], world_from_readings(DECLARED, readings, 4.0), DECLARED))


def test_numbers_have_the_time_of_their_variable_and_relations_that_of_the_world() -> None:
    can = ThingState(
        *("fetch.object", "can", (0.5, 0.0, 0.0), None, {"position": "place"}, False, {"on tray": True}),
        {"position": ("place",), "held": ("wrapped",), "on tray": ("place", "tray")},
    )
    assert [(one.variable, one.value, one.time, one.derived_from) for one in sightings(can)] == [
        ("thing fetch.object can position", [0.5, 0.0, 0.0], 3.0, ("place",)),
        ("thing fetch.object can held", False, 4.0, ("wrapped",)),
        ("thing fetch.object can on tray", True, 4.0, ("place", "tray")),
    ]


def test_a_thing_of_unknown_kind_is_not_remembered() -> None:
    assert sightings(ThingState("fetch.object", None, held=True)) == []


def test_each_kind_keeps_its_own_place_over_sessions(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    can = [
        Sighting("thing fetch.object can position", [1.0, 0.0, 0.0], 1.0, "fetch", 0.01),
        Sighting("thing fetch.object can on tray", True, 1.0, "fetch", None),
    ]
    bottle = [
        Sighting("thing fetch.object bottle held", True, 1.0, "fetch", None),
        Sighting("fetch.object_seen", True, 1.0, "fetch", None),
    ]
    for seen in (can, bottle):
        with open_memory(path, Identity(uuid4(), "chef", "", 1), "symbolic") as memory:
            memory.note_sightings(seen)
            things = remembered_things(memory.remembered_values().values())
    assert [(one.name, one.kind, sorted(one.attributes)) for one in things] == [
        ("fetch.object", "bottle", ["held"]),
        ("fetch.object", "can", ["on tray", "position"]),
    ]
    assert things[1].attributes["position"].session == 1


def test_a_thing_is_forgotten_with_all_its_kinds_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    names = ["thing fetch.object can held", "thing fetch.object bottle held", "thing fetch.objects can held"]
    with open_memory(path, Identity(uuid4(), "chef", "", 1), "symbolic") as memory:
        memory.note_sightings([Sighting(name, True, 1.0, None, None) for name in names])
    forget(tmp_path, path, filter_by_variable("fetch.object"))
    with open_memory(path, Identity(uuid4(), "chef", "", 2), "symbolic") as memory:
        assert list(memory.remembered_values()) == names[2:]


def test_a_variable_of_the_site_is_forgotten_with_older_attributes_of_all_modules(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    seen = [
        Sighting("tray_up", True, 1.0, None, None),
        Sighting("thing fetch.object can held", False, 1.0, None, None),
        Sighting("thing fetch.object can on tray", True, 1.0, None, None, ("fetch.tray_up",)),
    ]
    with open_memory(path, Identity(uuid4(), "chef", "", 1), "symbolic") as memory:
        memory.note_sightings(seen)
    assert forget(tmp_path, path, filter_by_variable("tray_up")).sightings == 2
    with open_memory(path, Identity(uuid4(), "chef", "", 2), "symbolic") as memory:
        assert list(memory.remembered_values()) == ["thing fetch.object can on tray"]


def test_an_attribute_written_again_names_the_variables_that_it_follows_from_now(tmp_path: Path) -> None:
    path, name = tmp_path / "memory.sqlite3", "thing fetch.object can held"
    with open_memory(path, Identity(uuid4(), "chef", "", 1), "symbolic") as memory:
        memory.note_sightings([Sighting(name, False, 1.0, None, None)])
        memory.note_sightings([Sighting(name, True, 2.0, None, None, ("clean.grip",))])
    assert forget(tmp_path, path, filter_by_variable("clean.grip")).sightings == 1


def test_a_variable_is_forgotten_with_all_that_follows_from_it(tmp_path: Path) -> None:
    path = tmp_path / "memory.sqlite3"
    prefix = "thing fetch.object can "
    seen = [
        Sighting("fetch.place", [1.0, 0.0, 0.0], 1.0, None, None),
        Sighting(prefix + "position", [1.0, 0.0, 0.0], 1.0, None, None, ("fetch.kind", "fetch.place")),
        Sighting(prefix + "on tray", True, 1.0, None, None, ("fetch.place_of_tray",)),
        Sighting(
            prefix + "held", False, 1.0, None, None
        ),  # of a memory that did not keep what it follows from
        Sighting("thing clean.sponge sponge held", False, 1.0, None, None),
    ]
    with open_memory(path, Identity(uuid4(), "chef", "", 1), "symbolic") as memory:
        memory.note_sightings(seen)
    assert forget(tmp_path, path, filter_by_variable("fetch.place")).sightings == 3
    with open_memory(path, Identity(uuid4(), "chef", "", 2), "symbolic") as memory:
        assert list(memory.remembered_values()) == ["thing clean.sponge sponge held", prefix + "on tray"]
