"""Obstacle check: during a whole motion the robot, and what it holds, keep off what pictures show.

First the balls of the body are checked, as against barriers. Where they come too near, the hulls of the
links are, which enclose them more closely: an obstacle is then a hull that stands with the foot, and the
check of links against each other compares the two. Both are the proved code of `swept_volume` and
`link_distance`; this file makes their inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, combinations, product

from aeros.runtime.motion.link_distance import find_link_contact
from aeros.runtime.motion.swept_volume import BarrierBox, BarrierBreach, SweptMotion, find_breach
from aeros.runtime.ports import Hull, Obstacle, Vec3


def find_obstacle_contact(
    moving: SweptMotion, obstacles: Sequence[Obstacle], clearance: float
) -> BarrierBreach | None:
    """Search for an obstacle that a link may come near to during a motion.

    Args:
        moving: the motion.
        obstacles: the obstacles.
        clearance: distance to keep from each, m.

    Returns:
        The first contact found, with the name of the obstacle as that of the barrier; None if every link is
        clear of every obstacle throughout.
    """
    breach = find_breach(moving, [*map(as_barrier, obstacles)], clearance)
    # While the base drives, the foot moves, too, and hulls that stand with it are not compared with it.
    if breach is None or not moving.body.hulls or any(moving.base_path):
        return breach
    links = [hull.link for hull in moving.body.hulls]
    if moving.held is not None:
        links.append(moving.held.link)
    standing = [obstacle_hull(one, moving.base) for one in obstacles]
    # Links are compared with each other elsewhere, and obstacles stand.
    body = replace(
        moving.body,
        hulls=(*moving.body.hulls, *standing),
        exempt_pairs=tuple(chain(combinations(links, 2), combinations([one.link for one in standing], 2))),
    )
    contact = find_link_contact(moving._replace(body=body), clearance)
    return None if contact is None else BarrierBreach(contact.inner, contact.outer, contact.path_parameter)


def ends_at_obstacle(moving: SweptMotion, obstacles: Sequence[Obstacle], clearance: float) -> bool:
    """Check the end of a motion: if an obstacle is there, no other way leads to it.

    Args:
        moving: the motion.
        obstacles: the obstacles.
        clearance: distance to keep from each, m.

    Returns:
        True if the robot may come near an obstacle in its last position.
    """
    end = moving.paths[0][-1][3]
    x, y, z = (a + b for a, b in zip(moving.base, moving.base_path, strict=True))
    resting = moving._replace(paths=([(end, end, end, end)],), base=(x, y, z), base_path=(0.0, 0.0, 0.0))
    return find_obstacle_contact(resting, obstacles, clearance) is not None


def as_barrier(obstacle: Obstacle) -> BarrierBox:
    """Return the space that every link, and what is held, keeps out of.

    Args:
        obstacle: the obstacle.

    Returns:
        A barrier in W.
    """
    return BarrierBox(obstacle.name, obstacle.lower, obstacle.upper, False, False, None)


def obstacle_hull(obstacle: Obstacle, base: Vec3) -> Hull:
    """Return an obstacle as a hull that stands with the robot's foot.

    Args:
        obstacle: the obstacle, in W.
        base: position of the robot's base in W, m; it stands.

    Returns:
        The corners of the obstacle in the base's frame.
    """
    (ax, ay, az), (bx, by, bz), (x, y, z) = obstacle.lower, obstacle.upper, base
    corners = product((ax - x, bx - x), (ay - y, by - y), (az - z, bz - z))
    return Hull(obstacle.name, 0, tuple(corners), 0.0)
