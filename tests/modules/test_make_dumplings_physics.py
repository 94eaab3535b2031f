"""A dumpling is laid out, wrapped and cooked by motors and contact alone."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import pytest

from aeros.sim.physics import PhysicsPlant, make_plant
from tests.modules.robot import Robot
from tests.shipped_scenes import shipped_scene
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
