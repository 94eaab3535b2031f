"""The monitor: rules that allowed a motion must continue to hold, with the decided parameters."""

from __future__ import annotations

import gc
import tracemalloc
from dataclasses import replace
from fractions import Fraction
from math import inf, nan, nextafter
from pathlib import Path
from random import Random
from typing import Any

import pytest

from aeros.runtime.gate.compiled.rules import FastTickCheck, MonitorRules
from aeros.runtime.gate.decision import DecisionKind
from aeros.runtime.gate.joint_rules import ActiveAction
from aeros.runtime.gate.violation import RuleViolation
from aeros.runtime.monitor.history import HistoryTracker
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.ports import BACK_OFF, Monitor, Reading, Readings, RobotBody, Trajectory
from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.elaborate.past_time import HistoryCollector
from aeros.spec.expr import terms as t
from aeros.spec.expr.types import BOOL, RealType
from aeros.spec.model.motion import Tracking
from aeros.spec.model.rules import Rule
from aeros.spec.model.site import Site
from aeros.spec.model.variables import Declared
from tests.unit.runtime.bench import NOW, STATE, Request, configuration, gate, measured, request, without
from tests.unit.runtime.conftest import SPAN
from tests.unit.runtime.motion.test_trajectory import POLICY
from tests.unit.runtime.together import configuration as cart
from tests.unit.runtime.together import move, roll


def monitors() -> RuntimeMonitor:
    """Return a monitor of no action yet, under the site of the bench."""
    site = configuration().site
    return RuntimeMonitor(MonitorRules(site), HistoryTracker(site))


def watching(action: Action, readings: Readings) -> RuntimeMonitor:
    """Return a monitor of one action, which has watched an equal one before."""
    monitor, started = monitors(), ActiveAction(action, readings, NOW, 0)
    monitor.add(started)
    monitor(NOW, STATE)
    monitor.remove(started)
    monitor.add(started)
    return monitor


def watch(asked: Request) -> Monitor:
    """Return a monitor of the action that the gate allows, as the executor uses it."""
    decision = asked.decided_by(gate())
    assert decision.kind is not DecisionKind.DENY
    assert decision.action is not None
    return watching(decision.action, asked.readings)


@pytest.mark.parametrize("kind", ["move", "carry", "sweep"])
def test_the_monitor_is_silent_while_nothing_changes(kind: str) -> None:
    monitor = watch(request("quickly", kind))
    assert monitor(NOW, {}) is None
    assert monitor(NOW, STATE) is None
    assert monitor(NOW, {name: list(v) if isinstance(v, tuple) else v for name, v in STATE.items()}) is None


@pytest.mark.parametrize(
    ("kind", "name", "value", "rule"),
    [
        ("move", "stop_pressed", True, "stop-button"),
        ("move", "human_distance", nextafter(0.5, 0.0), "separation"),
        ("move", "hand", (0.25, 0.75, 0.25), "short-reach"),
        ("carry", "stop_pressed", True, "stop-button"),
        ("carry", "human_distance", 0.0, "separation"),
        ("carry", "joint_angle", (0.0, 2.125), "joints-in-range"),
        ("carry", "joint_ready", (False, False), "some-joint-ready"),
        ("sweep", "stop_pressed", True, "stop-button"),
    ],
)
def test_each_rule_on_the_state_stops_the_motion(kind: str, name: str, value: Any, rule: str) -> None:
    monitor = watch(request("quickly", kind))
    assert monitor(NOW, STATE) is None
    assert monitor(NOW, {**STATE, name: value}) == rule
    assert watch(request("quickly", kind))(NOW, {name: value}) == rule


def test_a_person_who_comes_near_stops_a_fast_motion_and_not_a_slow_one() -> None:
    fast, slow = watch(request(speed=0.5)), watch(request(speed=0.25))
    for distance, tripped in ((3.0, None), (nextafter(1.2, inf), None), (1.2, "near-person")):  # 1.2 < 6/5
        assert fast(NOW, {"human_distance": distance}) == tripped
        assert slow(NOW, {"human_distance": distance}) is None
    assert slow(NOW, {"human_distance": 0.4}) == "separation"


