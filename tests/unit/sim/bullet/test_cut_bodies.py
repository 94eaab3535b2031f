"""Sections of bodies in PyBullet: of those that the plane meets, where they are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.cut_bodies import CutBodies
from aeros.sim.bullet.world import PhysicsWorld
from tests.unit.sim.scanners.cells import inside

pytestmark = pytest.mark.physics


@pytest.fixture
def world() -> Iterator[PhysicsWorld]:
    made = PhysicsWorld()
    yield made
    made.close()


def test_bodies_that_the_plane_meets_are_cut_until_they_are_left_out(world: PhysicsWorld) -> None:
    box = world.bodies.add_box((0.2, 0.4, 0.6), (1.0, 2.0, 0.3))
    world.bodies.add_box((0.2, 0.4, 0.1), (3.0, 2.0, 1.0))
    left_out: list[int] = []
    cut = CutBodies(world, 0.1, lambda: left_out)
    (section,) = cut.sections()
    points = np.array([(1.09, 2.19), (1.11, 2.0)])
    assert inside(section, points).tolist() == [True, False]
    assert cut.sections() is cut.sections()
    left_out.append(box)
    assert cut.sections() == ()


def test_a_body_that_has_moved_is_cut_where_it_is(world: PhysicsWorld) -> None:
    box = world.bodies.add_box((0.2, 0.4, 0.6), (1.0, 2.0, 0.3))
    cut = CutBodies(world, 0.1, lambda: ())
    before = cut.sections()
    bullet.resetBasePositionAndOrientation(
        box, (5.0, 2.0, 0.3), (0.0, 0.0, 0.0, 1.0), physicsClientId=world.client
    )
    world.step()
    (section,) = cut.sections()
    assert before[0].x == pytest.approx(1.0)
    assert section.x == pytest.approx(5.0)
