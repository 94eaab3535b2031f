"""The table is wiped and organized by motors and contact alone."""

from __future__ import annotations

import runpy
from contextlib import closing
from pathlib import Path

import pytest

from aeros.sim.geometry import Pose, Vector3, yaw_orientation
from aeros.sim.layouts.placement import place_things
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.randomness import RandomSource
from aeros.sim.scenes import physics_scene
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.skill import Action, act
from aeros.spec.model.scene import BodyPart, Scene
from aeros.spec.scenes.load import add_scene
from tests.modules.robot import Robot
from tests.shipped_scenes import ECMS, shipped_scene

pytestmark = pytest.mark.physics

EXTRAS = Path(__file__).parent / "scenes"

SKILLS = ECMS / "clean_table" / "skills.py"


def table(seed: int, extra: str | None = None) -> tuple[Robot, PhysicsPlant]:
    scene = shipped_scene("table")
    plant = make_plant(scene if extra is None else add_scene(scene, str(EXTRAS / extra)), seed)
    return Robot("clean_table", plant), plant


def clean(plant: PhysicsPlant) -> float:
    """The share of the area that is wiped in truth."""
    assert isinstance(plant._scene, PhysicsScene)
    return plant._scene.coating_of("dirt").wiped_share


def are_tidy(plant: PhysicsPlant) -> bool:
    """The table is wiped, organized and verified, in truth and in each of its parts."""
    return all(value for name, value in plant.truth().items() if name.startswith("clean_table.table_"))


@pytest.mark.parametrize("seed", [0, pytest.param(4, marks=pytest.mark.deep)])
def test_wiping_and_then_organizing_cleans_the_table(seed: int) -> None:
    robot, plant = table(seed)
    with closing(plant):
        before = robot.observed()
        assert before["wiped_fraction"] == 0.0
        assert (before["clutter_on_table"], before["wiping_area_clear"]) == (True, True)
        assert robot.run("wipe") is None
        wiped = robot.observed()
        assert (wiped["table_wiped"], wiped["table_organized"]) == (True, False)
        assert wiped["wiped_fraction"] == pytest.approx(clean(plant), abs=0.02)
        assert robot.run("verify") is None
        assert robot.observed()["table_verified"] is False, "clutter is seen"
        assert robot.run("organize") is None
        after = robot.observed()
        assert (after["table_organized"], after["clutter_on_table"]) == (True, False)
        assert "clutter_position" not in after
        assert robot.run("verify") is None
        assert robot.observed()["table_verified"]
        assert are_tidy(plant)


@pytest.mark.deep
def test_a_sponge_dropped_in_a_stroke_is_recovered_and_wiping_starts_anew() -> None:
    robot, plant = table(2)
    with closing(plant):
        assert robot.run("wipe", actions=15) is None
        assert robot.observed()["holding"]
        assert robot.do("grip", width=0.08, force=10.0).completed
        assert robot.run("recover") is None
        after = robot.observed()
        assert not after["table_wiped"]
        assert after["sponge_position"] == pytest.approx(after["sponge_rest_position"], abs=0.01)
        assert 0.2 < after["wiped_fraction"] < 0.8
        assert after["wiped_fraction"] == pytest.approx(clean(plant), abs=0.03)
        assert robot.run("wipe") is None
        assert robot.observed()["table_wiped"]


def test_carrying_the_sponge_over_the_dirt_wipes_nothing() -> None:
    robot, plant = table(1)
    with closing(plant):
        assert robot.run("wipe", actions=11) is None
        after = robot.observed()
        assert after["tool_position"][0] == pytest.approx(0.395, abs=0.005)
        assert after["holding"]
        assert clean(plant) == 0.0


