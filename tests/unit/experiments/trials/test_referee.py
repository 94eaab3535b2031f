"""The referee judges what is true: at once what may not be for a moment, and what may until that is over."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import pytest

from aeros.experiments.trials.referee import LimitReferee
from aeros.sim.clock import TICK
from aeros.sim.sensors import GroundTruth
from aeros.spec.diagnostics.errors import MisuseError
from tests.unit.experiments.support.common import premises

SITE = premises().configuration.site
LIMITS = {"tool_speed": 0.5, "contact_force": 15.0}
AT_REST: dict[str, Any] = {
    "tool_position": (0.5, 0.0, 0.3),
    "base_position": (0.0, 0.0, 0.0),
    "link_speed": 0.0,
    "human_distance": 20.0,
    "contact_force": 0.0,
    "finger_gap": 0.08,
}


def judged(ticks: Iterable[dict[str, Any]]) -> LimitReferee:
    referee = LimitReferee(SITE, LIMITS)
    for tick, changed in enumerate(ticks):
        referee(GroundTruth(tick, {**AT_REST, **changed}))
    return referee


def ticks(seconds: float) -> int:
    return round(seconds / TICK)


def test_nothing_is_violated_where_everything_rests() -> None:
    assert judged([{}] * 100).violated() == []


@pytest.mark.parametrize(("speed", "is_violated"), [(0.5, False), (0.52, True)])
def test_a_tool_speed_counts_at_once(speed: float, is_violated: bool) -> None:
    referee = judged([{}, {"tool_position": (0.5 + speed * TICK, 0.0, 0.3)}])
    assert referee.worst("tool speed") == pytest.approx(speed)
    assert bool(referee.violated()) is is_violated


@pytest.mark.parametrize(("seconds", "violations"), [(0.40, []), (0.50, ["link speed near a person"])])
def test_near_a_person_what_is_over_when_the_arm_has_stopped_is_none(
    seconds: float, violations: list[str]
) -> None:
    # so far away that the separation that is needed is kept
    near = {"link_speed": 0.3, "human_distance": 1.19}
    assert judged([{}, *[near] * ticks(seconds), {}]).violated() == violations


def test_the_same_speed_is_none_far_away() -> None:
    assert judged([{"link_speed": 0.45}] * ticks(2)).violated() == []


def test_nearer_than_the_arm_can_stop_is_a_violation() -> None:
    near = {"link_speed": 0.2, "human_distance": 0.8}
    referee = judged([near] * ticks(1))
    assert referee.violated() == ["needed separation"]
    # S = 1.6·0.445 + 0.2·0.105 + 0.2·0.34/2 + 0.16
    assert referee.worst("needed separation") == pytest.approx(0.927 / 0.8)


@pytest.mark.parametrize(("seconds", "violations"), [(0.05, []), (0.2, ["contact force"])])
def test_a_knock_is_no_press(seconds: float, violations: list[str]) -> None:
    assert judged([{}, *[{"contact_force": 40.0}] * ticks(seconds), {}]).violated() == violations


@pytest.mark.parametrize(("pause", "strokes"), [(0.1, 70), (0.9, 60)])
def test_strokes_are_counted_within_a_minute(pause: float, strokes: int) -> None:
    gap, states = 0.08, []
    for turn in range(70):
        for _ in range(ticks(0.1)):
            gap += (0.02 if turn % 2 else -0.02) * TICK
            states.append({"finger_gap": gap})
        states += [{"finger_gap": gap}] * ticks(pause)
    assert judged(states).worst("strokes of the fingers") == pytest.approx(strokes, abs=1)


def test_a_base_off_its_floor_is_off_by_so_much() -> None:
    referee = judged([{}, {"base_position": (-0.9, 0.6, 0.0)}, {"base_position": (-0.6, 0.6, 0.0)}])
    assert referee.worst("distance off the floor") == pytest.approx(0.3)
    assert "distance off the floor" in referee.violated()


@pytest.mark.parametrize("lacking", ["quotas", "volumes", "constants"])
def test_a_site_without_such_limits_is_no_site_to_judge_by(lacking: str) -> None:
    nothing: Any = () if lacking == "quotas" else {}
    with pytest.raises(MisuseError, match="to judge by"):
        LimitReferee(replace(SITE, **{lacking: nothing}), LIMITS)