def test_one_monitor_watches_each_motion_with_its_own_parameters() -> None:
    monitor, near = monitors(), {"human_distance": 1.2}
    for speed, tripped in ((0.25, None), (0.5, "near-person"), (0.25, None)):
        asked = request(speed=speed)
        started = ActiveAction(asked.action, asked.readings, NOW, 0)
        monitor.add(started)
        assert monitor(NOW, near) == tripped
        monitor.remove(started)


def test_an_attenuated_motion_is_watched_with_its_reduced_parameters() -> None:
    monitor = watch(request(speed=0.5, human_distance=1.0))
    assert monitor(NOW, {"human_distance": 1.0}) is None
    assert monitor(NOW, {"fitted": "knife"}) == "input:human_distance"
    assert watch(request(speed=0.5, human_distance=1.0))(NOW, {"fitted": "knife"}) == "knife-speed"


def test_a_growing_load_violates_a_rule_on_a_product() -> None:
    monitor = watch(request("quickly", "carry", gait=0.0625))
    assert monitor(NOW, {"load": nextafter(1.6, 0.0)}) is None
    assert monitor(NOW, {"load": 1.6}) == "momentum"


@pytest.mark.parametrize("value", [nan, inf, -inf, None, "3.0", True, 20.5, -5e-324, 10**400, (3.0,)])
def test_a_malformed_or_impossible_value_stops_the_motion(value: Any) -> None:
    monitor = watch(request())
    assert monitor(NOW, {**STATE, "human_distance": value}) == "input:human_distance"


@pytest.mark.parametrize("name", ["mood", "speed", "target"])
def test_an_unknown_variable_stops_the_motion(name: str) -> None:
    assert watch(request())(NOW, {**STATE, name: 0.0}) == f"input:{name}"


@pytest.mark.parametrize("name", sorted(STATE))
def test_a_value_that_is_no_longer_measured_stops_the_motion(name: str) -> None:
    monitor = watch(request())
    assert monitor(NOW, {}) is None
    assert monitor(NOW, STATE) is None
    assert monitor(NOW, {one: value for one, value in STATE.items() if one != name}) == f"input:{name}"


def test_a_variable_that_no_tick_measures_keeps_its_value_from_the_decision() -> None:
    monitor = watch(request(speed=0.2, human_distance=1.0))
    assert monitor(NOW, {"stop_pressed": False, "fitted": "brush"}) is None
    assert monitor(NOW, {"stop_pressed": False, "fitted": "knife"}) == "knife-speed"


def test_a_variable_that_no_rule_reads_may_be_missing() -> None:
    assert watch(without(request(), "dirt"))(NOW, {}) is None


def test_a_rule_on_an_unknown_state_stops_the_motion() -> None:
    asked = request()
    decision = asked.decided_by(gate())
    assert decision.action is not None
    monitor = watching(decision.action, without(asked, "hand").readings)
    assert monitor(NOW, {}) == "input:hand.x"
    assert monitor.violation is None
    monitor.stops.clear()
    assert monitor(NOW, {"hand": (0.25, 0.0, 0.25)}) is None


def test_removed_motions_do_not_affect_the_next_one() -> None:
    monitor = monitors()
    first, second = (ActiveAction(request().action, request().readings, NOW, record) for record in (1, 2))
    monitor.add(first)
    assert monitor(NOW, {"human_distance": 0.1}) == "separation"
    monitor.remove(first)
    monitor.add(second)
    assert monitor(NOW, {"hand": (0.25, 0.0, 0.25)}) is None


def test_an_hour_of_ticks_takes_no_more_memory_than_a_few() -> None:
    monitor = watch(request())
    for _ in range(100):
        monitor(NOW, STATE)
    gc.collect()
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for tick in range(5_000):
            monitor(NOW, {**STATE, "human_distance": 2.0 + tick / 5_000})
        gc.collect()
        assert tracemalloc.get_traced_memory()[0] - before < 10_000
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("value", "age", "rule"),
    [
        (3.0, 0.0, None),
        (3.0, 0.0999, None),
        (3.0, 0.1001, "input:human_distance"),
        (0.4, 0.05, "separation"),
        (nan, 0.05, "input:human_distance"),
        (3.0, -0.01, "input:human_distance"),
        (3.0, nan, "input:human_distance"),
    ],
)
def test_an_earlier_reading_counts_until_it_is_too_old(value: float, age: float, rule: str | None) -> None:
    monitor = watch(request("quickly", "move"))
    assert monitor(NOW, {"human_distance": 3.0}) is None
    assert monitor(NOW, {"human_distance": Reading(value, NOW - age)}) == rule


