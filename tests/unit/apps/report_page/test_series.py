"""Measured values are shown with the bounds of the action under way at that time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from aeros.apps.report_page.run_data import RecordedDecision, RunData, SkillExecution
from aeros.apps.report_page.series import MAX_SAMPLES, build_series
from aeros.spec.diagnostics.codes import Diagnostics
from aeros.spec.elaborate.load import load_site
from aeros.spec.model.site import Site
from aeros.spec.text.discovery import reference_site_path


def reference() -> Site:
    site = load_site(reference_site_path(), Diagnostics())
    assert site is not None
    return site


SITE = reference()
SITES = {SITE.digest: SITE}


def moving(time: float, speed: float, verdict: str = "ALLOW", **state: Any) -> RecordedDecision:
    parameters = {"target": [0.5, 0.0, 0.3], "yaw": 0.0, "speed": speed}
    readings = {name: [value, time] for name, value in state.items()}
    return RecordedDecision(
        0, time, verdict, "arm.reach", "move_tool", parameters, parameters, (), SITE.digest, readings
    )


def sample(time: float, **state: Any) -> tuple[float, dict[str, Any]]:
    return time, {name: [value, time] for name, value in state.items()}


def run_to(ended: float) -> SkillExecution:
    return SkillExecution("arm.reach", 0.0, None, ended)


def test_the_tightest_bound_is_in_force_from_decision_to_end() -> None:
    left = RunData(
        decisions=[moving(1.0, 0.1, human_distance=3.0)],
        samples=[
            sample(0.5, human_distance=3.0),
            sample(2.0, human_distance=2.0),
            sample(4.0, human_distance=1.0),
        ],
        runs=[run_to(3.0)],
    )
    distance = build_series(left, SITES).quantities["human_distance"]
    assert distance.points == [(0.5, 3.0), (1.0, 3.0), (2.0, 2.0), (4.0, 1.0)]
    assert [(limit.time, limit.rule) for limit in distance.lower] == [(1.0, "arm-separation"), (3.0, "")]
    assert distance.lower[0].value == pytest.approx(0.8995)
    assert distance.upper == []


def test_the_requested_speed_is_plotted_while_a_rule_bounds_it() -> None:
    left = RunData(
        decisions=[moving(1.0, 0.15, human_distance=3.0)],
        samples=[sample(2.0, human_distance=1.0), sample(2.5, human_distance=3.0)],
        runs=[run_to(3.0)],
    )
    speed = build_series(left, SITES).quantities["move_tool.speed"]
    assert speed.is_requested
    assert [(limit.time, limit.value) for limit in speed.upper] == [
        (1.0, 0.5),
        (2.0, 0.2),
        (2.5, 0.5),
        (3.0, None),
    ]
    assert speed.points == [(1.0, 0.15), (3.0, None)]


def test_the_smallest_margin_of_each_rule_is_found_and_a_breach_is_negative() -> None:
    left = RunData(
        decisions=[moving(1.0, 0.1, human_distance=3.0)],
        samples=[sample(2.0, human_distance=0.8), sample(2.5, human_distance=2.0)],
    )
    nearest = build_series(left, SITES).closest_approaches["arm-separation", "human_distance"]
    assert (nearest.time, nearest.measured) == (2.0, 0.8)
    assert nearest.margin == pytest.approx(-0.0995)


def test_of_a_family_the_nearest_member_is_named() -> None:
    still = [0.0] * 7
    left = RunData(
        decisions=[moving(1.0, 0.1, joint_velocity=still)],
        samples=[sample(2.0, joint_velocity=[0.0, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0])],
    )
    nearest = build_series(left, SITES).closest_approaches["joint-speeds", "joint_velocity"]
    assert (nearest.quantity, nearest.measured) == ("abs(joint_velocity[j2])", 2.0)
    assert nearest.margin == pytest.approx(0.175)


def test_a_denied_action_and_an_absent_site_bound_nothing() -> None:
    denied = RunData(decisions=[moving(1.0, 0.1, "DENY", human_distance=3.0)])
    assert build_series(denied, SITES).quantities == {}
    allowed = RunData(decisions=[moving(1.0, 0.1, human_distance=3.0)])
    assert build_series(allowed, {}).quantities == {}


def test_a_long_run_is_sampled() -> None:
    samples: list[tuple[float, Mapping[str, Any]]] = [
        sample(0.1 * n, human_distance=3.0) for n in range(3 * MAX_SAMPLES)
    ]
    series = build_series(RunData(samples=samples), SITES)
    assert series.sample_step == 4
    assert len(series.quantities["human_distance"].points) == 3 * MAX_SAMPLES
