"""The shipped tasks on MuJoCo: the same skills and perceivers reach their goals, by truth, and repeat."""

from __future__ import annotations

from contextlib import closing

import pytest

from aeros.sim.physics import PhysicsPlant, make_mujoco_engine, make_plant
from tests.modules.robot import Robot
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.ground_truth import is_done

pytestmark = [pytest.mark.physics, pytest.mark.deep]

TASKS = {
    "make_dumplings": ("dumpling_bench", ("prepare", "wrap", "boil")),
    "clean_table": ("table", ("wipe", "organize", "verify")),
    "fetch_object": ("fetch", ("navigate", "detect", "grasp", "deliver")),
}
"""Scene and skills, in order, of each module."""


def on_mujoco(scene: str, seed: int) -> PhysicsPlant:
    return make_plant(shipped_scene(scene), seed, engine=make_mujoco_engine())


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("module", list(TASKS))
def test_skills_reach_the_goal_by_truth(module: str, seed: int) -> None:
    scene, skills = TASKS[module]
    plant = on_mujoco(scene, seed)
    with closing(plant):
        robot = Robot(module, plant)
        assert not is_done(plant)
        for skill in skills:
            assert robot.run(skill) is None
        assert is_done(plant)


def test_the_same_seed_repeats_bit_for_bit() -> None:
    ends = []
    for _ in range(2):
        plant = on_mujoco("fetch", 5)
        with closing(plant):
            robot = Robot("fetch_object", plant)
            for skill in ("navigate", "detect", "grasp"):
                robot.run(skill)
            ends.append((plant.now(), plant.observe()))
    assert ends[0] == ends[1]
