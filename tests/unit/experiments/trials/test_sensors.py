"""A bad sensor costs availability and not safety; a violated rule is reported, whichever gate decided."""

from __future__ import annotations

from typing import Any, cast

import pytest

from aeros.experiments.condition import TrialCondition
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.sensors import KIND, _LongestViolation, _SensorCounters, sensor_model
from aeros.experiments.trials.truth import REST_SPEED, InvariantReferee, site_constant
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.ports import Runtime, StepRequest, StepResult, StepStatus
from aeros.sim.clock import TICK
from aeros.sim.sensor_model import SensorModel
from aeros.sim.sensors import GroundTruth
from aeros.spec.model.cause import Cause
from tests.unit.agent.fake_runtime import FakeRuntime
from tests.unit.experiments.support.common import premises

SETTINGS = {"task": "fetch_object", "person": "across_the_room", "of": "human_distance"}


def condition(**sensor: str) -> TrialCondition:
    return TrialCondition.create("sensors", "physics", {**SETTINGS, **sensor})


def tried(seed: int = 0, **sensor: str) -> Findings:
    with KIND.open(condition(**sensor), premises()) as trial:
        return trial(seed)


def test_a_sensor_is_as_it_is_declared() -> None:
    assert sensor_model({"latency": "0.08"}) == SensorModel(latency=0.08)
    assert sensor_model({"noise": "1/20"}) == SensorModel(noise=0.05)
    assert sensor_model({"dropout": "1"}) == SensorModel(dropout=1.0)


def test_nothing_is_promised_of_a_sensor_that_lies() -> None:
    assert KIND.expected_values(condition(latency="0.2"), premises()) == {"violated": 0.0}
    assert KIND.expected_values(condition(noise="0.2"), premises()) == {}


@pytest.mark.deep
@pytest.mark.physics
def test_a_good_sensor_stops_the_robot_for_who_is_there_and_lets_it_go_on() -> None:
    found = tried(latency="0")
    assert (found["reached"], found["violated"], found["rules"]) == (True, False, [])
    assert found["stops"] > 0
    assert found["blind_stops"] == found["unread"] == 0
    assert found["longest_s"] < 0.445


@pytest.mark.physics
def test_readings_that_are_too_old_keep_the_robot_where_it_is() -> None:
    found = tried(latency="0.2")
    assert (found["reached"], found["violated"], found["longest_s"]) == (False, False, 0.0)
    assert found["unread"] == found["steps"] > 0
    assert "at most 0.1 s is allowed" in found["reason"]


@pytest.mark.deep
@pytest.mark.physics
def test_without_a_monitor_the_referee_says_what_is_violated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RuntimeMonitor, "__call__", lambda *_: None)
    found = tried(latency="0")
    assert found["violated"]
    assert "drive-separation" in found["rules"]


# Counts, and the longest violation.


def _counted(*results: StepResult) -> dict[str, Any]:
    runtime = FakeRuntime(endings={"prepare": list(results)})
    counting = _SensorCounters(cast(Runtime, runtime))
    for _ in results:
        counting.start(StepRequest("dumpling", "prepare", {}))
        counting.wait()
    assert counting.wait(runtime.clock) is None
    return counting.findings()


UNREAD = Cause("reading", "human_distance", "at most 0.1 s is allowed")
NEAR = Cause("rule", "separation", "no")


def test_denials_and_stops_for_want_of_a_reading_are_counted_apart() -> None:
    found = _counted(
        StepResult(StepStatus.DENIED, "AE703", denied=2, causes=(NEAR, UNREAD)),
        StepResult(StepStatus.DENIED, "AE750", denied=1, causes=(NEAR,)),
        StepResult(StepStatus.FINISHED, "", causes=(UNREAD,)),
        StepResult(StepStatus.STOPPED, "monitor:input:human_distance"),
        StepResult(StepStatus.STOPPED, "monitor:separation"),
        StepResult(StepStatus.TIMED_OUT, "monitor:input:human_distance"),
    )
    assert found == {"steps": 6, "denied": 3, "unread": 1, "stops": 2, "blind_stops": 1}


SITE = premises().configuration.site
REACTION, ARM, DECELERATION = (
    site_constant(SITE, name) for name in ("reaction_time", "arm_stopping_time", "drive_deceleration")
)


class Judged:
    """A referee with given findings."""

    def __init__(self) -> None:
        self.broken: tuple[str, ...] = ()


def watch(*ticks: tuple[int, tuple[str, ...], float, float]) -> dict[str, Any]:
    """The findings after these ticks: number, broken rules, speed of a link (m/s), place of the base (m)."""
    longest, judged = _LongestViolation(SITE), Judged()
    longest.referee = cast(InvariantReferee, judged)
    for tick, broken, speed, place in ticks:
        judged.broken = broken
        longest.tick(GroundTruth(tick, {"link_speed": speed, "base_position": (place, 0.0)}))
    return longest.findings()


FREE = {"violated": False, "rules": [], "longest_s": 0.0}
NEAR_RULE = ("separation",)


def _ticks(seconds: float) -> int:
    return int(seconds / TICK)


def test_motion_for_longer_than_the_stopping_time_violates() -> None:
    allowed = _ticks(REACTION + ARM)
    within = watch((5, NEAR_RULE, 0.5, 0.0), (5 + allowed, NEAR_RULE, 0.5, 0.0))
    assert (within["violated"], within["longest_s"]) == (False, allowed * TICK)
    beyond = watch((5, NEAR_RULE, 0.5, 0.0), (6 + allowed, NEAR_RULE, 0.5, 0.0))
    assert (beyond["violated"], beyond["rules"]) == (True, ["separation"])


def test_a_base_that_drives_may_take_as_long_as_it_brakes() -> None:
    speed = 0.5
    at, after = 0.0, speed * TICK
    allowed = _ticks(REACTION + speed / DECELERATION)
    ticks = [(4, (), speed, at), (5, NEAR_RULE, speed, after)]
    assert not watch(*ticks, (5 + allowed, NEAR_RULE, speed, after))["violated"]
    assert watch(*ticks, (6 + allowed, NEAR_RULE, speed, after))["violated"]


def test_rest_and_motion_within_the_rules_are_no_violations() -> None:
    later = 5 + _ticks(10.0)
    assert watch((5, NEAR_RULE, REST_SPEED / 2, 0.0), (later, NEAR_RULE, REST_SPEED / 2, 0.0)) == FREE
    assert watch((5, (), 0.5, 0.0), (later, (), 0.5, 0.0)) == FREE
    assert watch() == FREE


def test_the_time_begins_anew_once_it_has_come_to_rest() -> None:
    half = _ticks(REACTION + ARM) - 1
    found = watch(
        (0, NEAR_RULE, 0.5, 0.0),
        (half, NEAR_RULE, 0.5, 0.0),
        (half + 1, NEAR_RULE, 0.0, 0.0),
        (half + 2, NEAR_RULE, 0.5, 0.0),
        (2 * half, NEAR_RULE, 0.5, 0.0),
    )
    assert (found["violated"], found["longest_s"]) == (False, half * TICK)
