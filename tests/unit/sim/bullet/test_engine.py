"""A person in PyBullet: the distance is searched from the previous one on, and found all the same."""

from __future__ import annotations

from math import inf

import pytest

from aeros.sim.bullet.engine import BulletEngine
from aeros.sim.bullet.world import PhysicsWorld

pytestmark = pytest.mark.physics


def test_a_person_who_jumps_is_found_at_any_distance() -> None:
    world = PhysicsWorld()
    engine = BulletEngine(world)
    box = world.bodies.add_box((0.2, 0.2, 0.2), (0.0, 0.0, 0.9))
    person = engine.add_person(1.8, 0.25)
    for x in (3.0, 1.0, 0.99, 4.0, 0.5):
        person.move((x, 0.0, 0.9))
        assert person.distance(box, 10.0) == pytest.approx(x - 0.35, abs=2e-3)
    person.move((20.0, 0.0, 0.9))
    assert person.distance(box, 10.0) == inf
    assert world.contacts(person.number) == []
    world.close()
