"""A hand carries a body by forces: up, over, down, and turned on the way."""

from __future__ import annotations

from math import dist, pi

import pytest

from aeros.sim.bullet.carrier import Carrier, is_occupied
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.carried_way import LIFT

GOAL = (0.4, -0.3, 0.05)
TICKS = 360


@pytest.mark.parametrize("substeps", [1, 2])
@pytest.mark.parametrize("turn", [0.0, pi / 2.0])
def test_a_body_is_carried_over_what_is_low_and_let_go_where_it_is_to_be(turn: float, substeps: int) -> None:
    world = PhysicsWorld(substeps)
    world.bodies.add_box((2.0, 2.0, 0.1), (0.0, 0.0, -0.05))
    body = world.bodies.add_box((0.04, 0.04, 0.08), (0.0, 0.0, 0.04), mass=0.15)
    carrier = Carrier(world, body, GOAL, turn, (1.0, 0.0, 0.0))
    heights = []
    for tick in range(1, TICKS + 1):
        carrier.push(tick / TICKS)
        world.step()
        heights.append(world.pose(body).position[2])
    place, orientation = world.pose(body)
    world.close()
    assert max(heights) == pytest.approx(GOAL[2] + LIFT, abs=0.02)
    assert dist(place, GOAL) < 0.01
    assert 2.0 * abs(orientation[0] * orientation[3]) == pytest.approx(1.0 if turn else 0.0, abs=0.05)


@pytest.mark.parametrize(("strength", "arrives"), [(30.0, True), (5.0, False)])
def test_a_hand_holds_what_is_not_too_heavy_for_its_strength(strength: float, arrives: bool) -> None:
    world = PhysicsWorld()
    body = world.bodies.add_box((0.04, 0.04, 0.08), (0.0, 0.0, 0.8), mass=1.0)
    carrier = Carrier(world, body, (0.0, 0.0, 0.5), 0.0, (0.0, 0.0, 1.0), lift=0.0, strength=strength)
    for tick in range(1, TICKS + 1):
        carrier.push(tick / TICKS)
        world.step()
    height = world.pose(body).position[2]
    world.close()
    assert (height > 0.4) is arrives


@pytest.mark.parametrize(("height", "occupied"), [(0.1, True), (0.3, False)])
def test_a_place_is_occupied_as_far_as_the_bounds_of_a_body_reach(height: float, occupied: bool) -> None:
    world = PhysicsWorld()
    body = world.bodies.add_box((0.2, 0.2, 0.2), (0.0, 0.0, 0.1), mass=1.0)
    found = is_occupied(world, (-0.01, -0.01, height), (0.01, 0.01, height + 0.1), body)
    world.close()
    assert found is occupied
