"""A person who walks in stops the robot at once while a planner sleeps, and is missed without a monitor."""

from __future__ import annotations

import pytest

from aeros.experiments.condition import TrialCondition
from aeros.experiments.trial_kinds import Findings
from aeros.experiments.trials.reaction import KIND
from aeros.runtime.monitor.monitor import RuntimeMonitor
from tests.unit.experiments.support.common import premises

pytestmark = pytest.mark.physics

SETTINGS = {"task": "make_dumplings", "skill": "prepare", "person": "at_the_bench"}


def tried(latency: str) -> Findings:
    condition = TrialCondition.create("reaction", "physics", {**SETTINGS, "latency": latency})
    with KIND.open(condition, premises()) as trial:
        return trial(0)


@pytest.mark.deep
def test_the_stop_is_made_in_the_tick_of_the_hazard_whether_anybody_thinks_or_not() -> None:
    at_once, asleep = tried("0"), tried("3")
    # On a busy machine the planner without latency may be at work in that tick, too.
    assert asleep["while_thinking"] == 1
    assert at_once["plans"] > asleep["plans"]
    for one in (at_once, asleep):
        assert (one["hazards"], one["stopped"], one["reaction_ticks"]) == (1, 1, 0)
        assert one["reached"]
    assert at_once["rest_s"] == asleep["rest_s"] > 0


@pytest.mark.deep
def test_without_a_monitor_the_hazard_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RuntimeMonitor, "__call__", lambda *_: None)
    found = tried("0")
    assert (found["hazards"], found["stopped"], found["reached"]) == (1, 0, False)


def test_predictions_are_held_against_a_plant() -> None:
    condition = TrialCondition.create("reaction", "physics", {**SETTINGS, "latency": "10"})
    assert KIND.expected_values(condition, premises()) == {
        "success": 1.0,
        "stopped": 1.0,
        "reaction_ticks": 0.0,
    }
