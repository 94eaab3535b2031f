"""Something is fetched: found in pictures, grasped by friction, delivered by driving."""

from __future__ import annotations

from collections.abc import Callable
from math import dist
from typing import Any, Final

import pytest

from aeros.sim.layouts import fetch
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.skill import act
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute
from tests.unit.sim.ground_truth import is_done

pytestmark = pytest.mark.physics

RunSkill = Callable[..., str | None]

RULES = (
    ("robot_at_target", "navigate"),
    ("object_detected", "detect"),
    ("object_grasped", "grasp"),
    ("object_delivered", "deliver"),
)
"""Unless the first holds, do the second."""


AGE: Final = 3.0
"""Time for which a detection holds where a test waits for its end, s: a tenth of what it is."""


def observed(plant: PhysicsPlant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


@pytest.mark.parametrize("seed", [0, pytest.param(3, marks=pytest.mark.deep)])
def test_each_step_makes_its_own_predicate_true_and_the_last_one_the_goal(
    seed: int, run_skill: RunSkill
) -> None:
    plant = make_plant(shipped_scene("fetch"), seed)
    for predicate, skill in RULES:
        assert not observed(plant)[predicate]
        assert not is_done(plant)
        assert run_skill(plant, "fetch_object", skill) is None
        assert observed(plant)[predicate]
    assert is_done(plant)


def test_rules_finish_a_delivery_that_was_interrupted_on_the_way(
    run_skill: RunSkill, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = make_plant(shipped_scene("fetch"), 2)
    for _, skill in RULES[:3]:
        assert run_skill(plant, "fetch_object", skill) is None
    assert run_skill(plant, "fetch_object", "deliver", actions=3) is None
    # The detection that the can was grasped by is long over by then.
    monkeypatch.setattr(fetch, "MAX_DETECTION_AGE", AGE)
    execute(plant, act("wait", duration=AGE), allow, 1e9)
    done = []
    for predicate, skill in RULES:
        if not observed(plant)[predicate]:
            done.append(skill)
            assert run_skill(plant, "fetch_object", skill) is None
    assert done == ["navigate", "deliver"]
    assert observed(plant)["object_delivered"]


def test_nothing_is_known_of_the_object_before_a_look() -> None:
    before = observed(make_plant(shipped_scene("fetch"), 0))
    assert not before["object_detected"]
    assert "object_position" not in before


def test_the_mast_camera_locates_the_can_and_its_detection_expires(
    run_skill: RunSkill, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = make_plant(shipped_scene("fetch"), 5)
    assert run_skill(plant, "fetch_object", "navigate") is None
    assert run_skill(plant, "fetch_object", "detect") is None
    after = observed(plant)
    monkeypatch.setattr(fetch, "MAX_DETECTION_AGE", AGE)
    station = after["station_position"]
    assert dist(after["object_position"][:2], (station[0] + 0.58, station[1])) < 0.15
    assert after["object_detected"]
    execute(plant, act("wait", duration=AGE), allow, 1e9)
    assert not observed(plant)["object_detected"]


def test_an_arm_in_the_way_hides_the_can(run_skill: RunSkill) -> None:
    plant = make_plant(shipped_scene("fetch"), 0)
    execute(plant, act("look", camera="mast"), allow, 1e9)
    assert not observed(plant)["object_detected"]


def test_a_grasp_halted_on_the_way_down_is_recovered(run_skill: RunSkill) -> None:
    plant = make_plant(shipped_scene("fetch"), 1)
    for skill in ("navigate", "detect"):
        assert run_skill(plant, "fetch_object", skill) is None
    assert run_skill(plant, "fetch_object", "grasp", actions=6) is None
    assert not observed(plant)["object_grasped"]
    assert run_skill(plant, "fetch_object", "recover") is None
    assert observed(plant)["object_detected"]
    assert run_skill(plant, "fetch_object", "grasp") is None
    assert observed(plant)["object_grasped"]


def test_a_camera_that_is_not_there_is_refused() -> None:
    ended = execute(make_plant(shipped_scene("fetch"), 0), act("look", camera="ceiling"), allow, 1e9)
    assert ended.reason == "unknown camera: `ceiling`"


@pytest.mark.parametrize("asks", [True, False])
def test_a_detection_is_dropped_once_the_can_was_held_even_if_not_observed(
    asks: bool, run_skill: RunSkill
) -> None:
    plant = make_plant(shipped_scene("fetch"), 0)
    for skill in ("navigate", "detect"):
        assert run_skill(plant, "fetch_object", skill) is None
    x, y, z = observed(plant)["object_position"]
    for action in (
        act("grip", width=0.08, force=10.0),
        act("move_tool", target=(x, y, z + 0.15), yaw=0.0, speed=0.3),
        act("move_tool", target=(x, y, z + 0.01), yaw=0.0, speed=0.1),
        act("grip", width=0.03, force=10.0),
        act("move_tool", target=(x, y, z + 0.05), yaw=0.0, speed=0.1),
        act("grip", width=0.08, force=10.0),
    ):
        execute(plant, action, allow, 1e9)
        if asks:
            observed(plant)
    after = observed(plant)
    assert not after["object_grasped"]
    assert not after["object_detected"]
