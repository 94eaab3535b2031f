"""Rules on the past, from the plant's readings to the gate, the monitor and the record.

Values of histories are held to the definition in tests/differential/gate/test_past_time.py.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from math import nan
from pathlib import Path
from typing import Any

import pytest

from aeros.runtime.audit.log import AuditLog
from aeros.runtime.execution.executor import Executor
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate, GateMode
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.ports import ColumnNames, Reading, Snapshot, StepRequest, StepResult, StepStatus
from aeros.runtime.skills.in_process_run import run_in_process
from aeros.sim.fake import FakePlant
from aeros.spec.elaborate.past_time import HistoryCollector
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, IntegerType, Type
from aeros.spec.expr.units import NUMBER
from aeros.spec.model.ecm import ActionCondition
from aeros.spec.model.policy import Access
from aeros.spec.model.rules import Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import History
from tests.unit.runtime.conftest import METRES, SPAN, declare

CODE = """
from aeros.skill import act

def lift(observed, inputs):
    yield act("move")
"""
NAME = "once within 5 s (human_distance < 2 m)"
STEP = 0.0625  # s, less than a reading speaks for


class Bench:
    def __init__(self, site: Site, ecm: Any, log: AuditLog) -> None:
        near = t.Compare("<", site.state["human_distance"].variable, t.Literal(Fraction(2), METRES))
        histories = HistoryCollector()
        far = t.Not(histories.replace_past_terms(t.Since(t.TRUE, near, Fraction(5)), SPAN))
        memory = Rule("memory", f"not {NAME}", "", "", {"move": far}, {}, SPAN, SPAN)
        arm = Access(actuators=frozenset({"arm"}))
        site = replace(
            site, rules=(*site.rules, memory), histories=histories.collected, access=arm, quotas=()
        )
        anything = ActionCondition(t.TRUE, "true", SPAN)
        skill = replace(ecm.skills["lift"], envelope={"move": anything})
        ecm = replace(ecm, skills={"lift": skill}, permitted_actions={"move": anything}, requested_access=arm)
        self.configuration = configuration = Configuration(site, {"handling": ecm}, {}, "c" * 64)
        self.plant = FakePlant({"tool_position": (0.3, 0.0, 0.5), "human_distance": 20.0, "holding": False})
        self.plant.duration = STEP
        self.executor = Executor(
            configuration, CompiledGate(configuration, GateMode.CHECKED), self.plant, log, run_in_process
        )

    def lift(self) -> StepResult:
        return self.executor.run_step(StepRequest("handling", "lift", {}))

    def lift_at(self, time: float, distance: float) -> StepResult:
        self.plant.time, self.plant.values["human_distance"] = time, distance
        return self.lift()


@pytest.fixture
def bench(site: Site, make_ecm: Any, tmp_path: Path) -> Iterator[Bench]:
    with AuditLog(tmp_path / "audit.jsonl") as log:
        yield Bench(site, make_ecm(CODE), log)


def test_a_past_condition_is_remembered_as_long_as_the_rule_says(bench: Bench) -> None:
    assert bench.lift_at(0.0, 20.0).status is StepStatus.FINISHED
    denied = bench.lift_at(STEP, 1.5)
    assert denied.reason.startswith("AE750 memory")
    ticks = 80  # of `STEP` in 5 s
    for tick in range(2, ticks + 2):
        assert bench.lift_at(tick * STEP, 20.0).status is StepStatus.DENIED
    assert bench.lift_at((ticks + 2) * STEP, 20.0).status is StepStatus.FINISHED


def test_an_unobserved_time_is_unknown_and_denied_until_it_has_left_the_window(bench: Bench) -> None:
    assert bench.lift_at(0.0, 20.0).status is StepStatus.FINISHED
    denied = bench.lift_at(3.0, 20.0)  # anybody may have come and gone
    assert denied.reason == f"AE703 {NAME}: `{NAME}` is not measured"
    for tick in range(1, 81):
        assert bench.lift_at(3.0 + tick * STEP, 20.0).status is StepStatus.DENIED
    assert bench.lift_at(3.0 + 81 * STEP, 20.0).status is StepStatus.FINISHED


def test_a_reading_without_a_greatest_age_is_valid_at_its_own_time_only(
    site: Site, make_ecm: Any, tmp_path: Path
) -> None:
    state = {**site.state, "human_distance": replace(site.state["human_distance"], max_age=None)}
    with AuditLog(tmp_path / "audit.jsonl") as log:
        bench = Bench(replace(site, state=state), make_ecm(CODE), log)
        assert bench.lift_at(0.0, 20.0).status is StepStatus.FINISHED
        assert bench.lift_at(STEP, 20.0).reason == f"AE703 {NAME}: `{NAME}` is not measured"


def test_a_motion_is_stopped_by_a_history_that_changes_while_it_runs(bench: Bench) -> None:
    bench.plant.during = [{}, {"human_distance": 1.5}]
    ended = bench.lift()
    assert (ended.status, ended.reason) == (
        StepStatus.STOPPED,
        "monitor:memory: once within 5 s (human_distance < 2 m) is true",
    )
    bench.plant.during = []
    assert bench.lift_at(STEP, 20.0).reason.startswith("AE750 memory")  # seen by a tick alone


def test_a_plant_cannot_supply_the_value_of_a_history(bench: Bench) -> None:
    bench.plant.values[NAME] = False
    assert bench.lift_at(0.0, 1.5).reason.startswith("AE750 memory")


def test_the_record_holds_the_histories_of_the_decision(bench: Bench, tmp_path: Path) -> None:
    bench.lift_at(0.0, 1.5)
    lines = (tmp_path / "audit.jsonl").read_text(encoding="utf-8").splitlines()
    (decision,) = [one for one in map(json.loads, lines) if one["event"] == "decision"]
    assert decision["details"]["state"][NAME] == [True, 0.0]


# The tracker alone: samples as `(time, readings)`, and what is known of one history after each.

_HELD = "held before"
_Past = t.Previously | t.Since | t.Occurrences


def _tracked(site: Site, term: _Past, *samples: tuple[float, dict[str, Any]]) -> list[bool | int | None]:
    """Values of a history after each sample; None where it is unknown."""
    of_count = isinstance(term, t.Occurrences)
    type_: Type = IntegerType(NUMBER) if of_count else BOOL
    bounds = (Fraction(0), Fraction(2)) if of_count else None
    history = History(declare(_HELD, type_, t.VariableRole.STATE, range=bounds), term)
    tracker = HistoryTracker(replace(site, histories=(history,)))
    found = []
    for now, values in samples:
        measured = {name: Reading(value, now) for name, value in values.items()}
        reading = tracker.update(measured, now).get(_HELD)
        found.append(None if reading is None else reading.value)
    return found


def _near_and_holding(site: Site) -> t.Term:
    near = t.Compare("<", site.state["human_distance"].variable, t.Literal(Fraction(2), METRES))
    return t.conjunction(near, site.state["holding"].variable)


_NEAR = {"human_distance": 1.0, "holding": True}
_FAR = {"human_distance": 3.0, "holding": True}


def test_the_previous_sample_is_that_of_all_variables(site: Site) -> None:
    term = t.Previously(_near_and_holding(site))
    samples = [(0.0, _NEAR), (0.0625, _FAR), (0.125, {"human_distance": 1.0}), (0.1875, _NEAR), (0.25, _FAR)]
    assert _tracked(site, term, *samples) == [False, True, False, None, True]


@pytest.mark.parametrize("missing", ["human_distance", "holding"])
def test_a_time_at_which_any_variable_is_not_measured_is_a_gap(site: Site, missing: str) -> None:
    term = t.Since(t.TRUE, _near_and_holding(site), Fraction(1))
    partly = {name: value for name, value in _FAR.items() if name != missing}
    samples = [(0.0, _FAR), (0.0625, partly), (0.125, _FAR), (1.0625, _FAR), (1.125, _FAR)]
    assert _tracked(site, term, *samples)[:3] == [False, None, None]
    steps = [(0.125 + 0.0625 * tick, _FAR) for tick in range(1, 18)]
    known = _tracked(site, term, *samples[:3], *steps)[3:]
    assert known == [None] * known.count(None) + [False] * known.count(False)
    assert 14 <= known.count(None) <= 16


def test_an_occurrence_before_a_gap_still_counts_within_its_window(site: Site) -> None:
    near = _near_and_holding(site)
    samples = [(0.0, _NEAR), (3.0, _FAR), (5.0, _FAR), (5.0625, _FAR), (9.0, _FAR)]
    assert _tracked(site, t.Since(t.TRUE, near, Fraction(5)), *samples) == [True, True, True, None, None]
    assert _tracked(site, t.Since(near, near, Fraction(5)), *samples)[:2] == [True, False]


def test_a_history_of_no_variables_needs_no_readings(site: Site) -> None:
    samples: list[tuple[float, dict[str, Any]]] = [(0.0625 * tick, {}) for tick in range(6)]
    assert _tracked(site, t.Since(t.FALSE, t.TRUE, None), *samples) == [True] * 6
    assert _tracked(site, t.Since(t.TRUE, t.FALSE, None), *samples) == [False] * 6
    counts = _tracked(site, t.Occurrences(t.TRUE, Fraction(1, 16)), *samples)
    assert counts == [1, 2, 2, 2, 2, 2]


def test_a_condition_may_read_a_count(site: Site) -> None:
    """A count is compared, and computed with, as a number."""
    counted = t.Occurrences(_near_and_holding(site), Fraction(1, 4))
    histories = HistoryCollector()
    twice = t.Compare("<=", t.Literal(Fraction(2), IntegerType(NUMBER)), counted)
    histories.replace_past_terms(t.Since(t.TRUE, twice, None), SPAN)
    tracker = HistoryTracker(replace(site, histories=histories.collected))
    ever = []
    for tick in range(4):
        values = _NEAR if tick in {1, 2} else _FAR
        now = 0.0625 * tick
        updated = tracker.update({name: Reading(value, now) for name, value in values.items()}, now)
        ever.append(updated[histories.collected[-1].declared.name].value)
    assert ever == [False, False, True, True]


def test_a_condition_must_have_held_ever_since(site: Site) -> None:
    term = t.Since(site.state["holding"].variable, _near_and_holding(site), None)
    dropped = {**_FAR, "holding": False}
    samples = [(0.0, _FAR), (0.0625, _NEAR), (0.125, _FAR), (0.1875, dropped), (0.25, _FAR), (0.3125, _NEAR)]
    assert _tracked(site, term, *samples) == [False, True, True, False, False, True]


def test_samples_are_counted_within_the_window_and_up_to_the_limit(site: Site) -> None:
    term = t.Occurrences(_near_and_holding(site), Fraction(1, 4))
    samples = [(0.0625 * tick, _NEAR if tick < 2 else _FAR) for tick in range(7)]
    assert _tracked(site, term, *samples) == [1, 2, 2, 2, 2, 1, 0]
    many = [(0.0625 * tick, _NEAR) for tick in range(4)]
    assert _tracked(site, term, *many) == [1, 2, None, None]


@pytest.mark.parametrize("time", [nan, "now", None, 0.0, 2.0**54])
def test_nothing_is_known_at_a_time_that_no_clock_shows_next(site: Site, time: Any) -> None:
    term = t.Since(t.TRUE, _near_and_holding(site), Fraction(1))
    samples = [(1.0, _FAR), (time, _NEAR), (1.0625, _FAR)]
    assert _tracked(site, term, *samples) == [False, None, None]


@pytest.mark.parametrize("odd", [None, 3.0, Reading("near", 1.0), Reading(1.0, 2.0), tuple.__new__(Reading)])
def test_a_reading_that_is_no_reading_is_missing(site: Site, odd: Any) -> None:
    near = t.Compare("<", site.state["human_distance"].variable, t.Literal(Fraction(2), METRES))
    history = History(declare(_HELD, BOOL, t.VariableRole.STATE), t.Since(t.TRUE, near, Fraction(1)))
    tracker = HistoryTracker(replace(site, histories=(history,)))
    assert tracker.update({"human_distance": odd}, 1.0).keys() == {"human_distance"}


def test_a_site_without_histories_adds_nothing_to_the_readings(site: Site) -> None:
    tracker, measured = HistoryTracker(site), {"holding": Reading(True, 1.0)}
    updated = tracker.update(measured, 1.0)
    assert updated == measured
    assert updated is not measured
    snapshot = Snapshot(ColumnNames(["holding"]), (True,), 1.0)
    assert tracker.update(snapshot, 1.0) is snapshot
    assert tracker.advance(measured, 1.0) == {}
