"""Snapshots give the same results everywhere as the same readings one by one."""

from __future__ import annotations

from dataclasses import replace
from math import nan
from random import Random
from typing import Any

from aeros.runtime.execution.step import ObservationFilter
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.ports import ColumnNames, Snapshot
from aeros.runtime.records.encode_decisions import IncrementalReadingsEncoder
from aeros.runtime.records.records import encode_readings
from tests.unit.runtime.bench import (
    ALLOWED,
    NOW,
    STATE,
    codes,
    configuration,
    denied,
    gate,
    measured,
    request,
)

_VALUES: tuple[Any, ...] = (
    0.0, -0.0, 0.5, 1, 3.0, 1e9, nan, True, False, None, "brush", "spoon", (0.25, -0.5), (0.25, nan),
    (True, False), (0.25, 0.0, 0.25), [0.25, 0.0, 0.25], [[1.0]], 10**400,
)  # fmt: skip
_TIMES: tuple[Any, ...] = (NOW, NOW, NOW, NOW - 0.01, NOW - 1000.0, NOW + 1.0, 100, nan, None)

_ORDER = ColumnNames(STATE)


def _snapshot(values: dict[str, Any], order: ColumnNames = _ORDER, time: Any = NOW) -> Snapshot:
    return Snapshot(order, tuple(values[name] for name in order.names), time)


def test_the_gate_decides_snapshots_like_individual_readings() -> None:
    chance = Random(11)  # noqa: S311 - a test, the same every time
    afresh = CompiledGate(configuration())
    fewer = ColumnNames(set(STATE) - {"wind"})
    more = ColumnNames({*STATE, "mood"})
    allowed = 0
    values: dict[str, Any] = {**STATE, "mood": 1.0}
    for _ in range(4000):
        if chance.random() < 0.3:
            values = {**STATE, "mood": 1.0}
        else:
            values = {**values, chance.choice(list(STATE)): chance.choice((*_VALUES, *STATE.values()))}
        order, time = chance.choice((_ORDER, _ORDER, _ORDER, fewer, more)), chance.choice(_TIMES)
        one_by_one = measured({name: values[name] for name in order.names}, time)
        asked = request(*chance.choice(ALLOWED))
        together = replace(asked, readings=_snapshot(values, order, time)).decided_by(afresh)
        assert together == replace(asked, readings=one_by_one).decided_by(gate())
        allowed += not codes(together)
    assert 200 < allowed < 3800


def test_an_uninitialized_snapshot_is_denied() -> None:
    assert denied(replace(request(), readings=object.__new__(Snapshot))) == [("AE701", "state")]


def test_snapshots_are_encoded_like_individual_readings() -> None:
    chance = Random(12)  # noqa: S311 - a test, the same every time
    encoder = IncrementalReadingsEncoder()
    values = dict(STATE)
    orders = (_ORDER, ColumnNames(set(STATE) - {"wind"}), ColumnNames(["load"]))
    for _ in range(3000):
        values[chance.choice(list(STATE))] = chance.choice(_VALUES)
        snapshot = _snapshot(values, chance.choice(orders), chance.choice(_TIMES))
        if chance.random() < 0.2:
            assert encoder.encode(dict(snapshot)) == encode_readings(dict(snapshot))
        assert encoder.encode(snapshot) == encode_readings(dict(snapshot))


def test_a_skill_sees_the_same_of_snapshots_and_individual_readings() -> None:
    chance = Random(13)  # noqa: S311 - a test, the same every time
    (ecm,), site = configuration().modules.values(), configuration().site
    sensed, other = ObservationFilter(ecm, site), ObservationFilter(ecm, site)
    values = dict(STATE)
    seen: dict[str, Any] = {}
    for _ in range(500):
        values[chance.choice(list(STATE))] = chance.choice((0.5, True, "brush"))
        order, time = chance.choice((_ORDER, ColumnNames(set(STATE) - {"wind"}))), chance.choice(_TIMES[:-1])
        # Whatever was done to what it saw before.
        seen.clear()
        seen = sensed.observe(_snapshot(values, order, time), NOW)
        assert seen == other.observe(dict(_snapshot(values, order, time)), NOW)
