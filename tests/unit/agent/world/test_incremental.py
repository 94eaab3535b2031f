"""Looking at what differs of a moment shows the world that looking at all of it shows."""

from __future__ import annotations

from math import nan
from random import Random
from typing import Any

from aeros.agent.world.incremental import IncrementalWorld
from aeros.agent.world.world import world_from_readings
from aeros.runtime.ports import ColumnNames, Reading, Snapshot
from tests.unit.agent.dumplings import STATE

_VALUES: tuple[Any, ...] = (
    0.5, 1, nan, True, False, None, "pot", "floor", (0.1, 0.0, 1.0), (1.0, -3.0), [0.1, 0.0, 1.0], {"pot": 1},
)  # fmt: skip


def test_worlds_are_those_of_the_readings_one_by_one() -> None:
    chance = Random(17)  # noqa: S311 - a test, the same every time
    measuring = IncrementalWorld(STATE)
    orders = [ColumnNames(STATE), ColumnNames({*STATE, "mood"}), ColumnNames(sorted(STATE)[1:])]
    values: dict[str, Any] = dict.fromkeys([*STATE, "mood"], False)
    now, order = 0.0, orders[0]
    for _ in range(3000):
        now += chance.choice((0.0, 0.5))
        if chance.random() < 0.1:
            order = chance.choice(orders)
        values[chance.choice(list(values))] = chance.choice(_VALUES)
        time = chance.choice((now, now, now, now - 1.0, now + 1.0, nan))
        moment = Snapshot(order, tuple(values[name] for name in order.names), time)
        assert measuring.world(moment, now) == world_from_readings(STATE, dict(moment), now)
        if chance.random() < 0.1:
            other: dict[str, Any] = {"area": Reading("pot", now)}
            assert measuring.world(other, now) == world_from_readings(STATE, other, now)


def test_a_list_that_has_changed_is_seen_as_it_is_now() -> None:
    measuring, place = IncrementalWorld(STATE), [0.1, 0.0, 1.0]
    order = ColumnNames(STATE)
    moment = Snapshot(order, tuple(place if name == "tool" else None for name in order.names), 0.0)
    first = measuring.world(moment, 0.0)
    place[0] = 0.2
    assert measuring.world(moment, 0.0) == world_from_readings(STATE, dict(moment), 0.0) != first
