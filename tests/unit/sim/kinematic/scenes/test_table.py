"""The table without physics: only a held sponge that is pressed on it wipes."""

from __future__ import annotations

from math import inf
from typing import Any

from aeros.runtime.ports import Plant
from aeros.sim.kinematic.plant import make_plant
from aeros.skill import Action, act
from tests.unit.sim.acting import allow, execute


def observed(plant: Plant) -> dict[str, Any]:
    return {name: reading.value for name, reading in plant.observe().items()}


def move(x: float, y: float, z: float, yaw: float = 0.0, speed: float = 0.25) -> Action:
    return act("move_tool", target=(x, y, z), yaw=yaw, speed=speed)


def test_wiping_without_a_sponge_in_the_hand_wipes_nothing() -> None:
    plant = make_plant("table", 0)
    for action in (
        act("grip", width=0.0, force=10.0),
        move(0.5, 0.1, 0.02),
        act("slide", target=(0.5, -0.1, 0.0), force=4.0, speed=0.1),
    ):
        assert execute(plant, action, allow, inf).completed
    assert observed(plant)["wiped_fraction"] == 0.0