@pytest.mark.parametrize(
    "cube",
    [
        ((0.41, -1.55, 0.021), 0.1),
        pytest.param(((0.493, -1.59, 0.021), -0.288), marks=pytest.mark.deep),
    ],
)
def test_clutter_at_the_bin_is_reached_and_a_can_that_lies_is_gripped(
    cube: tuple[Vector3, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    place, yaw = cube

    def fallen(scene: Scene, chance: RandomSource) -> dict[str, Pose]:
        lying = Pose((0.57, -1.44, 0.021), (0.0, 2**-0.5, 0.0, 2**-0.5))
        return {**place_things(scene, chance), "cube": Pose(place, yaw_orientation(yaw)), "can": lying}

    monkeypatch.setattr(physics_scene, "place_things", fallen)
    robot, plant = table(0)
    with closing(plant):
        assert robot.run("organize") is None
        assert robot.observed()["table_organized"]


@pytest.mark.deep
def test_red_and_magenta_blocks_in_the_area_are_put_into_the_bin_before_it_is_wiped() -> None:
    robot, plant = table(0, "coloured_blocks.yaml")
    with closing(plant):
        assert robot.observed()["wiping_area_clear"] is False
        assert robot.run("organize") is None
        after = robot.observed()
        assert (after["table_organized"], after["wiping_area_clear"]) == (True, True)
        for block in ("red", "magenta"):
            assert is_in_bin(plant, block)
        assert robot.run("wipe") is None
        assert robot.run("verify") is None
        assert robot.observed()["table_verified"]
        assert are_tidy(plant)


@pytest.mark.deep
def test_dominoes_of_the_tables_colour_are_put_into_the_bin() -> None:
    robot, plant = table(0, "dominoes.yaml")
    with closing(plant):
        assert robot.observed()["wiping_area_clear"] is False
        assert robot.run("organize") is None
        assert robot.observed()["table_organized"] is True
        assert all(is_in_bin(plant, piece) for piece in ("inner", "outer", "cube", "can"))


def test_a_block_that_is_too_large_to_grip_is_reported_before_anything_is_moved() -> None:
    robot, plant = table(0, "large_block.yaml")
    with closing(plant):
        assert robot.run("organize") is None
        after = robot.observed()
        assert (after["table_organized"], after["wiping_area_clear"]) == (False, False)
        assert after["clutter_ungraspable"] is True
        assert after["clutter_ungraspable_position"] == pytest.approx((0.5, -1.18, 0.025), abs=0.01)
        assert not any(is_in_bin(plant, piece) for piece in ("cube", "can"))


def is_in_bin(plant: PhysicsPlant, body: str) -> bool:
    """True if the middle of a body is in the bin."""
    assert isinstance(plant._scene, PhysicsScene)
    x, y, _ = plant._scene.pose_of(BodyPart(body)).position
    return abs(x - 0.45) < 0.09 and abs(y + 1.70) < 0.08


OBSERVED = {
    "holding": False,
    "tool_position": (0.4, -1.2, 0.2),
    "base_position": (0.0, -1.2, 0.0),
    "sponge_seen": True,
    "sponge_position": (0.5, -0.95, 0.015),
    "sponge_yaw": 0.0,
    "sponge_rest_position": (0.45, -0.86, 0.015),
    "bin_position": (0.45, -1.7, 0.085),
    "clutter_on_table": True,
    "clutter_position": (0.4, -1.45, 0.02),
    "clutter_yaw": 0.0,
    "clutter_length": 0.04,
    "clutter_missing": False,
}


INPUTS = {"hand_speed": 0.45}

LOOKED_FOR = {
    "sponge_seen",
    "sponge_position",
    "sponge_yaw",
    "clutter_on_table",
    "clutter_position",
    "clutter_yaw",
    "clutter_length",
    "clutter_missing",
}


@pytest.mark.parametrize("missing", OBSERVED)
def test_a_skill_waits_or_looks_for_a_reading_that_is_missing(missing: str) -> None:
    body = runpy.run_path(str(SKILLS))["organize"](OBSERVED, INPUTS)
    action: Action = next(body)
    without = {name: value for name, value in OBSERVED.items() if name != missing}
    trying = act("look", camera="overhead") if missing in LOOKED_FOR else act("wait", duration=0.25)
    while action != trying:
        action = body.send(without)
    assert body.send(without) == trying
    assert body.send({**OBSERVED, "tool_position": (0.3, -1.2, 0.4)}) != trying


def test_clutter_in_a_hand_that_was_stopped_is_let_go_over_the_bin_alone() -> None:
    body = runpy.run_path(str(SKILLS))["organize"]({**OBSERVED, "holding": True}, INPUTS)
    actions = [next(body)]
    while actions[-1].kind != "grip":
        actions.append(body.send({**OBSERVED, "holding": True}))
    x, y, _ = actions[-2].parameters["target"]
    assert (x, y) == (0.45, -1.7)


def test_layout_varies_with_the_seed_and_repeats() -> None:
    first, again, other = (table(seed)[0].observed() for seed in (0, 0, 1))
    assert first == again
    assert first["clutter_position"] != other["clutter_position"]
    assert first["sponge_rest_position"] != other["sponge_rest_position"]
