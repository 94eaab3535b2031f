"""The table is wiped and organized by motors and contact alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from aeros.sim.geometry import Pose, turned
from aeros.sim.layouts.dirt import DirtMap
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.skill import act
from tests.unit.sim.acting import allow, execute

pytestmark = pytest.mark.physics

RunSkill = Callable[..., str | None]

SPONGE = (0.10, 0.07, 0.03)
"""Edges of a box to wipe with, m."""


def observed(plant: PhysicsPlant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


@pytest.mark.parametrize("seed", [0, 4])
def test_wiping_and_then_organizing_cleans_the_table(seed: int, run_skill: RunSkill) -> None:
    plant = make_plant("table", seed)
    before = observed(plant)
    assert before["wiped_fraction"] == 0.0
    assert before["clutter_on_table"]
    assert before["wiping_area_clear"]
    assert run_skill(plant, "clean_table", "wipe") is None
    wiped = observed(plant)
    assert wiped["table_wiped"]
    assert not wiped["table_organized"]
    assert run_skill(plant, "clean_table", "organize") is None
    after = observed(plant)
    assert after["table_organized"]
    assert not after["clutter_on_table"]
    assert "clutter_position" not in after


def test_a_sponge_dropped_in_a_stroke_is_recovered_and_wiping_starts_anew(run_skill: RunSkill) -> None:
    plant = make_plant("table", 2)
    assert run_skill(plant, "clean_table", "wipe", actions=13) is None
    assert observed(plant)["holding"]
    assert execute(plant, act("grip", width=0.08, force=10.0), allow, 1e9).completed
    assert not observed(plant)["table_wiped"]
    assert run_skill(plant, "clean_table", "recover") is None
    after = observed(plant)
    for at, rest in zip(after["sponge_position"], after["sponge_rest_position"], strict=True):
        assert at == pytest.approx(rest, abs=0.01)
    assert run_skill(plant, "clean_table", "wipe") is None
    assert observed(plant)["table_wiped"]


def test_carrying_the_sponge_over_the_dirt_wipes_nothing(run_skill: RunSkill) -> None:
    plant = make_plant("table", 1)
    assert run_skill(plant, "clean_table", "wipe", actions=9) is None
    after = observed(plant)
    assert after["tool_position"][0] == pytest.approx(0.395, abs=0.005)
    assert after["holding"]
    assert after["wiped_fraction"] == 0.0


def test_layout_varies_with_the_seed_and_repeats() -> None:
    first, again, other = (observed(make_plant("table", seed)) for seed in (0, 0, 1))
    assert first == again
    assert first["clutter_position"] != other["clutter_position"]
    assert first["sponge_rest_position"] != other["sponge_rest_position"]


def test_only_cells_under_the_wiping_face_are_wiped() -> None:
    dirt = DirtMap((0.0, 0.0), (0.2, 0.2))
    dirt.wipe(Pose((0.1, 0.1, 0.015), turned(0.0)), SPONGE)
    assert dirt.wiped_fraction == pytest.approx(0.10 * 0.06 / 0.04, abs=0.031)
    dirt.wipe(Pose((0.1, 0.1, 0.015), turned(0.0)), SPONGE)
    assert dirt.wiped_fraction == pytest.approx(0.10 * 0.06 / 0.04, abs=0.031)


def test_a_face_higher_than_the_gap_wipes_nothing_and_a_tilted_one_wipes_at_its_low_edge() -> None:
    dirt = DirtMap((0.0, 0.0), (0.2, 0.2))
    dirt.wipe(Pose((0.1, 0.1, 0.017), turned(0.0)), SPONGE)
    assert dirt.wiped_fraction == 0.0
    tilt = 0.1
    dirt.wipe(Pose((0.1, 0.1, 0.015 + 0.05 * tilt), (0.0, tilt / 2.0, 0.0, 1.0)), SPONGE)
    assert 0.0 < dirt.wiped_fraction < 0.05
