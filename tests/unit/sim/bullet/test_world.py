"""One world: its clock, poses, and contacts, with boxes whose weights are known."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.clock import TICK
from aeros.sim.engine.world import GRAVITY
from tests.shipped_scenes import ECMS

MODELS = ECMS / "make_dumplings" / "scenes" / "models"

pytestmark = pytest.mark.physics


@pytest.fixture(params=[1, 2], ids=["240 Hz", "480 Hz"])
def world(request: pytest.FixtureRequest) -> Iterator[PhysicsWorld]:
    made = PhysicsWorld(request.param)
    yield made
    made.close()


def _floor(world: PhysicsWorld) -> int:
    return world.bodies.add_box((2.0, 2.0, 0.1), (0.0, 0.0, -0.05))


def _cube(world: PhysicsWorld, x: float = 0.0, z: float = 0.05, mass: float = 1.0) -> int:
    """A cube of 100 mm."""
    return world.bodies.add_box((0.1, 0.1, 0.1), (x, 0.0, z), mass=mass)


def _settle(world: PhysicsWorld, ticks: int = 120) -> None:
    for _ in range(ticks):
        world.step()


def test_a_clock_counts_ticks_of_which_a_second_has_240(world: PhysicsWorld) -> None:
    assert (world.ticks, world.time) == (0, 0.0)
    _settle(world, 240)
    assert world.ticks == 240
    assert world.time == pytest.approx(1.0)


@pytest.mark.parametrize("substeps", [0, -1])
def test_a_tick_without_a_step_is_refused(substeps: int) -> None:
    with pytest.raises(ValueError, match=f"{substeps} steps in a tick"):
        PhysicsWorld(substeps)


def test_a_body_falls_as_gravity_pulls_it(world: PhysicsWorld) -> None:
    cube = _cube(world, z=10.0)
    _settle(world, 24)
    # g t²/2 after 0.1 s, to which the integration in steps of h adds g t h/2.
    fallen = GRAVITY * (0.01 / 2 + 0.1 / 480 / world._substeps)
    assert 10.0 - world.pose(cube).position[2] == pytest.approx(fallen, rel=0.02)
    assert world.pose(cube).position[:2] == (0.0, 0.0)


def test_worlds_share_nothing_and_end_once(world: PhysicsWorld) -> None:
    other = PhysicsWorld()
    assert other.client != world.client
    _cube(other)
    _settle(other, 3)
    assert (world.ticks, world.overlaps(-1.0)) == (0, [])
    other.close()
    other.close()
    assert other.client == other.bodies.client == other.renderer.client == -1
    _cube(world)
    world.step()


def test_a_push_moves_a_body_along_it(world: PhysicsWorld) -> None:
    pushed, left = _cube(world, 0.0, 5.0, mass=2.0), _cube(world, 1.0, 5.0, mass=2.0)
    for _ in range(24):
        world.push(pushed, (40.0, 0.0, 0.0))
        world.step()
    # 20 m/s² for 0.1 s are 0.1 m, and it does not turn: the force acts at its centre.
    assert world.pose(pushed).position[0] == pytest.approx(0.1, rel=0.06)
    assert world.pose(pushed).orientation == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=1e-6)
    assert world.pose(left).position[0] == 1.0


def test_the_floor_carries_the_weight_of_a_cube(world: PhysicsWorld) -> None:
    floor, cube, other = _floor(world), _cube(world, mass=2.0), _cube(world, 0.5)
    _settle(world)
    assert world.contact_force(cube, floor) == pytest.approx(2.0 * GRAVITY, rel=0.02)
    assert world.contact_force(floor, cube) == pytest.approx(2.0 * GRAVITY, rel=0.02)
    assert world.forces_by_link(cube) == {-1: pytest.approx(2.0 * GRAVITY, rel=0.02)}
    assert world.forces_by_link(floor) == {-1: pytest.approx(3.0 * GRAVITY, rel=0.02)}
    assert world.forces_by_link(floor, other) == {-1: pytest.approx(GRAVITY, rel=0.02)}
    assert world.contact_force(cube, other) == 0.0
    assert world.forces_by_link(cube, other) == {}


def test_contacts_are_seen_from_the_first_body(world: PhysicsWorld) -> None:
    floor, cube, other = _floor(world), _cube(world), _cube(world, 0.5)
    _settle(world)
    found = world.contacts(cube)
    assert len(found) == 4
    assert world.contacts(cube, floor) == found
    assert world.contacts(cube, other) == []
    assert world.contacts(cube, link=3) == []
    assert {(one.body_b, one.link_a, one.link_b) for one in found} == {(floor, -1, -1)}
    assert sum(one.force for one in found) == pytest.approx(GRAVITY, rel=0.02)
    for one in found:
        assert one.normal == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
        assert dist(one.position, (0.0, 0.0, 0.0)) == pytest.approx(0.05 * 2**0.5, abs=0.005)
    assert world.contacts(floor, cube)[0].normal == pytest.approx((0.0, 0.0, -1.0), abs=1e-3)


def test_the_net_force_on_a_body_at_rest_is_its_weight_and_on_the_middle_of_a_pile_too(
    world: PhysicsWorld,
) -> None:
    _floor(world)
    low, high = _cube(world), _cube(world, 0.0, 0.15)
    _settle(world, 240)
    assert world.net_contact_force(high) == pytest.approx(GRAVITY, rel=0.02)
    # Twice the weight from below, once from above.
    assert world.net_contact_force(low) == pytest.approx(GRAVITY, rel=0.04)
    assert world.forces_by_link(low) == {-1: pytest.approx(3.0 * GRAVITY, rel=0.04)}


def test_the_net_force_has_the_friction_in_it(world: PhysicsWorld) -> None:
    _floor(world)
    cube = _cube(world)
    _settle(world)
    for _ in range(24):
        world.push(cube, (1.5, 2.0, 0.0))
        world.step()
    # It does not slide, as friction takes up to 0.6 · 0.6 of its weight: 2.5 N across, 9.81 N up.
    assert world.net_contact_force(cube) == pytest.approx((GRAVITY**2 + 6.25) ** 0.5, rel=0.01)


def test_contacts_of_the_last_step_are_kept_until_the_next(world: PhysicsWorld) -> None:
    _floor(world)
    cube = _cube(world)
    _settle(world)
    assert world.net_contact_force(cube) > 9.0
    for _ in range(12):
        world.push(cube, (0.0, 0.0, 100.0))
        world.step()
    assert (world.net_contact_force(cube), world.forces_by_link(cube)) == (0.0, {})


def test_overlaps_are_pairs_deeper_than_asked(world: PhysicsWorld) -> None:
    first, second, _ = _cube(world), _cube(world, 0.09), _cube(world, 0.5)
    ((one, other, depth),) = world.overlaps(0.005)
    assert (one, other) == (first, second)
    assert depth == pytest.approx(0.01, abs=1e-3)
    assert world.overlaps(0.012) == []


def test_a_joint_and_the_frame_of_its_link_are_read(world: PhysicsWorld) -> None:
    press = world.bodies.add_urdf(str(MODELS / "press.urdf"), (0.5, 0.0, 0.094), fixed=True)
    assert world.joint_position(press, 0) == 0.0
    # The handle is 75 mm before the hinge.
    assert world.pose(press, 1).position == pytest.approx((0.425, 0.0, 0.094), abs=1e-6)
    assert world.pose(press).position != world.pose(press, 0).position


def test_forces_are_distinguished_by_the_link_of_the_first_body(world: PhysicsWorld) -> None:
    floor = _floor(world)
    wrapper = world.bodies.add_urdf(str(MODELS / "wrapper.urdf"), (0.0, 0.0, 0.004))
    _settle(world)
    on_wrapper, on_floor = world.forces_by_link(wrapper), world.forces_by_link(floor, wrapper)
    # An open wrapper lies on both plates: its base and its only link.
    assert set(on_wrapper) == {-1, 0}
    assert set(on_floor) == {-1}
    assert on_floor[-1] == pytest.approx(sum(on_wrapper.values()))


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
