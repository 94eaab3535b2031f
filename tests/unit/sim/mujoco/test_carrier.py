"""A hand on MuJoCo draws every link of a body in proportion to its mass."""

from __future__ import annotations

from math import dist
from pathlib import Path

import pytest

from aeros.sim.geometry import UPRIGHT, Pose
from aeros.sim.mujoco.engine import MujocoEngine
from aeros.spec.model.scene import UrdfModel
from tests.shipped_scenes import ECMS
from tests.unit.sim.engine.declared_bodies import body

pytestmark = pytest.mark.physics

WRAPPER = ECMS / "make_dumplings" / "scenes" / "models" / "wrapper.urdf"


@pytest.mark.parametrize("turn", [0.0, 3.0])
def test_a_hinged_body_is_carried_whole(turn: float) -> None:
    engine = MujocoEngine()
    shape = UrdfModel(str(Path(WRAPPER)), ("plate_a", "plate_b"), {"fold": "revolute"})
    placed = engine.add_body(body(shape=shape, mass=0.08), Pose((0.0, 0.0, 1.0), UPRIGHT))
    hand = engine.carry(placed.number, (0.2, 0.1, 1.0), turn, (0.0, 0.0, 1.0), lift=0.1, strength=15.0)
    for tick in range(1, 481):
        hand.push(tick / 480)
        engine.world.step()
    assert dist(engine.world.pose(placed.number).position, (0.2, 0.1, 1.0)) < 0.02
    leaf = engine.world.pose(placed.number, placed.links["plate_b"]).position
    assert dist(leaf, engine.world.pose(placed.number).position) < 0.06
