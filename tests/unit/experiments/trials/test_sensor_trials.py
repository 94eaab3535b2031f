"""A bad sensor costs availability and not safety; what violates a rule is told, whatever decided."""

from __future__ import annotations

import pytest

from aeros.experiments.condition import TrialCondition
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.sensors import KIND, sensor_model
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.sim.sensors import SensorModel
from tests.unit.experiments.common import premises

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


@pytest.mark.physics
def test_a_good_sensor_stops_the_robot_for_who_is_there_and_lets_it_go_on() -> None:
    found = tried(latency="0")
    assert (found["reached"], found["violated"], found["rules"]) == (True, False, [])
    assert found["stops"] > 0
    assert found["blind_stops"] == found["unread"] == 0
    assert 0 < found["longest_s"] < 0.445


@pytest.mark.physics
def test_readings_that_are_too_old_keep_the_robot_where_it_is() -> None:
    found = tried(latency="0.2")
    assert (found["reached"], found["violated"], found["longest_s"]) == (False, False, 0.0)
    assert found["unread"] == found["steps"] > 0
    assert "at most 0.1 s is allowed" in found["reason"]


@pytest.mark.physics
def test_without_a_monitor_the_referee_says_what_is_violated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RuntimeMonitor, "__call__", lambda *_: None)
    found = tried(latency="0")
    assert found["violated"]
    assert "reduced-speed-near-person" in found["rules"]
