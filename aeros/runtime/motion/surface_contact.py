"""Held objects near a surface: an action may bring what is held slowly into the volume that it names.

What is held is enclosed by the largest object that the site allows, so a motion that picks it up or puts it
down enters the surface's volume. Elsewhere nothing held may enter it. Within it the motion

- comes from its own start, as it picks up: it leaves the volume, within a distance of its start; or
- goes to its own target, as it puts down: within a distance of its target, and at most at a speed.

Motions under feedback press what is held on the surface: their tool keeps to the speed all the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile
from math import dist, inf
from typing import NamedTuple

from aeros.runtime.motion.bezier import Piece
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics, norm, piece_speeds
from aeros.runtime.motion.swept_volume import BarrierBox, SweptMotion, ball_enclosures, find_breach
from aeros.runtime.ports import Ball, RobotBody, Trajectory, Vec3


class SurfaceLimits(NamedTuple):
    """Limits of what is held where it may touch a surface.

    Attributes:
        distance: of the tool from the start or the target of its motion, m.
        speed: of the tool on its way to the target, m/s.
    """

    distance: float
    speed: float


class SurfaceBreach(NamedTuple):
    """A place on a motion's path where a held object may be in a surface's volume and should not.

    Attributes:
        path_parameter: the place, s from 0 to 1.
        distance: upper bound of the tool's distance from the target there, m.
        speed: upper bound of its speed there, m/s.
    """

    path_parameter: float
    distance: float
    speed: float


def find_surface_breach(
    plan: Trajectory, moving: SweptMotion, boxes: list[BarrierBox], clearance: float, limits: SurfaceLimits
) -> SurfaceBreach | None:
    """Search a motion for a place where what is held may be in a surface's volume beyond its limits.

    Args:
        plan: the motion; it alone moves the robot.
        moving: the same motion, with what is held.
        boxes: the surface's barriers.
        clearance: distance to keep from them elsewhere, m.
        limits: the limits.

    Returns:
        The first such place, or None.
    """
    if find_breach(_held_alone(moving), boxes, clearance) is None:
        return None
    if plan.servo is not None:
        speed = plan.servo.tool_speed
        return None if speed <= limits.speed else SurfaceBreach(0.0, inf, speed)
    (pieces,) = moving.paths
    count = len(pieces)
    inside = [_may_touch(moving, piece, boxes, clearance, number) for number, piece in enumerate(pieces)]
    leaving = 0 if all(inside) else len([*takewhile(bool, inside)])
    begin, end = (_tool(plan.body, q) for q in (pieces[0][0], pieces[-1][3]))
    speeds = piece_speeds(plan.body, plan.joint_paths[0], plan.duration)
    for number, piece in enumerate(pieces):
        if not inside[number]:
            continue
        from_start, to_target = _greatest_distances(plan.body, piece, (begin, end))
        if number < leaving and from_start <= limits.distance:
            continue
        if not (to_target <= limits.distance and speeds[number] <= limits.speed):
            return SurfaceBreach((number + 0.5) / count, to_target, speeds[number])
    return None


def _held_alone(moving: SweptMotion) -> SweptMotion:
    return moving._replace(body=replace(moving.body, balls=()))


def _may_touch(
    moving: SweptMotion, piece: Piece, boxes: list[BarrierBox], clearance: float, number: int
) -> bool:
    """Check if what is held may come near a barrier on one piece of the path."""
    low, share = number / len(moving.paths[0]), 1.0 / len(moving.paths[0])
    (x, y, z), (wx, wy, wz) = moving.base, moving.base_path
    part = _held_alone(moving)._replace(
        paths=([piece],),
        base=(x + low * wx, y + low * wy, z + low * wz),
        base_path=(share * wx, share * wy, share * wz),
    )
    return find_breach(part, boxes, clearance) is not None


def _tool(body: RobotBody, joints: tuple[float, ...]) -> Vec3:
    return ForwardKinematics(body, joints).frames[-1].to_base(body.tool_offset)


def _greatest_distances(body: RobotBody, piece: Piece, places: Sequence[Vec3]) -> list[float]:
    """Return upper bounds of the tool's distance from each place on a piece of path, m."""
    tool = Ball("", len(body.dh_rows), body.tool_offset, 0.0)
    still = (0.0,) * len(body.dh_rows)
    ((centre, edges, radius),) = ball_enclosures(body, [piece], still, [tool])
    return [dist(centre, place) + norm(edges) + radius for place in places]
