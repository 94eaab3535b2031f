"""The empty table with physics."""

from __future__ import annotations

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.physics import PhysicsPlant
from aeros.sim.scenes.bare import BareScene

pytestmark = pytest.mark.physics


def test_an_empty_table_is_under_the_robot_with_nothing_on_it() -> None:
    scene = BareScene()
    plant = PhysicsPlant(scene, 0)
    client = plant._world.client
    (hit,) = bullet.rayTest((0.9, 0.5, 1.0), (0.9, 0.5, -1.0), physicsClientId=client)
    assert hit[3][2] == pytest.approx(0.0, abs=1e-6)
    assert bullet.getNumBodies(physicsClientId=client) == 2
    scene.tick()
    assert scene.measure() == {}
    plant.close()


def test_an_empty_table_has_no_object_to_push_and_no_camera() -> None:
    with pytest.raises(KeyError, match="cube"):
        BareScene().body("cube")
    with pytest.raises(KeyError, match="mast"):
        BareScene().detect("mast")
