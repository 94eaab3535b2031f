"""Our rays in a world of PyBullet, against PyBullet's own."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.engine.people import Person, Waypoint
from aeros.sim.engine.scanned_cell import PhysicsCell
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.scanners.ray_fan import ray_fan
from aeros.sim.scanners.sections import Disc, cast, rectangle
from tests.shipped_scenes import shipped_scene
from tests.unit.sim.bullet.bullet_parts import as_bullet
from tests.unit.sim.scanners.cells import reference_scanners

pytestmark = pytest.mark.physics


@pytest.fixture
def plant() -> Iterator[PhysicsPlant]:
    person = Person("guest", (Waypoint((-1.0, 1.2)),))
    made = make_plant(shipped_scene("fetch"), 4, people=(person,), scanners=reference_scanners())
    yield made
    made.close()


def test_rays_meet_what_those_of_pybullet_meet(plant: PhysicsPlant) -> None:
    scanners = reference_scanners()
    fan, height = ray_fan(scanners), scanners.floor + scanners.height
    cell = PhysicsCell(plant._engine, plant._simulated, plant._people, height)
    _, base = cell.robot()
    people = cell.people()
    assert [type(one) for one in people] == [Disc]  # who stands on the floor of the cell, as none was given
    carriage = rectangle((base[0] - 0.25, base[1] - 0.225), (base[0] + 0.25, base[1] + 0.225))
    free = np.full(len(fan.origins), scanners.range)
    ours = cast(fan, free, [*cell.furniture(), *people, carriage])
    client = as_bullet(plant._world).client
    # Rays of PyBullet meet no people, who collide with nothing; they meet their double.
    capsule = bullet.createCollisionShape(
        bullet.GEOM_CAPSULE, radius=0.25, height=1.25, physicsClientId=client
    )
    bullet.createMultiBody(0.0, capsule, basePosition=(-1.0, 1.2, -0.3 + 0.875), physicsClientId=client)
    at = np.full((len(fan.origins), 1), height)
    starts = np.hstack((fan.origins, at))
    ends = np.hstack((fan.origins + scanners.range * fan.directions, at))
    theirs = np.array(
        [
            one[2] * scanners.range
            for first in range(0, len(starts), 1000)
            for one in bullet.rayTestBatch(
                starts[first : first + 1000].tolist(),
                ends[first : first + 1000].tolist(),
                physicsClientId=client,
            )
        ]
    )
    assert (ours < scanners.range).sum() > 500
    differs = np.abs(ours - theirs) > 0.002
    # A ray that grazes an edge may be met by one and not by the other.
    assert differs.sum() <= 0.002 * len(ours)
