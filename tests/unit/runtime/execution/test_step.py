"""Steps of an executor: what their skills may sense, their table, and how they end."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import inf, nan
from types import SimpleNamespace
from typing import Any, cast

import pytest

from aeros.runtime.execution.hold_condition import HoldCondition
from aeros.runtime.execution.step import (
    ActiveMotion,
    ActiveStep,
    ObservationFilter,
    StepTable,
    ending_stopped,
    ending_unheld,
    required_resources,
    resource_capacities,
)
from aeros.runtime.gate.decision import Caller
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.ports import (
    ColumnNames,
    EndedStep,
    MotionCompletion,
    MotionHandle,
    Reading,
    Snapshot,
    StepHandle,
    StepResult,
    StepStatus,
)
from aeros.runtime.skills.in_process_run import InProcessRun, SkillRunResult
from aeros.skill import Inputs, Observation, SkillBody, act
from aeros.spec.model.cause import Cause
from aeros.spec.model.site import Site
from tests.unit.runtime import kettle
from tests.unit.runtime.one_step import MakeBench, twice
from tests.unit.runtime.together import configuration


def test_a_skill_sees_what_its_module_may_sense_while_it_is_fresh(make_bench: MakeBench) -> None:
    seen: list[Observation] = []

    def looking(observed: Observation, inputs: Inputs) -> SkillBody:
        seen.append(observed)
        for stale in (0.0625, 0.11, -0.01):
            bench.plant.reading_age = stale
            seen.append((yield act("move")))

    bench = make_bench(looking)
    bench.submit()
    allowed = {"tool_position": (0.3, 0.0, 0.5), "holding": False}
    assert seen == [allowed, allowed, {}, {}]


@pytest.mark.parametrize(
    ("age", "is_seen"),
    [(0.0, True), (0.09375, True), (0.125, False), (-0.015625, False), (nan, False), (inf, False)],
)
def test_a_reading_is_sensed_up_to_its_greatest_age(
    site: Site, make_ecm: Any, age: float, is_seen: bool
) -> None:
    """Variables of this site may be 0.1 s old."""
    observer = ObservationFilter(make_ecm(""), site)
    assert observer.site is site
    seen = observer.observe({"holding": Reading(True, 4.0 - age)}, 4.0)
    assert seen == ({"holding": True} if is_seen else {})


def test_a_greatest_age_is_compared_exactly(site: Site, make_ecm: Any) -> None:
    # 0.1 is a double just above 1/10 s, and 1.1 - 1.0 is 0.1000...09 s.
    observer = ObservationFilter(make_ecm(""), site)
    assert observer.observe({"holding": Reading(True, 0.0)}, 0.1) == {}
    assert observer.observe({"holding": Reading(True, 0.0)}, 0.09999999999999999) == {"holding": True}
    assert Fraction(0.1) > Fraction(1, 10) > Fraction(0.09999999999999999)


def test_a_reading_of_exactly_the_greatest_age_is_sensed(site: Site, make_ecm: Any) -> None:
    state = {**site.state, "holding": replace(site.state["holding"], max_age=Fraction(1, 8))}
    observer = ObservationFilter(make_ecm(""), replace(site, state=state))
    assert observer.observe({"holding": Reading(True, 1.0)}, 1.125) == {"holding": True}
    assert observer.observe({"holding": Reading(True, 1.0)}, 1.1250000000000002) == {}


@pytest.mark.parametrize("now", [nan, inf, -inf])
def test_without_a_clock_nothing_is_sensed(site: Site, make_ecm: Any, now: float) -> None:
    observer = ObservationFilter(make_ecm(""), site)
    assert observer.observe({"holding": Reading(True, now)}, now) == {}


def _snapshot(order: ColumnNames, time: float, **values: Any) -> Snapshot:
    return Snapshot(order, tuple(values[name] for name in order.names), time)


def test_a_snapshot_is_sensed_as_its_readings_are(site: Site, make_ecm: Any) -> None:
    observer = ObservationFilter(make_ecm(""), site)
    order, other = ColumnNames(["holding", "human_distance"]), ColumnNames(["tool_position", "holding"])
    hand = (0.3, 0.0, 0.5)
    # The module declares no scanner, which measures the distance.
    assert observer.observe(_snapshot(order, 1.0, holding=True, human_distance=2.0), 1.0) == {"holding": True}
    assert observer.observe(_snapshot(order, 2.0, holding=False, human_distance=2.0), 2.0) == {
        "holding": False
    }
    full = _snapshot(other, 3.0, holding=True, tool_position=hand)
    assert observer.observe(full, 3.0) == {"holding": True, "tool_position": hand}
    assert observer.observe(full, 3.0625) == {"holding": True, "tool_position": hand}
    assert observer.observe(full, 3.25) == {}
    assert observer.observe(full, 2.9375) == {}


def test_a_skill_may_change_what_it_was_given(site: Site, make_ecm: Any) -> None:
    observer = ObservationFilter(make_ecm(""), site)
    order = ColumnNames(["holding"])
    snapshot = _snapshot(order, 1.0, holding=True)
    observer.observe(snapshot, 1.0)["holding"] = False
    assert observer.observe(snapshot, 1.0) == {"holding": True}
    again = Snapshot(order, snapshot.column, 2.0)
    assert observer.observe(again, 2.0) == {"holding": True}


@pytest.fixture
def step(make_ecm: Any) -> ActiveStep:
    ecm = make_ecm("")
    return ActiveStep(ecm, ecm.skills["lift"], Caller("handling", "lift", {}), InProcessRun(twice, {}))


def _motion(number: int) -> ActiveMotion:
    return ActiveMotion(MotionHandle(number), ActiveAction(act("move"), {}, 0.0, number), None)


def test_a_step_is_due_while_it_runs_without_a_motion(step: ActiveStep) -> None:
    assert step.name == "handling.lift"
    is_due = [step.is_due]
    step.is_running = True
    is_due.append(step.is_due)
    step.active_motion = _motion(1)
    is_due.append(step.is_due)
    assert is_due == [False, True, False]


def test_a_step_is_finished_by_its_own_skill_alone(step: ActiveStep) -> None:
    is_finished = [step.is_finished]
    for status in (StepStatus.STOPPED, StepStatus.FINISHED):
        step.result = SkillRunResult(status, "")
        is_finished.append(step.is_finished)
    assert is_finished == [False, False, True]


@pytest.mark.parametrize("has_result", [True, False])
def test_a_complaint_of_the_skill_is_added_to_its_result(step: ActiveStep, has_result: bool) -> None:
    def stubborn(observed: Observation, inputs: Inputs) -> SkillBody:
        try:
            yield act("move")
        finally:
            raise ValueError("mine")

    step.run = InProcessRun(stubborn, {})
    step.run.resume({}, 1.0)
    step.result = SkillRunResult(StepStatus.DENIED, "too fast") if has_result else None
    step.close_skill()
    message = "too fast; and its own clean-up raised ValueError: mine"
    assert step.result == (SkillRunResult(StepStatus.DENIED, message) if has_result else None)


def test_a_skill_that_closes_quietly_keeps_its_result(step: ActiveStep) -> None:
    step.result = SkillRunResult(StepStatus.DENIED, "too fast")
    step.close_skill()
    assert step.result == SkillRunResult(StepStatus.DENIED, "too fast")


def test_a_table_numbers_steps_and_says_what_moves(step: ActiveStep) -> None:
    table = StepTable()
    assert not table.is_moving()
    assert (table.add(step), table.add(step)) == (StepHandle(1), StepHandle(2))
    assert (list(table.steps), table.hold_conditions) == ([StepHandle(1), StepHandle(2)], {})
    assert (table.active_motions(), table.is_moving()) == ([], False)
    motion = step.active_motion = _motion(7)
    assert (table.active_motions(), table.is_moving()) == ([motion, motion], True)


def test_results_are_fetched_once_and_the_oldest_first() -> None:
    table = StepTable()
    for number in (2, 1):
        table.results[StepHandle(number)] = StepResult(StepStatus.FINISHED, str(number))
    assert table.next_ended() == EndedStep(StepHandle(2), StepResult(StepStatus.FINISHED, "2"))
    assert table.next_ended() == EndedStep(StepHandle(1), StepResult(StepStatus.FINISHED, "1"))
    assert table.results == {}


def test_a_lost_hold_ends_a_step_with_its_cause() -> None:
    cause = Cause("hold", "handling.lift", "holding")
    part, own = (cast("HoldCondition", SimpleNamespace(place=place)) for place in (1, None))
    assert ending_unheld((part, own), lambda _: None) is None
    expected = SkillRunResult(StepStatus.HOLD_LOST, "handling.lift: holding", causes=(cause,))
    assert ending_unheld((part, own), lambda one: cause if one is own else None) == expected
    of_part = expected._replace(status=StepStatus.CANCELLED, lost_hold=1)
    assert ending_unheld((part, own), lambda _: cause) == of_part


def test_a_motion_that_broke_off_stops_its_step_with_the_reason_of_the_plant() -> None:
    blocked = ending_stopped(MotionCompletion(False, "blocked"))
    assert blocked == SkillRunResult(StepStatus.STOPPED, "blocked")
    assert ending_stopped(MotionCompletion(False)).reason == "the plant gave no reason"


def test_actuators_are_resources_for_one_step_at_a_time() -> None:
    cart = configuration()
    assert required_resources(cart.modules["cart"].skills["reach"]) == {"arm", "camera", "actuator arm"}
    assert resource_capacities(cart.site) == {"arm": 1, "camera": 3, "actuator arm": 1, "actuator wheels": 1}


def test_a_skill_sees_its_modules_own_variables_under_short_names() -> None:
    both = kettle.configuration()
    readings = kettle.one_by_one(kettle.OWN)
    seen = ObservationFilter(both.modules["kettle"], both.site).observe(readings, kettle.NOW)
    own = {"water_hot": False, "filled": True, "water_level": 0.125}
    assert own.items() <= seen.items()
    assert not any("." in name for name in seen)
    moment = kettle.of_one_moment(kettle.OWN)
    assert ObservationFilter(both.modules["kettle"], both.site).observe(moment, kettle.NOW) == seen
    other = ObservationFilter(both.modules["make_dumplings"], both.site).observe(readings, kettle.NOW)
    assert not any("." in name or name in own for name in other)


def test_a_skill_sees_what_the_site_shares_of_modules_that_its_own_requires() -> None:
    both = kettle.configuration()
    dumplings = both.modules["make_dumplings"]
    hot = both.site.state["kettle.water_hot"]
    sharing = replace(both.site, perception=replace(both.site.perception, shared={hot.name: hot}))
    readings = kettle.one_by_one(kettle.OWN)
    assert hot.name not in ObservationFilter(dumplings, sharing).observe(readings, kettle.NOW)
    asking = replace(dumplings, required_modules={"kettle": ">=1"})
    assert hot.name not in ObservationFilter(asking, both.site).observe(readings, kettle.NOW)
    seen = ObservationFilter(asking, sharing).observe(readings, kettle.NOW)
    assert seen[hot.name] is False
    assert "kettle.filled" not in seen


def test_a_module_senses_a_variable_under_its_own_names_for_it(site: Site, make_ecm: Any) -> None:
    ecm = make_ecm("")
    needs = replace(ecm.names, variables={"near": "tool_position", "holding": "tool_position"})
    observer = ObservationFilter(replace(ecm, names=needs), site)
    seen = observer.observe(
        {"holding": Reading(True, 1.0), "tool_position": Reading((0.3, 0.0, 0.5), 1.0)}, 1.0
    )
    assert seen == dict.fromkeys(("near", "holding", "tool_position"), (0.3, 0.0, 0.5))


def test_a_variable_of_a_module_that_a_sensor_measures_needs_access_to_it(site: Site, make_ecm: Any) -> None:
    name = "handling.level"
    for sensor, expected in (
        ("gripper", {"level": True}),
        ("scanner", {}),
        ("handling.look", {"level": True}),
    ):
        own = replace(site.state["holding"], sensor=sensor)
        observer = ObservationFilter(make_ecm(""), replace(site, state={name: own}))
        assert observer.observe({name: Reading(True, 1.0)}, 1.0) == expected
