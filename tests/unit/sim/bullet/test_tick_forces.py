"""Forces and torques of one tick, on a body whose answer is known."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.clock import TICK

pytestmark = pytest.mark.physics


@pytest.fixture(params=[1, 2], ids=["240 Hz", "480 Hz"])
def world(request: pytest.FixtureRequest) -> Iterator[PhysicsWorld]:
    made = PhysicsWorld(request.param)
    yield made
    made.close()


def test_a_torque_turns_a_body_during_one_tick_only(world: PhysicsWorld) -> None:
    cube = world.bodies.add_box((0.6, 0.6, 0.6), (0.0, 0.0, 9.0), mass=1.0)
    # A cube's moment of inertia is m·a²/6.
    moment = 1.0 * 0.6**2 / 6
    world.forces.turn(cube, (0.0, 0.0, 2.0))
    world.step()
    _, spin = bullet.getBaseVelocity(cube, physicsClientId=world.client)
    assert spin == pytest.approx((0.0, 0.0, 2.0 * TICK / moment), rel=0.01, abs=1e-9)
    world.step()
    _, after = bullet.getBaseVelocity(cube, physicsClientId=world.client)
    assert after[2] == pytest.approx(spin[2], rel=0.01)


def test_pushes_of_a_tick_add_up_and_are_forgotten(world: PhysicsWorld) -> None:
    cube = world.bodies.add_box((0.1, 0.1, 0.1), (0.0, 0.0, 9.0), mass=2.0)
    for force in (3.0, 5.0):
        world.forces.push(cube, (force, 0.0, 0.0))
    world.step()
    (speed, _, _), _ = bullet.getBaseVelocity(cube, physicsClientId=world.client)
    assert speed == pytest.approx(8.0 * TICK / 2.0, rel=0.01)
    world.step()
    (after, _, _), _ = bullet.getBaseVelocity(cube, physicsClientId=world.client)
    assert after == pytest.approx(speed, rel=0.01)
