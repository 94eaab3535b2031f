"""Corrupted whole numbers and histories: never ALLOW, always a reason, never an exception.

A history is a reading like any other, under the text of its condition as a name.
`AEROS_FUZZ=1000000 pytest tests/property/test_gate_corruption_of_counts.py` corrupts a million.
"""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.decision import Caller, DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.ports import Reading
from aeros.runtime.proving import prove_configuration
from aeros.skill import Action
from tests.differential.gate.gate_oracle import admits
from tests.differential.gate.test_gate_fast_path import differs
from tests.property.test_gate_corruption import ALIEN, COUNT, EvilInt
from tests.unit.runtime.bench import NOW, Request

DATA = Path(__file__).parents[1] / "unit" / "runtime" / "data"
WHOLE = (0, 1, 2, 2.0, -0.0, 3, 5, 6, 9, 9.0)
NOT_WHOLE = (2.5, 0.5, 5e-324, 1e-9, 1.9999999999999998, 9.5, -1, -1.0, 10, 2**53, 1e300)
PRESSES = "count within 60 s (pressed and (not (previously pressed)))"
NEAR = "once within 5 s (human_distance < 1 m)"


@cache
def counting() -> Configuration:
    return prove_configuration([DATA / "counting"], DATA / "counts.yaml", certified=False)[0]


@cache
def kept() -> tuple[str, ...]:
    """The names of the histories that a runtime keeps."""
    return tuple(sorted(HistoryTracker(counting().site).names))


@cache
def gate(mode: GateMode = GateMode.COMPILED) -> CompiledGate:
    return CompiledGate(counting(), mode)


def state(now: float = NOW, **changed: Any) -> dict[str, Reading]:
    """Return what is measured, and the histories that a runtime keeps of it."""
    values = {"human_distance": 3.0, "pressed": False, "pieces": 2, "filled": (1, 2), **changed}
    measured = {name: Reading(value, now) for name, value in values.items()}
    return looked_back(HistoryTracker(counting().site), measured, now)


def looked_back(histories: HistoryTracker, measured: dict[str, Reading], now: float) -> dict[str, Reading]:
    """Return what is measured, and the values of the histories then."""
    known = histories.advance(measured, now)
    return measured | {name: Reading(value, now) for name, value in known.items()}


def request(many: Any = 2, most: Any = 5, **changed: Any) -> Request:
    caller = Caller("counting", "feed", {"most": most})
    return Request(caller, state(**changed), Action("feed", {"many": many, "speed": 0.25}), usage={})


def places(base: Request, value: Any) -> list[Request]:
    """The request with `value` in each place of a whole number or a history."""
    readings, (left, right) = base.readings, base.readings["filled"].value
    found = [replace(base, action=base.action._replace(parameters={**base.action.parameters, "many": value}))]
    found += [replace(base, caller=replace(base.caller, inputs={"most": value}))]
    for name in ("pieces", *kept()):
        found.append(replace(base, readings={**readings, name: Reading(value, NOW)}))
    for pair in ((value, right), [left, value]):
        found.append(replace(base, readings={**readings, "filled": Reading(pair, NOW)}))
    return found


def denied(asked: Request) -> None:
    for mode in GateMode:
        decision = asked.decided_by(gate(mode))
        assert decision.kind is DecisionKind.DENY, asked
        assert decision.reasons
        assert decision.action is None


def test_the_base_is_allowed_and_has_the_histories_that_it_should() -> None:
    assert {PRESSES, NEAR} <= set(request().readings)
    for mode in GateMode:
        assert request().decided_by(gate(mode)).kind is DecisionKind.ALLOW


@pytest.mark.parametrize("many", [2, 2.0])
def test_a_whole_number_is_taken_as_either_type_and_executed_as_a_double(many: Any) -> None:
    decision = request(many=many, pieces=many).decided_by(gate())
    assert decision.action is not None
    assert repr(decision.action.parameters["many"]) == "2.0"


@pytest.mark.parametrize("value", [2.5, True, False, EvilInt(2), "2", None, 5e-324, float("nan")], ids=repr)
def test_no_field_accepts_a_fraction_for_a_whole_number(value: Any) -> None:
    for asked in places(request(), value):
        is_truth = asked.readings.get(NEAR) == Reading(value, NOW) and type(value) is bool
        previous = asked.readings.get("previously pressed") == Reading(value, NOW) and type(value) is bool
        if not is_truth and not previous:
            denied(asked)


@pytest.mark.parametrize("alien", ALIEN, ids=lambda one: type(one).__name__)
def test_no_alien_is_taken_for_a_count_or_a_history(alien: Any) -> None:
    for asked in places(request(), alien):
        denied(asked)


@pytest.mark.parametrize("history", [PRESSES, NEAR])
def test_a_history_must_be_there_of_now_and_under_its_own_name(history: str) -> None:
    asked = request()
    rest = {name: one for name, one in asked.readings.items() if name != history}
    kept = asked.readings[history]
    for readings in (
        rest,
        {**rest, history: Reading(kept.value, NOW + 0.001)},
        {**rest, history: Reading(kept.value, None)},  # type: ignore[arg-type]
        {**rest, history.replace("within", "Within"): kept},
        {**rest, history: kept.value},
        {**rest, history: kept, "once within 6 s (human_distance < 1 m)": kept},
    ):
        denied(replace(asked, readings=readings))


def test_after_a_clock_that_goes_back_the_gate_lacks_the_histories() -> None:
    histories = HistoryTracker(counting().site)
    asked = request()
    measured = {name: one for name, one in asked.readings.items() if name not in histories.names}
    assert histories.advance(measured, NOW).keys() == histories.names
    earlier = {name: Reading(one.value, NOW - 1.0) for name, one in measured.items()}
    for now in (NOW - 1.0, NOW - 2.0, float("nan")):
        readings = looked_back(histories, earlier, now)
        decision = replace(asked, readings=readings, now=now).decided_by(gate())
        assert decision.kind is DecisionKind.DENY
        assert decision.reasons


def test_no_corrupted_count_or_history_is_allowed_unless_the_definition_says_so() -> None:
    chance = random.Random(5)  # noqa: S311 - repeats, and guards nothing
    bases = [request(), request(many=0, most=0), request(human_distance=0.5), request(pieces=4, pressed=True)]
    seen: Counter[str] = Counter()
    for _ in range(COUNT):
        base = chance.choice(bases)
        kind = chance.choice([ALIEN, WHOLE, NOT_WHOLE, (True, False)])
        asked = chance.choice(places(base, chance.choice(kind)))
        if chance.random() < 0.2:
            now = chance.choice([NOW - 0.05, NOW + 0.05, NOW + 0.2, float("inf"), True])
            asked = replace(asked, now=now)
        decision = asked.decided_by(gate())
        seen[decision.kind.value] += 1
        assert (decision.kind is DecisionKind.ALLOW) is admits(counting(), asked), asked
        assert bool(decision.reasons) is (decision.kind is not DecisionKind.ALLOW)
        assert not differs(gate(), asked)
    assert seen["DENY"] > COUNT / 2
    assert seen["ALLOW"] > COUNT / 20
