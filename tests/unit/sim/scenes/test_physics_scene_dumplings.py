from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest

from aeros.runtime.ports import MotionCompletion
from aeros.sim.physics import PhysicsPlant, make_plant
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.ground_truth import is_done

pytestmark = pytest.mark.physics

Run = Callable[[PhysicsPlant, str], list[MotionCompletion]]


def predicates(plant: PhysicsPlant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def test_prepare_wrap_and_boil_make_a_dumpling(run_dumpling_skill: Run) -> None:
    plant = make_plant(shipped_scene("dumpling_bench"), 3)
    assert not predicates(plant)["dough_on_workspace"]
    assert not predicates(plant)["filling_on_workspace"]

    assert all(ended.completed for ended in run_dumpling_skill(plant, "prepare"))
    state = predicates(plant)
    assert state["dough_on_workspace"]
    assert state["filling_on_workspace"]
    assert state["wrapper_aligned"]
    assert not state["dumpling_wrapped"]

    assert all(ended.completed for ended in run_dumpling_skill(plant, "wrap"))
    assert predicates(plant)["dumpling_wrapped"]
    assert plant.truth()["dumpling_wrapped"]
    assert not predicates(plant)["dumpling_cooked"]
    assert not is_done(plant)

    assert all(ended.completed for ended in run_dumpling_skill(plant, "boil"))
    state = predicates(plant)
    assert state["dumpling_cooked"]
    assert state["dough_on_workspace"]
    assert state["filling_on_workspace"]
    assert is_done(plant)
    plant.close()


def test_recover_realigns_a_wrapper_that_was_put_down_askew(
    run_dumpling_skill: Run, dumpling_skills: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = make_plant(shipped_scene("dumpling_bench"), 4)
    measure = plant._scene.measure

    def shifted() -> dict[str, Any]:
        x, y, z = measure()["press_position"]
        return {**measure(), "press_position": (x + 0.013, y + 0.004, z)}

    with monkeypatch.context() as patch:
        patch.setattr(plant._scene, "measure", shifted)
        run_dumpling_skill(plant, "prepare")
    assert predicates(plant)["dough_on_workspace"]
    assert not predicates(plant)["wrapper_aligned"]
    assert all(ended.completed for ended in run_dumpling_skill(plant, "recover"))
    assert predicates(plant)["wrapper_aligned"]
    assert predicates(plant)["filling_on_workspace"]
    plant.close()


def test_an_empty_wrapper_is_folded_but_not_sealed(
    run_dumpling_skill: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = make_plant(shipped_scene("dumpling_bench"), 5)
    measure = plant._scene.measure
    with monkeypatch.context() as patch:
        patch.setattr(plant._scene, "measure", lambda: {**measure(), "filling_on_workspace": True})
        run_dumpling_skill(plant, "prepare")
    assert predicates(plant)["wrapper_aligned"]
    run_dumpling_skill(plant, "wrap")
    assert predicates(plant)["wrapper_fold"] > 2.8
    assert not predicates(plant)["dumpling_wrapped"]
    plant.close()
