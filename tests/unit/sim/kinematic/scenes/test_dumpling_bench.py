"""The bench without physics: the handle turns the lid, the lid folds the wrapper."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, pi
from typing import Any

import pytest

from aeros.runtime.ports import Plant
from aeros.sim.kinematic.plant import make_plant
from aeros.skill import act
from tests.unit.sim.acting import allow, execute

RunSkill = Callable[..., str | None]


def observed(plant: Plant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def test_a_dumpling_moved_on_the_press_takes_its_filling_along(run_skill: RunSkill) -> None:
    plant = make_plant("dumpling_bench", 0)
    for skill in ("prepare", "recover"):
        assert run_skill(plant, "make_dumplings", skill) is None
        assert observed(plant)["filling_on_workspace"]
        assert observed(plant)["wrapper_aligned"]


def test_a_wrapper_without_its_filling_is_folded_but_never_wrapped(run_skill: RunSkill) -> None:
    plant = make_plant("dumpling_bench", 0)
    # As many actions as lay the wrapper out: the filling stays on its stand.
    assert run_skill(plant, "make_dumplings", "prepare", actions=15) is None
    assert execute(plant, act("look", camera="overhead"), allow, inf).completed
    assert observed(plant)["wrapper_aligned"]
    assert run_skill(plant, "make_dumplings", "wrap") is None
    after = observed(plant)
    assert after["wrapper_fold"] == pytest.approx(pi)
    assert not after["dumpling_wrapped"]
