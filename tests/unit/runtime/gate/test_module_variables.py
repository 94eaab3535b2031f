"""Conditions of a module read what it measures itself, and nobody else's decision depends on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import nan
from typing import Any

import pytest

from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.ports import ColumnNames, Reading, Readings, Snapshot
from tests.unit.runtime import bench
from tests.unit.runtime.kettle import (
    LOOK,
    NOW,
    OWN,
    WAIT,
    configuration,
    decide,
    of_one_moment,
    of_the_site,
    one_by_one,
)

Given = Callable[[Mapping[str, Any]], Readings]
STRANGE = (None, nan, 7.0, -1, "hot", [True], (True, False), b"", 10**400)


@pytest.mark.parametrize("mode", GateMode)
@pytest.mark.parametrize("given", [one_by_one, of_one_moment])
def test_an_envelope_over_own_variables_is_decided(mode: GateMode, given: Given) -> None:
    assert decide(WAIT, given(OWN), mode).kind is DecisionKind.ALLOW
    empty = decide(WAIT, given({**OWN, "kettle.water_level": 0.0}), mode)
    assert bench.codes(empty) == [("AE730", "wait"), ("AE731", "wait")]
    low = decide(WAIT, given({**OWN, "kettle.water_level": 0.015}), mode)
    assert bench.codes(low) == [("AE730", "wait")]


@pytest.mark.parametrize("mode", GateMode)
@pytest.mark.parametrize("given", [one_by_one, of_one_moment])
@pytest.mark.parametrize(
    ("value", "code"),
    [(nan, "AE704"), ("hot", "AE704"), (True, "AE704"), (0.31, "AE705"), (-0.1, "AE705"), ([0.1], "AE704")],
)
def test_a_malformed_own_value_is_denied_where_a_condition_needs_it(
    mode: GateMode, given: Given, value: Any, code: str
) -> None:
    denied = decide(WAIT, given({**OWN, "kettle.water_level": value}), mode)
    assert bench.codes(denied) == [(code, "kettle.water_level")]


@pytest.mark.parametrize("mode", GateMode)
def test_an_own_value_is_measured_and_fresh_where_a_condition_needs_it(mode: GateMode) -> None:
    level = "kettle.water_level"
    missing = {name: one for name, one in one_by_one(OWN).items() if name != level}
    assert bench.codes(decide(WAIT, missing, mode)) == [("AE703", level)]
    for time, code in ((NOW - 60.5, "AE706"), (NOW + 0.5, "AE707"), (nan, "AE704")):
        old = {**one_by_one(OWN), level: Reading(0.125, time)}
        assert bench.codes(decide(WAIT, old, mode)) == [(code, level)]
    at_the_limit = {**one_by_one(OWN), level: Reading(0.125, NOW - 60.0)}
    assert decide(WAIT, at_the_limit, mode).kind is DecisionKind.ALLOW


@pytest.mark.parametrize("mode", GateMode)
def test_measurements_of_a_module_change_no_decision_about_another(mode: GateMode) -> None:
    expected = decide(LOOK, one_by_one({}), mode, alone=True)
    assert expected.kind is DecisionKind.ALLOW
    for value in STRANGE:
        for name in (*OWN, "absent.module"):
            own = {**OWN, name: value}
            assert decide(LOOK, one_by_one(own), mode) == expected
            assert decide(LOOK, of_one_moment(own), mode) == expected
            odd: Any = {**one_by_one(OWN), name: value}  # no reading at all
            assert decide(LOOK, odd, mode) == expected
            late = {**one_by_one(OWN), name: Reading(True, NOW + 1)}
            assert decide(LOOK, late, mode) == expected


def _same_order(*several: Mapping[str, Any]) -> list[Snapshot]:
    """Snapshots as a plant takes them tick by tick: with one object of names, so that their cache is used."""
    order = ColumnNames({**of_the_site(), **OWN})
    return [
        Snapshot(order, tuple({**of_the_site(), **own}[name] for name in order.names), NOW) for own in several
    ]


@pytest.mark.parametrize("strange", ["much", nan, [0.125]])
def test_a_malformed_value_of_a_moment_hides_no_earlier_one(strange: Any) -> None:
    """The cache of snapshots keeps the scalars of values that stay; not those of one that is malformed."""
    level = "kettle.water_level"
    full, broken, after = _same_order(
        OWN, {**OWN, level: strange}, {**OWN, "kettle.filled": False, level: 0.0}
    )
    assert decide(WAIT, full).kind is DecisionKind.ALLOW
    assert bench.codes(decide(WAIT, broken)) == [("AE704", level)]
    assert decide(LOOK, broken).kind is DecisionKind.ALLOW
    assert bench.codes(decide(WAIT, after)) == [("AE730", "wait"), ("AE731", "wait")]
    assert decide(WAIT, full).kind is DecisionKind.ALLOW


def test_measurements_of_modules_need_no_slow_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """A value of another module that is missing, malformed or of an absent module costs no time."""
    slow = "aeros.runtime.gate.gate._Decider._decide_slow_path"
    monkeypatch.setattr(slow, lambda *_: pytest.fail("decided slowly"))
    fresh = CompiledGate(configuration())
    usage = {quota.id: 0 for quota in configuration().site.quotas}
    strange = {**OWN, "kettle.water_level": "much"}
    some = one_by_one({"kettle.water_level": 0.125})
    for readings in (one_by_one(OWN), one_by_one(strange), some, *_same_order(OWN, strange, OWN)):
        caller = replace(LOOK[0], inputs={"hand_speed": 0.25})
        decision = fresh.decide(caller, readings, LOOK[1], NOW, usage)
        assert decision.kind is DecisionKind.ALLOW


def test_a_configuration_has_the_variables_of_its_modules_and_no_others() -> None:
    both, alone = configuration(), configuration(alone=True)
    assert both.site.state.keys() - alone.site.state.keys() == OWN.keys()
    assert alone.site.state.keys() == of_the_site().keys()
    assert both.site.digest == alone.site.digest
    assert both.site.module_variables - alone.site.module_variables == OWN.keys()
    assert both.site.rule_variables.keys() == alone.site.rule_variables.keys()
