"""The journal: every event goes to the record, to the observer and to memory, in this order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from aeros.agent.execution.journal import AgentEvent, Journal
from tests.differential.real_loop import Forgetful
from tests.unit.agent.fake_runtime import FakeRuntime


class Listeners:
    """Journal whose record, memory and observer note what they receive, in order."""

    def __init__(self, *, is_observed: bool = True, fails: str = "") -> None:
        self.places: list[tuple[str, Any]] = []
        listeners = self

        class Runtime(FakeRuntime):
            def note(self, event: str, details: Mapping[str, Any]) -> None:
                listeners.hear("record", (event, dict(details)))

        class Memory(Forgetful):
            def add_event(self, time: float, kind: str, details: Mapping[str, Any]) -> None:
                listeners.hear("memory", (time, kind, dict(details)))

        self.fails = fails
        observer = (lambda event: self.hear("observer", event)) if is_observed else None
        self.journal = Journal(Runtime(), Memory(), observer)

    def hear(self, place: str, what: Any) -> None:
        if place == self.fails:
            raise OSError("disk full")
        self.places.append((place, what))


def test_an_event_is_in_the_record_before_anybody_else_knows_of_it() -> None:
    listeners = Listeners()
    listeners.journal.record("replan", "re-plan 2: denied", number=2)
    event = AgentEvent("replan", "re-plan 2: denied", {"number": 2}, 100.0)
    assert listeners.places == [
        ("record", ("replan", {"number": 2})),
        ("observer", event),
        ("memory", (100.0, "replan", {"number": 2})),
    ]


def test_memory_keeps_no_event_of_a_step_as_an_episode_holds_it() -> None:
    listeners = Listeners()
    listeners.journal.record_step("step-ended", "", skill="m.s")
    assert listeners.places == [
        ("record", ("step-ended", {"skill": "m.s"})),
        ("observer", AgentEvent("step-ended", "", {"skill": "m.s"}, 100.0)),
    ]


def test_without_an_observer_record_and_memory_are_written_all_the_same() -> None:
    listeners = Listeners(is_observed=False)
    listeners.journal.record("plan", "prepare")
    assert [place for place, _ in listeners.places] == ["record", "memory"]


@pytest.mark.parametrize(("place", "before"), [("record", []), ("memory", ["record", "observer"])])
def test_a_place_that_cannot_be_written_stops_the_agent(place: str, before: list[str]) -> None:
    listeners = Listeners(fails=place)
    with pytest.raises(OSError, match="disk full"):
        listeners.journal.record("plan", "prepare")
    assert [one for one, _ in listeners.places] == before
