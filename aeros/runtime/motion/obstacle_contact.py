"""Obstacle check: during a whole motion the robot, and what it holds, keep off what pictures show.

First the balls of the body are checked, as against barriers. Where they come too near, the hulls of the
links are, which enclose them more closely: an obstacle is then a hull that stands with the foot, and the
check of links against each other compares the two. Both are the proved code of `swept_volume` and
`link_distance`; this file makes their inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import Final

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
    return _find_contact(moving, moving, obstacles, clearance)


def ends_at_obstacle(moving: SweptMotion, obstacles: Sequence[Obstacle], clearance: float) -> bool:
    """Check the end of a motion: if an obstacle is there, no other way leads to it.

    Args:
        moving: the motion.
        obstacles: the obstacles.
        clearance: distance to keep from each, m.

    Returns:
        True if the robot may come near an obstacle in its last position.
    """
    return _find_contact(resting_at_end(moving), moving, obstacles, clearance) is not None


def resting_at_end(moving: SweptMotion) -> SweptMotion:
    """Return a motion that stays where another one ends.

    Args:
        moving: the other motion.

    Returns:
        The motion, of joints and base.
    """
    end = moving.paths[0][-1][3]
    x, y, z = (a + b for a, b in zip(moving.base, moving.base_path, strict=True))
    return moving._replace(paths=([(end, end, end, end)],), base=(x, y, z), base_path=(0.0, 0.0, 0.0))


def _find_contact(
    moving: SweptMotion, whole: SweptMotion, obstacles: Sequence[Obstacle], clearance: float
) -> BarrierBreach | None:
    """Search a motion; what is held is as large as obstacles leave it at the start of `whole`."""
    breach = find_breach(moving, [*map(as_barrier, obstacles)], clearance)
    # While the base drives, the foot moves, too, and hulls that stand with it are not compared with it.
    if breach is None or not moving.body.hulls or any(moving.base_path):
        return breach
    standing = [obstacle_hull(one, moving.base) for one in obstacles]
    held = None if moving.held is None else trim_held_space(whole, moving.held, standing, clearance)
    return _first_contact(_against(moving, moving.body.hulls, held, standing), clearance)


def find_held_contact(
    moving: SweptMotion, volumes: Sequence[BarrierBox], clearance: float
) -> BarrierBreach | None:
    """Search for a volume of the base, such as what the arm stands on, that what is held may come near to.

    A thing that was gripped beside it is not inside of it, so it is as large as `trim_held_space` leaves it.

    Args:
        moving: the motion.
        volumes: volumes to keep out of, in the base's frame.
        clearance: distance to keep from each, m.

    Returns:
        The first contact found; None if there is none, or the robot holds nothing.
    """
    held = trimmed_held_space(moving, volumes, clearance)
    if held is None or not volumes:
        return None
    return _first_contact(_against(moving, (), held, _standing_hulls(volumes)), clearance)


def trimmed_held_space(moving: SweptMotion, volumes: Sequence[BarrierBox], clearance: float) -> Hull | None:
    """Return the space of what is held, as large as volumes of the base leave it at the motion's start.

    Args:
        moving: the motion.
        volumes: volumes to keep out of, in the base's frame.
        clearance: distance to keep from each, m.

    Returns:
        The space; None if the robot holds nothing.
    """
    if moving.held is None or not volumes:
        return moving.held
    return trim_held_space(moving, moving.held, _standing_hulls(volumes), clearance)


def _first_contact(moving: SweptMotion, clearance: float) -> BarrierBreach | None:
    """Return the first contact of two hulls of a motion, told as that of a link with a barrier."""
    contact = find_link_contact(moving, clearance)
    return None if contact is None else BarrierBreach(contact.inner, contact.outer, contact.path_parameter)


def trim_held_space(moving: SweptMotion, held: Hull, standing: Sequence[Hull], clearance: float) -> Hull:
    """Return the space of what is held, less what solid things at the motion's start leave of it.

    The site declares the space of the largest object. Where an obstacle is in that space, or what the arm
    stands on, the object that is held is smaller: it was gripped there, and two things are not at one place.
    One side of the space, or else all of it, is drawn in towards the tool until it is clear at the start.

    Args:
        moving: the motion.
        held: the declared space.
        standing: those things, as hulls in the base's frame.
        clearance: distance to keep from each, m.

    Returns:
        The space; the declared one if it is clear, or if a quarter of it is not.
    """
    start = moving.paths[0][0][0]
    resting = moving._replace(paths=([(start, start, start, start)],))
    corners = [*zip(*held.corners, strict=True)]
    lower, upper = [min(one) for one in corners], [max(one) for one in corners]
    tool = moving.body.tool_offset
    for share in _SHARES:
        low = [at + share * (one - at) for at, one in zip(tool, lower, strict=True)]
        high = [at + share * (one - at) for at, one in zip(tool, upper, strict=True)]
        for side in range(7):
            # Sides 0 to 2 are the lower ones, 3 to 5 the upper ones, 6 stands for all.
            edges = [
                (
                    low[axis] if side in (axis, 6) else lower[axis],
                    high[axis] if side in (axis + 3, 6) else upper[axis],
                )
                for axis in range(3)
            ]
            space = Hull(held.link, held.joint, tuple(product(edges[0], edges[1], edges[2])), held.radius)
            if find_link_contact(_against(resting, (), space, standing), clearance + _SWAY) is None:
                return space
    return held


_SWAY: Final = 0.005
"""Distance by which it has to be clearer at the start: on a straight line the tool sways by less."""

_SHARES: Final = (1.0, 0.75, 0.5, 0.25)
"""Shares of its declared size that what is held may have."""


def _against(
    moving: SweptMotion, links: Sequence[Hull], held: Hull | None, standing: Sequence[Hull]
) -> SweptMotion:
    """Return a motion in which only links and what is held are compared with obstacles that stand."""
    names = [one.link for one in links] + ([] if held is None else [held.link])
    # Links are compared with each other elsewhere. Obstacles do not move against each other.
    exempt = tuple(combinations(names, 2))
    body = replace(moving.body, hulls=(*links, *standing), exempt_pairs=exempt)
    return moving._replace(body=body, held=held)


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
    return _standing_hull(obstacle.name, (ax - x, ay - y, az - z), (bx - x, by - y, bz - z))


def _standing_hulls(volumes: Sequence[BarrierBox]) -> list[Hull]:
    return [_standing_hull(one.id, one.lower, one.upper) for one in volumes]


def _standing_hull(name: str, lower: Vec3, upper: Vec3) -> Hull:
    """Return a box in the base's frame as a hull that stands with the robot's foot."""
    (ax, ay, az), (bx, by, bz) = lower, upper
    return Hull(name, 0, tuple(product((ax, bx), (ay, by), (az, bz))), 0.0)
