"""Marks of a caption in space: rings around people, the decided path, volumes and detections."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from aeros.kinematic_chain import frames_of, mounting_of
from aeros.sim.engine.world import Rgba
from aeros.sim.film.captions import Caption, PersonSeparation
from aeros.sim.film.recording import PoseSample, RobotFigure
from aeros.sim.film.scene_pictures import Dot, FloorRing, Line, Mark, Zone
from aeros.sim.geometry import Vector3, add

_GREEN: Final[Rgba] = (0.13, 0.66, 0.33, 1.0)
_AMBER: Final[Rgba] = (0.98, 0.62, 0.05, 1.0)
_RED: Final[Rgba] = (0.88, 0.12, 0.12, 1.0)
_BLUE: Final[Rgba] = (0.16, 0.48, 0.86, 0.07)
_BROKEN: Final[Rgba] = (0.88, 0.12, 0.12, 0.20)

_ABOVE_FLOOR: Final = 0.012
"""Height of rings above the floor, m."""


def marks_of(sample: PoseSample, caption: Caption, robot: RobotFigure) -> Iterator[Mark]:
    """Yield the marks of a picture.

    Args:
        sample: the picture.
        caption: its caption.
        robot: the robot.

    Yields:
        The marks; opaque ones first.
    """
    points = tool_path(robot, caption.joint_path, sample.base)
    if points:
        colour = _AMBER if caption.status == "slowed" else _GREEN
        yield Line(points, 0.007, colour)
        yield Dot(points[-1], 0.012, colour)
    if caption.separation is not None:
        yield from _rings(sample, caption.separation)
    for zone in caption.zones:
        yield Zone(zone.low, zone.high, _BROKEN if zone.is_broken else _BLUE)


def _rings(sample: PoseSample, separation: PersonSeparation) -> Iterator[Mark]:
    """Yield rings around people: whatever of the robot is inside the inner one must not move."""
    measured = separation.measured
    is_stopped = measured is not None and measured < separation.stop
    is_slow = measured is not None and separation.slow is not None and measured < separation.slow
    for person in sample.people:
        middle = (person.x, person.y, person.floor + _ABOVE_FLOOR)
        if separation.slow is not None:
            wide = person.radius + separation.slow
            yield FloorRing(
                (middle[0], middle[1], middle[2] - 0.006), wide, _AMBER if is_slow else _GREEN, 0.10
            )
        colour = _RED if is_stopped else _AMBER if is_slow else _GREEN
        yield FloorRing(middle, person.radius + separation.stop, colour, 0.26 if is_stopped else 0.14)


def tool_path(robot: RobotFigure, joint_path: Sequence[tuple[float, ...]], base: Vector3) -> list[Vector3]:
    """Compute the way of the tool centre point.

    Args:
        robot: the robot.
        joint_path: joint positions along the way, rad.
        base: position of the arm's base in W, m.

    Returns:
        Positions in W, m.
    """
    mountings = [mounting_of(row) for row in robot.rows]
    reach = (0.0, 0.0, robot.flange + robot.tool)
    return [
        add(base, frames_of(mountings, joints)[-1].to_base(reach))
        for joints in joint_path
        if len(joints) == len(mountings)
    ]