class _Noting(MonitorRules):
    """Rules that note which functions are compiled."""

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self.compiled: list[str] = []

    def fast_check(self, kind: str, measured: frozenset[str]) -> FastTickCheck | None:
        """See `MonitorRules`."""
        self.compiled.append(kind)
        return super().fast_check(kind, measured)


def test_nothing_is_compiled_in_a_tick() -> None:
    site = configuration().site
    watched = _Noting(site)
    monitor = RuntimeMonitor(watched, HistoryTracker(site))
    compiled, quickly = [], []
    for kind in ("move", "carry", "move", "carry"):
        asked = request("quickly", kind)
        decision = asked.decided_by(gate())
        assert decision.action is not None
        started = ActiveAction(decision.action, asked.readings, NOW, 0)
        monitor.add(started)
        compiled.append(list(watched.compiled))
        for _ in range(2):
            assert monitor(NOW, STATE) is None
        assert watched.compiled == compiled[-1]
        quickly.append(monitor._holds is not None)
        monitor.remove(started)
    # Of the first motion nobody knows yet what its ticks measure.
    assert compiled == [[], ["carry"], ["carry", "move"], ["carry", "move"]]
    assert quickly == [False, True, True, True]


@pytest.mark.parametrize(("age", "is_fast"), [(0.0, True), (0.05, True), (9.0, False), (-0.01, False)])
def test_a_tick_whose_readings_are_fresh_is_decided_by_the_fast_check(
    age: float, is_fast: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    site, asked = configuration().site, request("quickly", "move")
    decision = asked.decided_by(gate())
    assert decision.action is not None
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    for _ in range(2):
        started = ActiveAction(decision.action, asked.readings, NOW, 0)
        monitor.add(started)
        assert monitor(NOW, STATE) is None
        monitor.remove(started)
    monitor.add(started)
    monkeypatch.setattr(monitor, "_first_violation", lambda now, measured, known: "decided in full")
    measured = {**STATE, "human_distance": Reading(STATE["human_distance"], NOW - age)}
    assert monitor(NOW, measured) == (None if is_fast else "decided in full")


@pytest.mark.parametrize("again", [1, 3])
def test_a_variable_measured_in_addition_is_measured_at_the_next_tick(again: int) -> None:
    """The fast check is that of the fewer variables, which had decided the ticks before."""
    asked, fewer = request("quickly", "move"), {"stop_pressed": False}
    monitor, started = monitors(), ActiveAction(asked.action, asked.readings, NOW, 0)
    for _ in range(2):
        monitor.add(started)
        assert monitor(NOW, fewer) is None
        monitor.remove(started)
    monitor.add(started)
    assert monitor(NOW, fewer) is None
    assert monitor._holds is not None
    for _ in range(again):
        assert monitor(NOW, {**fewer, "human_distance": 2.0}) is None
    assert monitor(NOW, fewer) == "input:human_distance"


class _Slowly(MonitorRules):
    """Rules without a fast check."""

    def fast_check(self, kind: str, measured: frozenset[str]) -> None:
        """See `MonitorRules`."""


@pytest.mark.parametrize(
    ("distance", "rule"), [(1.0, None), (nextafter(1.0, 0.0), "bounded"), (True, "input:human_distance")]
)
def test_a_rule_of_bounds_alone_stops_the_motion(distance: Any, rule: str | None) -> None:
    site = load_site(Path(__file__).parents[1] / "data" / "bounded.yaml", Diagnostics())
    assert site is not None
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    for _ in range(2):
        started = ActiveAction(Action("move", {"speed": 3.0}), measured({"human_distance": 2.0}), NOW, 0)
        monitor.add(started)
        assert monitor(NOW, {"human_distance": 2.0}) is None
        monitor.remove(started)
    monitor.add(started)
    for _ in range(2):
        assert monitor(NOW, {"human_distance": 2.0}) is None
        assert monitor._holds is not None
    assert monitor(NOW, {"human_distance": distance}) == rule


_STRANGE = (nan, inf, None, "3.0", True, (1.0,), [0.25, 0.0, 0.25], 10**400, -0.0, Reading(True, NOW - 9.0))


@pytest.mark.parametrize("kind", ["move", "carry", "sweep"])
def test_the_fast_check_of_a_tick_agrees_with_the_slow_one(kind: str) -> None:
    chance = Random(7)  # noqa: S311 - a test, the same every time
    site, asked = configuration().site, request("quickly", kind)
    decision = asked.decided_by(gate())
    assert decision.action is not None
    answers, quickly = set(), 0
    compiled = MonitorRules(site), _Slowly(site)
    for action in range(400):
        if action % 4 == 0:  # what a monitor has seen outlasts an action
            quick, slow = (RuntimeMonitor(watched, HistoryTracker(site)) for watched in compiled)
            names = chance.sample(sorted(STATE), chance.randint(0, len(STATE)))
        started = ActiveAction(decision.action, asked.readings, NOW, 0)
        for monitor in (quick, slow):
            monitor.add(started)
        measured = {name: STATE[name] for name in names}
        for _ in range(6):
            name, drawn = chance.choice(sorted(STATE)), chance.random()
            if drawn < 0.3:
                measured[name] = chance.choice(_STRANGE)
            elif drawn < 0.5:
                measured[name] = tuple(value) if isinstance(value := STATE[name], tuple) else STATE[name]
            elif drawn < 0.6:
                measured[name] = Reading(STATE[name], NOW)
            elif drawn < 0.65:
                measured["stop_pressed"] = True
            elif drawn < 0.75:
                measured["human_distance"] = chance.uniform(0.0, 2.0)
            elif drawn < 0.9 and isinstance(hand := measured.get("hand"), list):
                hand[1] = chance.uniform(-1.0, 1.0)  # the same list, with another value
            elif drawn < 0.9:
                measured["hand"] = [0.25, 0.0, 0.25]
            answer = slow(NOW, measured)
            assert quick(NOW, measured) == answer
            for monitor in (quick, slow):
                monitor.stops.clear()  # so that it is asked about motions again
            answers.add(answer)
            quickly += quick._holds is not None
        for monitor in (quick, slow):
            monitor.remove(started)
    assert {None, "stop-button", "input:human_distance"} <= answers
    assert quickly > 400


def test_a_modules_variable_that_no_invariant_reads_stops_nothing() -> None:
    monitor = watch(request("quickly", "move"))
    for own in (True, "hot", nan, None, Reading(True, NOW + 1), [1]):
        assert monitor(NOW, {**STATE, "kettle.hot": own}) is None
    assert monitor(NOW, STATE) is None  # measured before, and not now
    assert monitor(NOW, {**STATE, "kettle.hot": True, "human_distance": -1.0}) == "input:human_distance"
    assert watch(request("quickly", "move"))(NOW, {**STATE, "mood": True}) == "input:mood"


# Several actions, stops, and motions that are not followed.

_CART: dict[str, Any] = {"charge": 0.5, "hand": 0.0, "stop_pressed": False}


def _under_way(action: Action, number: int) -> ActiveAction:
    readings = {name: Reading(value, NOW) for name, value in _CART.items()}
    return ActiveAction(action, readings, NOW, number)


@pytest.mark.parametrize("moving_first", [True, False])
def test_a_joint_rule_is_watched_while_both_actions_are_under_way(moving_first: bool) -> None:
    site = cart().site
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    moving, rolling = _under_way(move(), 1), _under_way(roll(), 2)
    first, second = (moving, rolling) if moving_first else (rolling, moving)
    low = {**_CART, "charge": 0.1}
    for _ in range(2):
        monitor.add(first)
        assert monitor(NOW, low) is None
        monitor.remove(first)
    monitor.add(first)
    monitor.add(second)
    assert monitor(NOW, _CART) is None
    assert monitor(NOW, low) == "charge-for-both"
    assert isinstance(monitor.violation, RuleViolation)
    assert monitor.violation.rule == "charge-for-both"
    monitor.stops.clear()
    monitor.remove(second)
    assert monitor(NOW, low) is None
    assert monitor._holds is not None  # the fast check suffices again


def test_a_tick_without_an_action_is_silent_and_prepares_nothing() -> None:
    monitor, asked = monitors(), request()
    assert monitor(NOW, STATE) is None
    assert monitor.violation is None
    monitor.add(ActiveAction(asked.action, asked.readings, NOW, 0))
    assert monitor(NOW, STATE) is None
    assert monitor._holds is None


@pytest.mark.parametrize(("sets", "kept"), [(2, 2), (8, 8), (9, 1)])  # the ninth set drops the others
def test_fast_checks_are_made_for_up_to_eight_sets_of_measured_variables(sets: int, kept: int) -> None:
    site = configuration().site
    watched = _Noting(site)
    monitor = RuntimeMonitor(watched, HistoryTracker(site))
    moving, carrying = (
        ActiveAction(request("quickly", kind).action, request().readings, NOW, 0)
        for kind in ("move", "carry")
    )
    for count in range(1, sets + 1):
        monitor.add(moving)
        assert monitor(NOW, {name: STATE[name] for name in sorted(STATE)[:count]}) is None
        monitor.remove(moving)
    monitor.add(carrying)
    assert watched.compiled.count("carry") == kept


def test_a_modules_variable_may_be_missing_once_no_rule_under_watch_reads_it() -> None:
    site = configuration().site
    hot = t.Variable("kettle.hot", BOOL, t.VariableRole.STATE)
    cool = Rule("cool", "not kettle.hot", "", "", {"move": t.Not(hot)}, {}, SPAN, SPAN)
    state = {**site.state, hot.name: Declared(hot, SPAN, max_age=Fraction(1), sensor="kettle.eye")}
    perception = replace(site.perception, in_invariants=frozenset({hot.name}))
    site = replace(site, state=state, rules=(*site.rules, cool), perception=perception)
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    values = {**STATE, hot.name: False}
    moving, stopping = (
        ActiveAction(action, measured(values), NOW, number)
        for number, action in enumerate((request("quickly").action, Action("stop", {})))
    )
    monitor.add(moving)
    monitor.add(stopping)
    assert monitor(NOW, values) is None
    monitor.remove(moving)
    assert monitor(NOW, STATE) is None
    monitor.add(moving)
    assert monitor(NOW, values) is None
    assert monitor(NOW, STATE) == "input:kettle.hot"


def test_a_value_that_is_the_same_object_is_unpacked_once() -> None:
    site, asked = configuration().site, request()
    rules = _Slowly(site)
    unpacked: list[float] = []
    original = rules.unpackers["human_distance"]

    def unpack(value: float) -> Any:
        unpacked.append(value)
        return original(value)

    rules.unpackers["human_distance"] = unpack
    monitor = RuntimeMonitor(rules, HistoryTracker(site))
    monitor.add(ActiveAction(asked.action, asked.readings, NOW, 0))
    for distance in (2.5, 2.5, 2.75):
        for _ in range(3):
            assert monitor(NOW, {**STATE, "human_distance": distance}) is None
    assert unpacked == [2.5, 3.0, 2.75]  # the second is that of the decision


def _stopped(back_off: str | None, measured: dict[str, Any]) -> RuntimeMonitor:
    """A monitor of a motion that these values have stopped."""
    site, asked = configuration().site, request()
    rules = MonitorRules(site)
    rules.back_off = back_off
    monitor = RuntimeMonitor(rules, HistoryTracker(site))
    monitor.add(ActiveAction(asked.action, asked.readings, NOW, 0))
    assert monitor(NOW, STATE) is None
    assert monitor(NOW + 0.25, measured) == "separation"
    return monitor


def test_a_stop_goes_on_for_its_first_reason_and_is_recorded_to_its_end() -> None:
    monitor = _stopped(None, {**STATE, "human_distance": 0.25})
    assert monitor(NOW + 0.5, {**STATE, "human_distance": 0.125}) == "separation"
    assert monitor(NOW + 0.75, {**STATE, "stop_pressed": True}) == "separation"
    record = monitor.stops.end_stop(NOW + 1.0)
    assert record is not None
    assert (record["reason"], record["began"], record["time"], record["ticks"]) == (
        "separation",
        NOW + 0.25,
        NOW + 1.0,
        3,
    )
    assert record["quantities"]["human_distance"] == {"least": 0.125, "greatest": 3.0, "unit": "m"}
    assert record["ways"] == {"hand": 0.0}


def test_the_robot_may_back_off_while_the_rules_on_that_kind_hold() -> None:
    near = {**STATE, "human_distance": 0.25}
    assert _stopped("stop", near)(NOW + 0.5, near) == BACK_OFF
    monitor = _stopped("carry", near)
    assert monitor(NOW + 0.5, near) == "separation"
    assert monitor(NOW + 0.5, {**near, "stop_pressed": True}) == "stop-button"
    assert monitor(NOW + 0.5, {**STATE, "joint_ready": (False, False)}) == "some-joint-ready"
    assert monitor(NOW + 0.5, {**STATE, "human_distance": nan}) == "input:human_distance"
    assert monitor(NOW + 0.5, STATE) == "input:gait"  # a value that no request gave
    for age, answer in ((0.05, BACK_OFF), (0.25, "input:human_distance")):
        read = {**STATE, "human_distance": Reading(0.25, NOW + 0.5 - age)}
        assert _stopped("stop", near)(NOW + 0.5, read) == answer
    assert _stopped("stop", near)(NOW + 0.5, {**near, "kettle.hot": None}) == BACK_OFF


def test_a_stop_that_others_begin_goes_on_for_its_reason() -> None:
    monitor = watching(request().action, request().readings)
    monitor.stops.begin_stop("the plant says so", NOW)
    assert monitor(NOW, STATE) == "the plant says so"


def test_ticks_of_a_halt_are_recorded_while_the_fast_check_holds() -> None:
    monitor = watching(request().action, request().readings)
    assert monitor(NOW, STATE) is None
    assert monitor._holds is not None
    monitor.stops.begin_halt(7, "late", NOW)
    for _ in range(3):
        assert monitor(NOW, STATE) is None
    halt = monitor.stops.end_halt(7, NOW)
    assert halt is not None
    assert halt["ticks"] == 3
    monitor._update_histories = None  # type: ignore[assignment, method-assign]
    assert monitor(NOW, STATE) is None  # by the fast check alone


class _Tracker:
    """A tracker of one motion that is not followed; notes what it is asked."""

    is_idle = False
    deviation = None

    def __init__(self) -> None:
        self.asked: list[Any] = []
        self.says: str | None = None

    def add(self, number: int, plan: object) -> None:
        self.asked.append(("add", number, plan))

    def remove(self, number: int) -> None:
        self.asked.append(("remove", number))

    def violation(self, now: float, measured: Any) -> str | None:
        self.asked.append((now, measured))
        return self.says


def test_a_motion_that_is_not_followed_stops_the_robot_unless_a_rule_does() -> None:
    site, asked, tracker = configuration().site, request(), _Tracker()
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    monitor.tracker = tracker  # type: ignore[assignment]
    started = ActiveAction(asked.action, asked.readings, NOW, 7)
    monitor.add(started, "plan")
    assert monitor(NOW, STATE) is None
    tracker.says = "decided-path"
    pressed = {**STATE, "stop_pressed": True}
    assert monitor(NOW + 1, pressed) == "stop-button"
    assert monitor(NOW + 2, STATE) == "stop-button"  # the stop goes on, and the tracker is not asked
    monitor.remove(started)
    assert not monitor.stops.are_open
    monitor.add(started)
    assert monitor(NOW + 3, STATE) == "decided-path"
    assert (monitor.violation, monitor.stops.stop is not None) == (None, True)
    assert tracker.asked == [
        ("add", 7, "plan"),
        (NOW, STATE),
        (NOW + 1, pressed),
        ("remove", 7),
        ("add", 7, None),
        (NOW + 3, STATE),
    ]


def test_a_motion_is_compared_with_the_robot_under_the_policy_of_the_site() -> None:
    body = RobotBody(((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), (0.5, 0.0, 0.0), ())
    nowhere = (0.0, 0.0, 0.0)
    plan = Trajectory(body, ((((0.25, -0.5),) * 4,),), nowhere, nowhere, 1.0)
    tracking = Tracking("off", Fraction(1, 100), (Fraction(1),) * 2)
    site, asked = configuration().site, request()
    site = replace(site, motion=replace(POLICY, base_variable=None, tracking=tracking))
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    monitor.add(ActiveAction(asked.action, asked.readings, NOW, 7), plan)
    assert monitor(NOW, STATE) is None
    assert monitor(NOW, {**STATE, "joint_angle": (0.3, -0.5)}) == "decided-path"


# Rules that read histories.

_STORM = "once within 5 s (2 m/s < wind)"


def _with_memory(back_off: str | None = None) -> RuntimeMonitor:
    """A monitor under a site on which nothing moves if it was windy in the last 5 s."""
    site = configuration().site
    wind = site.state["wind"].variable
    assert isinstance(wind.type, RealType)
    strong = t.Compare("<", t.Literal(Fraction(2), wind.type), wind)
    histories = HistoryCollector()
    past = histories.replace_past_terms(t.Since(t.TRUE, strong, Fraction(5)), SPAN)
    terms = {kind: t.Not(past) for kind in ("move", "stop")}
    memory = Rule("memory", f"not {_STORM}", "", "", terms, {}, SPAN, SPAN)
    site = replace(site, rules=(*site.rules, memory), histories=histories.collected)
    rules = MonitorRules(site)
    rules.back_off = back_off
    return RuntimeMonitor(rules, HistoryTracker(site))


_MOVING = ActiveAction(request().action, measured({**STATE, _STORM: False}), NOW, 0)


def test_histories_are_updated_at_ticks_with_values_and_readings() -> None:
    for wind in (3.0, Reading(3.0, NOW)):
        monitor = _with_memory()
        assert monitor(NOW, STATE) is None  # before any action
        monitor.add(_MOVING)
        assert monitor(NOW, {**STATE, "wind": wind}) == "memory"
        monitor.stops.clear()
        assert monitor(NOW + 0.5, STATE) == "memory"


def test_readings_of_the_decision_count_until_they_are_too_old_or_the_action_is_over() -> None:
    calm = {name: value for name, value in STATE.items() if name != "wind"}
    monitor = _with_memory()
    monitor.add(_MOVING)
    assert monitor(NOW + 0.5, calm) is None
    assert monitor(NOW + 1.25, calm) == f"input:{_STORM}"
    for state, answer in ((STATE, None), (calm, f"input:{_STORM}")):
        monitor = _with_memory()
        monitor.add(_MOVING)
        assert monitor(NOW, STATE) is None
        monitor.remove(_MOVING)
        monitor.add(replace(_MOVING, readings=measured(calm)))
        assert monitor(NOW + 0.5, state) == answer


def test_rules_on_backing_off_read_histories_too() -> None:
    near = {**STATE, "human_distance": 0.25}
    for wind, answer in ((0.0, BACK_OFF), (3.0, "memory")):
        monitor = _with_memory("stop")
        monitor.add(_MOVING)
        assert monitor(NOW, near) == "separation"
        assert monitor(NOW + 0.5, {**near, "wind": wind}) == answer


def test_a_tracker_without_motions_is_not_asked() -> None:
    site, asked, tracker = configuration().site, request(), _Tracker()
    monitor = RuntimeMonitor(MonitorRules(site), HistoryTracker(site))
    tracker.is_idle, tracker.says = True, "decided-path"
    monitor.tracker = tracker  # type: ignore[assignment]
    monitor.add(ActiveAction(asked.action, asked.readings, NOW, 7))
    assert monitor(NOW, STATE) is None
    assert tracker.asked == [("add", 7, None)]
