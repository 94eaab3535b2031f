"""Start poses of a scene: as declared, with random offsets from a stream of their own for each thing.

So another thing in a scene changes the start of no other.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import dist

from aeros.sim.geometry import UPRIGHT, Pose, Vector3, add, to_world, yaw_of, yaw_orientation
from aeros.sim.randomness import RandomSource
from aeros.spec.model.scene import Placement, Scene

_W = Pose((0.0, 0.0, 0.0), UPRIGHT)


def place_things(scene: Scene, chance: RandomSource) -> dict[str, Pose]:
    """Draw the start pose of every place and body.

    Args:
        scene: the scene.
        chance: random source; a channel for each stream.

    Returns:
        Poses in W by name.
    """
    poses: dict[str, Pose] = {}
    for name, placement in scene.placements():
        poses[name] = _pose(placement, poses, chance)
    return poses


def _pose(placement: Placement, poses: Mapping[str, Pose], chance: RandomSource) -> Pose:
    frame = _W if placement.frame is None else poses[placement.frame]
    x, y, turn, z = (float(part) for part in chance.generator(placement.stream).uniform(-1.0, 1.0, 4))
    dx, dy, dz = placement.spread
    yaw = yaw_of(frame.orientation) + placement.yaw + placement.yaw_spread * turn
    orientation = yaw_orientation(yaw)

    def at(position: Vector3) -> Vector3:
        anchored = add(to_world(frame, position), (dx * x, dy * y, dz * z))
        a, b, c = placement.anchor
        return to_world(Pose(anchored, orientation), (-a, -b, -c))

    position = at(placement.position)
    if placement.alternative is not None:
        other = at(placement.alternative.position)
        away = poses[placement.alternative.farther_from].position
        position = max(position, other, key=lambda place: dist(place, away))
    return Pose(position, orientation)
