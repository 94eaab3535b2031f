"""The table is wiped and organized by motors and contact alone."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from aeros.sim.geometry import Pose, Vector3, yaw_orientation
from aeros.sim.layouts.cameras import fixed_camera
from aeros.sim.layouts.placement import place_things
from aeros.sim.perception.inspection import inspect_table
from aeros.sim.physics import NoDisturbance, PhysicsPlant, PlantParts, make_plant
from aeros.sim.randomness import RandomSource
from aeros.sim.scenes import physics_scene
from aeros.sim.scenes.scene import DetectionFilter
from aeros.skill import Action, act
from aeros.spec.model.scene import Scene
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.acting import allow, execute

pytestmark = pytest.mark.physics

RunSkill = Callable[..., str | None]


SKILLS = Path(__file__).parents[4] / "ecms" / "clean_table" / "skills.py"


MAST = fixed_camera(shipped_scene("table").cameras["mast"])


class Onlooker(NoDisturbance):
    """Sees what the camera's evaluation sees of the scene, and can be blinded."""

    is_blind = False

    def attach(self, stage: PlantParts) -> None:
        self.stage = stage

    def detection_filter(self, camera: str) -> DetectionFilter:
        return lambda found: None if self.is_blind else found

    def clean(self) -> float:
        """The share of the area that is clean in a picture from the mast."""
        return inspect_table(self.stage.world.renderer.render(MAST), MAST).clean_share


def observed(plant: PhysicsPlant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


@pytest.mark.parametrize("seed", [0, pytest.param(4, marks=pytest.mark.deep)])
def test_wiping_and_then_organizing_cleans_the_table(seed: int, run_skill: RunSkill) -> None:
    onlooker = Onlooker()
    plant = make_plant(shipped_scene("table"), seed, disturbance=onlooker)
    before = observed(plant)
    assert before["wiped_fraction"] == 0.0
    assert before["clutter_on_table"]
    assert before["wiping_area_clear"]
    assert run_skill(plant, "clean_table", "wipe") is None
    wiped = observed(plant)
    assert wiped["table_wiped"]
    assert not wiped["table_organized"]
    assert run_skill(plant, "clean_table", "verify") is None
    assert observed(plant)["table_verified"] is False, "clutter is seen"
    assert onlooker.clean() == pytest.approx(wiped["wiped_fraction"], abs=0.02)
    assert run_skill(plant, "clean_table", "organize") is None
    after = observed(plant)
    assert after["table_organized"]
    assert not after["clutter_on_table"]
    assert "clutter_position" not in after
    assert run_skill(plant, "clean_table", "verify") is None
    assert observed(plant)["table_verified"]
    onlooker.is_blind = True
    assert execute(plant, act("look", camera="mast"), allow, 1e9).completed
    assert observed(plant)["table_verified"] is False, "a picture that shows nothing verifies nothing"


def test_a_sponge_dropped_in_a_stroke_is_recovered_and_wiping_starts_anew(run_skill: RunSkill) -> None:
    onlooker = Onlooker()
    plant = make_plant(shipped_scene("table"), 2, disturbance=onlooker)
    assert run_skill(plant, "clean_table", "wipe", actions=15) is None
    assert observed(plant)["holding"]
    assert execute(plant, act("grip", width=0.08, force=10.0), allow, 1e9).completed
    assert not observed(plant)["table_wiped"]
    assert run_skill(plant, "clean_table", "recover") is None
    after = observed(plant)
    for at, rest in zip(after["sponge_position"], after["sponge_rest_position"], strict=True):
        assert at == pytest.approx(rest, abs=0.01)
    assert run_skill(plant, "clean_table", "verify") is None
    assert 0.2 < after["wiped_fraction"] < 0.8
    assert onlooker.clean() == pytest.approx(after["wiped_fraction"], abs=0.03)
    assert run_skill(plant, "clean_table", "wipe") is None
    assert observed(plant)["table_wiped"]


def test_carrying_the_sponge_over_the_dirt_wipes_nothing(run_skill: RunSkill) -> None:
    plant = make_plant(shipped_scene("table"), 1)
    assert run_skill(plant, "clean_table", "wipe", actions=11) is None
    after = observed(plant)
    assert after["tool_position"][0] == pytest.approx(0.395, abs=0.005)
    assert after["holding"]
    assert after["wiped_fraction"] == 0.0


@pytest.mark.parametrize("cube", [((0.41, -0.35, 0.021), 0.1), ((0.493, -0.39, 0.021), -0.288)])
def test_clutter_at_the_bin_is_reached_and_a_can_that_lies_is_gripped(
    cube: tuple[Vector3, float], run_skill: RunSkill, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, yaw = cube

    def fallen(scene: Scene, chance: RandomSource) -> dict[str, Pose]:
        lying = Pose((0.57, -0.24, 0.021), (0.0, 2**-0.5, 0.0, 2**-0.5))
        return {**place_things(scene, chance), "cube": Pose(place, yaw_orientation(yaw)), "can": lying}

    monkeypatch.setattr(physics_scene, "place_things", fallen)
    plant = make_plant(shipped_scene("table"), 0)
    assert run_skill(plant, "clean_table", "organize") is None
    assert observed(plant)["table_organized"]


OBSERVED = {
    "holding": False,
    "tool_position": (0.4, 0.0, 0.2),
    "sponge_seen": True,
    "sponge_position": (0.5, 0.25, 0.015),
    "sponge_yaw": 0.0,
    "sponge_rest_position": (0.45, 0.34, 0.015),
    "bin_position": (0.45, -0.5, 0.085),
    "clutter_on_table": True,
    "clutter_position": (0.4, -0.25, 0.02),
    "clutter_yaw": 0.0,
}


LOOKED_FOR = {
    "sponge_seen",
    "sponge_position",
    "sponge_yaw",
    "clutter_on_table",
    "clutter_position",
    "clutter_yaw",
}


@pytest.mark.parametrize("missing", OBSERVED)
def test_a_skill_waits_or_looks_for_a_reading_that_is_missing(missing: str) -> None:
    body = runpy.run_path(str(SKILLS))["organize"](OBSERVED, {})
    action: Action = next(body)
    without = {name: value for name, value in OBSERVED.items() if name != missing}
    trying = act("look", camera="overhead") if missing in LOOKED_FOR else act("wait", duration=0.25)
    while action != trying:
        action = body.send(without)
    assert body.send(without) == trying
    assert body.send({**OBSERVED, "tool_position": (0.3, 0.0, 0.4)}) != trying


def test_clutter_in_a_hand_that_was_stopped_is_let_go_over_the_bin_alone() -> None:
    body = runpy.run_path(str(SKILLS))["organize"]({**OBSERVED, "holding": True}, {})
    actions = [next(body)]
    while actions[-1].kind != "grip":
        actions.append(body.send({**OBSERVED, "holding": True}))
    x, y, _ = actions[-2].parameters["target"]
    assert (x, y) == (0.45, -0.5)


def test_layout_varies_with_the_seed_and_repeats() -> None:
    first, again, other = (observed(make_plant(shipped_scene("table"), seed)) for seed in (0, 0, 1))
    assert first == again
    assert first["clutter_position"] != other["clutter_position"]
    assert first["sponge_rest_position"] != other["sponge_rest_position"]
