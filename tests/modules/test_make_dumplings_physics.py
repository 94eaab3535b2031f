"""A dumpling is laid out, wrapped and cooked by motors and contact alone."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.skill import Action
from tests.modules.robot import Robot
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.bullet.bullet_parts import as_bullet
from tests.unit.sim.ground_truth import is_done

pytestmark = pytest.mark.physics


def bench(seed: int) -> tuple[Robot, PhysicsPlant]:
    plant = make_plant(shipped_scene("dumpling_bench"), seed)
    return Robot("make_dumplings", plant), plant


@pytest.mark.deep  # tests/repo/pages/test_readme.py makes one on physics
def test_prepare_wrap_and_boil_make_a_dumpling() -> None:
    robot, plant = bench(3)
    with closing(plant):
        before = robot.observed()
        assert (before["dough_on_workspace"], before["filling_on_workspace"]) == (False, False)
        assert robot.run("prepare") is None
        laid = robot.observed()
        assert (laid["dough_on_workspace"], laid["filling_on_workspace"], laid["wrapper_aligned"]) == (
            True,
        ) * 3
        assert not laid["dumpling_wrapped"]
        assert robot.run("wrap") is None
        assert robot.observed()["dumpling_wrapped"]
        assert plant.truth()["make_dumplings.dumpling_wrapped"]
        assert not robot.observed()["dumpling_cooked"]
        assert not is_done(plant)
        assert robot.run("boil") is None
        after = robot.observed()
        assert (after["dumpling_cooked"], after["dumplings_cooked"]) == (True, 1)
        # The press is free, and the other wrapper waits on its tray.
        assert (after["dough_on_workspace"], after["filling_on_workspace"]) == (False, False)
        assert not after["dumpling_wrapped"]
        assert is_done(plant)


def test_recover_realigns_a_wrapper_that_was_put_down_askew(monkeypatch: pytest.MonkeyPatch) -> None:
    robot, plant = bench(4)
    measure = plant._scene.measure

    def shifted() -> dict[str, Any]:
        x, y, z = measure()["make_dumplings.press_position"]
        return {**measure(), "make_dumplings.press_position": (x + 0.013, y + 0.004, z)}

    with closing(plant):
        with monkeypatch.context() as patch:
            patch.setattr(plant._scene, "measure", shifted)
            robot.run("prepare")
        robot.do("look", camera="overhead")
        assert robot.observed()["dough_on_workspace"]
        assert not robot.observed()["wrapper_aligned"]
        assert robot.run("recover") is None
        after = robot.observed()
        assert (after["wrapper_aligned"], after["filling_on_workspace"]) == (True, True)


@pytest.mark.deep  # tests/modules/test_kinematic.py has the same of the kinematic plant
def test_an_empty_wrapper_is_folded_but_not_sealed() -> None:
    robot, plant = bench(5)
    with closing(plant):
        # As many actions as lay the wrapper out: the filling stays on its stand.
        assert robot.run("prepare", actions=15) is None
        assert robot.do("look", camera="overhead").completed
        assert robot.observed()["wrapper_aligned"]
        assert robot.run("wrap") is None
        after = robot.observed()
        assert after["wrappers_shut"] == 1  # the other one is worked on from now on
        assert not after["dumpling_wrapped"]


ON_BED, WRAPPER_ON_BED, AWAY = (0.524, 0.0, 0.0886), (0.52, 0.002, 0.083), (0.15, 0.45, 0.0886)
"""Where a filling or a wrapper lies on the press, and a place out of the hand's way, m."""


@pytest.mark.deep  # tests/modules/make_dumplings/test_motions.py has the heights of the grips
@pytest.mark.parametrize(
    ("skill", "thing", "place"),
    [("prepare", "filling", ON_BED), ("recover", "wrapper", WRAPPER_ON_BED)],
    ids=["filling-in-the-way", "wrapper-to-align"],
)
def test_fingers_that_miss_a_thing_on_the_press_do_not_close_on_its_bed(
    skill: str, thing: str, place: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, plant = bench(4)
    scene, world = plant._scene, as_bullet(plant._world)
    assert isinstance(scene, PhysicsScene)
    number, press, hand = scene.body(thing), scene.body("press"), plant._simulated
    execute, forces, grips = robot._execute, [0.0], [0]

    def put(where: tuple[float, float, float]) -> None:
        bullet.resetBasePositionAndOrientation(number, where, (0, 0, 0, 1), physicsClientId=world.client)

    def feel() -> None:
        forces.extend(
            one.force
            for one in world.contacts(hand.body)
            if one.body_b == press and one.link_a in hand.fingers
        )

    def tease(action: Action) -> Any:
        """Take the thing away while fingers close on it, and put it back for the next picture."""
        closes = action.kind == "grip" and action.parameters["width"] < 0.05
        if closes:
            grips[0] += 1
            put(AWAY)
        elif action.kind == "look":
            put(place)
        return execute(action)

    with closing(plant):
        put(place)
        robot.do("look", camera="overhead")
        world.after_step.append(feel)
        monkeypatch.setattr(robot, "_execute", tease)
        robot.run(skill, actions=40)
    assert grips[0] > 1
    assert max(forces) == 0.0
