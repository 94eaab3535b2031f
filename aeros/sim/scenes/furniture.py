"""Furniture that several scenes share."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Vector3

MODELS: Final = Path(__file__).parent.parent / "models"
"""Folder of the URDF files of articulated objects."""


def add_table(world: PhysicsWorld) -> int:
    """Add a fixed table whose top is z = 0 of W, under the robot and 1 m in front of it.

    Args:
        world: the world to add it to.

    Returns:
        The body's number in PyBullet.
    """
    return world.bodies.add_box(
        (1.4, 1.6, 0.05), (0.4, 0.0, -0.025), colour=(0.78, 0.70, 0.58, 1.0), friction=0.6
    )


def add_open_box(world: PhysicsWorld, inner: Vector3, position: Vector3, wall: float = 0.005) -> None:
    """Add a fixed box without a lid, parallel to the axes of W.

    Args:
        world: the world to add it to.
        inner: inner length, width and depth, m.
        position: of the middle of its floor's top, in W, m.
        wall: thickness of walls and floor, m.
    """
    length, width, depth = inner
    x, y, z = position
    colour = (0.35, 0.40, 0.48, 1.0)
    world.bodies.add_box((length + 2 * wall, width + 2 * wall, wall), (x, y, z - wall / 2), colour=colour)
    for side in (-1.0, 1.0):
        across = x + side * (length + wall) / 2
        world.bodies.add_box((wall, width + 2 * wall, depth), (across, y, z + depth / 2), colour=colour)
        along = y + side * (width + wall) / 2
        world.bodies.add_box((length, wall, depth), (x, along, z + depth / 2), colour=colour)
