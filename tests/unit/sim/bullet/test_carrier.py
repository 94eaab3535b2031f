"""A hand carries a body by forces: up, over, down, and turned on the way."""

from __future__ import annotations

from math import dist, pi

import pytest

from aeros.sim.bullet.carrier import LIFT, Carrier
from aeros.sim.bullet.world import PhysicsWorld

GOAL = (0.4, -0.3, 0.05)
TICKS = 360


@pytest.mark.parametrize("turn", [0.0, pi / 2.0])
def test_a_body_is_carried_over_what_is_low_and_let_go_where_it_is_to_be(turn: float) -> None:
    world = PhysicsWorld()
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
