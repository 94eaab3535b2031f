"""A planner that takes its time: which delay it waits, and what it does to each step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from aeros.agent.planning.base import RulePlanner
from aeros.agent.planning.routing import RoutedTask
from aeros.agent.world.world import world_from_readings
from aeros.experiments.slow_planner import SlowPlanner
from aeros.spec.model.cause import Cause
from tests.unit.agent.dumplings import MAKE_DUMPLINGS, STATE

ROUTED = RoutedTask("dumpling", MAKE_DUMPLINGS)
WORLD = world_from_readings(STATE, {}, 0.0)


@pytest.fixture
def slept(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    seen: list[float] = []
    monkeypatch.setattr("aeros.experiments.slow_planner.time.sleep", seen.append)
    return seen


def test_a_plan_after_a_failure_has_a_delay_of_its_own(slept: list[float]) -> None:
    planner = SlowPlanner(2.0, 0.5)
    failed = replace(WORLD, failures=(Cause("rule", "r", "no"),))
    for world in (WORLD, failed, WORLD):
        planner.plan(ROUTED, world, {})
    assert slept == [2.0, 0.5, 2.0]


@pytest.mark.usefixtures("slept")
def test_it_plans_by_the_rules() -> None:
    graph = SlowPlanner(0.0, 0.0).plan(ROUTED, WORLD, {})
    assert graph == RulePlanner().plan(ROUTED, WORLD, {})
    assert SlowPlanner.name == "rules"


@pytest.mark.usefixtures("slept")
def test_each_step_is_changed_as_requested() -> None:
    def once(step: Any) -> Any:
        return replace(step, retry=7)

    graph = SlowPlanner(0.0, 0.0, once).plan(ROUTED, WORLD, {})
    assert [step.retry for step in graph.steps] == [7, 7, 7, 7]
    assert [step.skill for step in graph.steps] == ["prepare", "recover", "wrap", "boil"]
