"""The room without physics: a camera sees the can where it is in the picture."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any

from aeros.runtime.ports import Plant
from aeros.sim.kinematic.plant import make_plant
from aeros.skill import act
from tests.unit.sim.acting import allow, execute

RunSkill = Callable[..., str | None]


def observed(plant: Plant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def test_a_camera_sees_the_can_where_it_is_in_the_picture_and_only_there(run_skill: RunSkill) -> None:
    plant = make_plant("fetch", 0)
    execute(plant, act("look", camera="mast"), allow, inf)
    assert "object_position" not in observed(plant)
    assert not observed(plant)["object_detected"]
    assert run_skill(plant, "fetch_object", "navigate") is None
    execute(plant, act("look", camera="mast"), allow, inf)
    assert observed(plant)["object_detected"]
    assert execute(plant, act("look", camera="roof"), allow, inf).reason == "unknown camera: `roof`"
