"""Furniture stands at its declared place."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.scenes.furniture import MODELS, add_open_box, add_table

pytestmark = pytest.mark.physics


@pytest.fixture
def world() -> Iterator[PhysicsWorld]:
    made = PhysicsWorld()
    yield made
    made.close()


def _height_at(world: PhysicsWorld, x: float, y: float) -> float | None:
    """Height of what is first hit from above."""
    ((body, _, _, place, _),) = bullet.rayTest((x, y, 1.0), (x, y, -1.0), physicsClientId=world.client)
    return None if body < 0 else float(place[2])


def test_the_models_of_the_scenes_are_there() -> None:
    assert {"press.urdf", "sponge.urdf", "wrapper.urdf"} <= {path.name for path in MODELS.iterdir()}


def test_a_table_is_fixed_and_ends_where_it_is_declared_to(world: PhysicsWorld) -> None:
    table = add_table(world)
    for x, y, is_table in (
        (0.4, 0.0, True),
        (-0.29, 0.79, True),
        (1.09, -0.79, True),
        (1.11, 0.0, False),
        (-0.31, 0.0, False),
        (0.4, 0.81, False),
    ):
        height = _height_at(world, x, y)
        assert height == (pytest.approx(0.0, abs=1e-6) if is_table else None)
    world.step()
    assert world.pose(table).position == (0.4, 0.0, -0.025)


def test_an_open_box_has_a_floor_and_four_walls(world: PhysicsWorld) -> None:
    """Inner 200 mm by 100 mm, 50 mm deep, with walls of 10 mm around (1, 2) and its floor at 0.3 m."""
    add_open_box(world, (0.2, 0.1, 0.05), (1.0, 2.0, 0.3), wall=0.01)
    assert bullet.getNumBodies(physicsClientId=world.client) == 5
    for off, height in (
        ((0.0, 0.0), 0.3),
        ((0.099, 0.049), 0.3),
        ((-0.099, -0.049), 0.3),
        ((0.101, 0.0), 0.35),
        ((-0.101, 0.0), 0.35),
        ((0.109, 0.059), 0.35),
        ((-0.109, -0.059), 0.35),
        ((0.0, 0.051), 0.35),
        ((0.0, -0.051), 0.35),
        ((0.0, 0.059), 0.35),
        ((0.111, 0.0), None),
        ((-0.111, 0.0), None),
        ((0.0, 0.061), None),
        ((0.0, -0.061), None),
    ):
        found = _height_at(world, 1.0 + off[0], 2.0 + off[1])
        assert found == (None if height is None else pytest.approx(height, abs=1e-6)), off
    ((body, _, _, place, _),) = bullet.rayTest(
        (1.0, 2.0, -1.0), (1.0, 2.0, 1.0), physicsClientId=world.client
    )
    assert body >= 0
    assert place[2] == pytest.approx(0.29, abs=1e-6)


def test_a_box_has_walls_of_5_mm_by_default(world: PhysicsWorld) -> None:
    add_open_box(world, (0.2, 0.1, 0.05), (0.0, 0.0, 0.0))
    assert _height_at(world, 0.104, 0.0) == pytest.approx(0.05, abs=1e-6)
    assert _height_at(world, 0.106, 0.0) is None
