"""Swept-volume check: during a whole motion a body, and what it holds, keep off barriers.

Conservative. A stretch of path is enclosed by a chord (a straight line in joint space) and the greatest
distance of its control points from it. Each ball of the body is enclosed by a box around its centre at the
middle joint position, and by a bound on the distance of its centre from that box (`kinematic_bounds`),
enlarged by its radius and by the clearance. All of that is assumed to be anywhere on the part of the base's
path that may be travelled meanwhile: the same fraction if one motion moves both, and all of it if base and
joints are moved by motions that are not synchronized.
A stretch of path that is not clear is halved, until pieces have been halved `_MAX_SUBDIVISIONS` times. If it
is still not clear the motion is denied. So a motion that passes a barrier more closely than the last
enclosures are wide is denied, and no motion that meets a barrier is allowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Final, NamedTuple

from aeros.runtime.motion.bezier import Piece, path_chord, remaining_path, split_in_half
from aeros.runtime.motion.kinematic_bounds import ForwardKinematics, chord_terms, norm
from aeros.runtime.ports import Ball, Hull, JointVector, RobotBody, Trajectory, Vec3

_MAX_SUBDIVISIONS: Final = 4
"""Greatest number of halvings of a piece of path; its enclosures are then a few tenths of a mm wide."""

_MIN_BASE_STEP: Final = 1e-3
"""Length below which the base's path is not halved any more, m."""

ROUNDING: Final = 1e-9
"""More than the effect of rounding on any distance here, m."""


class BarrierBox(NamedTuple):
    """A barrier in the form that the check needs.

    Attributes:
        id: the barrier's.
        lower, upper: corners of its volume, in W or in the base's frame, m.
        keep_inside: links must stay inside, instead of outside.
        is_in_base_frame: the volume moves with the base.
        links: the links that it applies to; None for all.
    """

    id: str
    lower: Vec3
    upper: Vec3
    keep_inside: bool
    is_in_base_frame: bool
    links: frozenset[str] | None


class SweptMotion(NamedTuple):
    """The possible positions of a robot from now on: joints near a path, base on a straight path.

    Attributes:
        body: the robot's chain, and the balls and hulls that enclose its links.
        paths: the pieces of each joint path that the motion may be on.
        joint_tolerance: greatest distance of each joint from the path, rad.
        base: position of the base at the start, in W, m.
        base_path: its displacement, m.
        is_synchronous: base and joints have always completed the same fraction of their paths.
        held: what the robot holds; it is checked like a link. None if it holds nothing.
    """

    body: RobotBody
    paths: tuple[list[Piece], ...]
    joint_tolerance: JointVector
    base: Vec3
    base_path: Vec3
    is_synchronous: bool
    held: Hull | None = None


class RemainingMotion(NamedTuple):
    """The rest of a motion.

    Attributes:
        motion: the whole motion.
        s: the fraction of its path that is behind it, from 0 to 1.
    """

    motion: Trajectory
    s: float = 0.0


class MergedMotion(NamedTuple):
    """The motion of the joints and the motion of the base from now on; a single motion is both.

    Attributes:
        joints: the motion that the joints follow.
        base: the motion that the base follows.
    """

    joints: RemainingMotion
    base: RemainingMotion

    @property
    def is_single_motion(self) -> bool:
        """True if one motion moves joints and base."""
        return self.joints.motion is self.base.motion

    def swept_motion(self, held: Hull | None = None) -> SweptMotion:
        """Return the motion in the form that the sweep checks.

        Args:
            held: what the robot holds.

        Returns:
            The rest of the joint path and of the base's path.
        """
        arm, s = self.joints
        paths = tuple(remaining_path(path, s) for path in arm.joint_paths)
        slack = arm.servo.joint_tolerance if arm.servo else (0.0,) * len(arm.body.dh_rows)
        return SweptMotion(
            arm.body, paths, slack, *_remaining_base_path(self.base), self.is_single_motion, held
        )

    def base_at_end(self) -> Vec3:
        """Return the position of the base when all motions are over.

        Returns:
            The position in W, m.
        """
        return _add(self.base.motion.base, self.base.motion.base_path)

    def tool_at_end(self) -> Vec3:
        """Return the position of the tool when all motions are over.

        Returns:
            The position in W, m.
        """
        arm = self.joints.motion
        tool = ForwardKinematics(arm.body, arm.joint_paths[0][-1][3]).frames[-1].to_base(arm.body.tool_offset)
        return _add(self.base_at_end(), tool)


def moves_joints(motion: Trajectory) -> bool:
    """Check the joint paths of a motion.

    Args:
        motion: a planned motion.

    Returns:
        True if any joint leaves its position.
    """
    start = motion.joint_paths[0][0][0]
    return motion.servo is not None or any(q != start for piece in motion.joint_paths[0] for q in piece)


def _remaining_base_path(part: RemainingMotion) -> tuple[Vec3, Vec3]:
    (x, y, z), (wx, wy, wz), left = part.motion.base, part.motion.base_path, 1.0 - part.s
    return (x + part.s * wx, y + part.s * wy, z + part.s * wz), (left * wx, left * wy, left * wz)


def _add(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


class BarrierBreach(NamedTuple):
    """A barrier and a link for which the motion could not be shown to be clear.

    Attributes:
        barrier: id of the barrier.
        link: name of the link.
        path_parameter: place on the path, s from 0 to 1.
    """

    barrier: str
    link: str
    path_parameter: float


class Enclosure(NamedTuple):
    """Enclosure of a ball of the body, in B: all points within `radius` of a box.

    Attributes:
        centre: centre of the box, m.
        edges: half edges of the box, m.
        radius: m.
    """

    centre: Vec3
    edges: Vec3
    radius: float


_Part = Ball | Hull
_Pairs = list[tuple[_Part, list[BarrierBox]]]


def find_breach(moving: SweptMotion, boxes: list[BarrierBox], clearance: float) -> BarrierBreach | None:
    """Search for a barrier that a link may touch during a motion.

    Args:
        moving: the motion.
        boxes: the barriers.
        clearance: distance to keep from each barrier, m.

    Returns:
        The first breach found, or None if every link is clear of every barrier throughout.
    """
    pairs: _Pairs = []
    parts: list[_Part] = [*moving.body.balls, *([moving.held] if moving.held else [])]
    for ball in parts:
        relevant = [box for box in boxes if box.links is None or ball.link in box.links]
        if relevant:
            pairs.append((ball, relevant))
    sweep = _SweepSearch(moving, clearance + ROUNDING)
    for path in moving.paths:
        breach = sweep.search(path, 0.0, 1.0, pairs, 0)
        if breach is not None:
            return breach
    return None


def ball_enclosures(
    body: RobotBody, pieces: list[Piece], slack: JointVector, balls: Sequence[_Part]
) -> list[Enclosure]:
    """Enclose balls of the body, or hulls that move with it, while the joints are near a stretch of path.

    Args:
        body: the robot.
        pieces: the stretch of path.
        slack: greatest distance of each joint from it, rad.
        balls: the balls and hulls to enclose.

    Returns:
        An enclosure in B for each.
    """
    middle, half, width = path_chord(pieces)
    posture = ForwardKinematics(body, middle)
    along = chord_terms(half, [w + s for w, s in zip(width, slack, strict=True)], posture.slides)
    enclosures = []
    for ball in balls:
        corners = ball.corners if isinstance(ball, Hull) else (ball.centre,)
        points = []
        for corner in corners:
            centre = posture.frames[ball.joint].to_base(corner)
            points.append(Enclosure(centre, *posture.chord_deviation_bound(ball.joint, centre, along)))
        found = points[0] if len(points) == 1 else enclosing_box(points)
        enclosures.append(Enclosure(found.centre, found.edges, ball.radius + found.radius))
    return enclosures


def enclosing_box(points: Sequence[Enclosure]) -> Enclosure:
    """Enclose the convex hull of points, each anywhere in its own enclosure.

    Args:
        points: the enclosures, at least one.

    Returns:
        A box around all boxes, and the greatest radius.
    """
    low = [min(p.centre[axis] - p.edges[axis] for p in points) for axis in range(3)]
    high = [max(p.centre[axis] + p.edges[axis] for p in points) for axis in range(3)]
    x, y, z = ((a + b) / 2.0 for a, b in zip(low, high, strict=True))
    ex, ey, ez = ((b - a) / 2.0 for a, b in zip(low, high, strict=True))
    return Enclosure((x, y, z), (ex, ey, ez), max(p.radius for p in points))


class _SweepSearch:
    def __init__(self, moving: SweptMotion, clearance: float) -> None:
        self._moving = moving
        self._clearance = clearance

    def search(
        self, pieces: list[Piece], low: float, high: float, pairs: _Pairs, depth: int
    ) -> BarrierBreach | None:
        """Return a breach while s is in [low, high], of which `pieces` are the path, or None."""
        base, way = self._base_displacement(low, high)
        left: _Pairs = []
        places = ball_enclosures(
            self._moving.body, pieces, self._moving.joint_tolerance, [ball for ball, _ in pairs]
        )
        for (ball, boxes), (centre, edges, radius) in zip(pairs, places, strict=True):
            room = radius + self._clearance
            carried = (centre[0] + base[0], centre[1] + base[1], centre[2] + base[2])
            close = []
            for box in boxes:
                p, travelled = (centre, _NO_DISPLACEMENT) if box.is_in_base_frame else (carried, way)
                if not is_clear(box, p, edges, travelled, room):
                    close.append(box)
            if close:
                left.append((ball, close))
        if not left:
            return None
        middle = (low + high) / 2.0
        if len(pieces) == 1 and depth == _MAX_SUBDIVISIONS:
            ball, close = left[0]
            return BarrierBreach(close[0].id, ball.link, middle)
        if len(pieces) == 1:
            first, second = ([half] for half in split_in_half(pieces[0]))
            depth += 1
        else:
            half = len(pieces) // 2
            first, second = pieces[:half], pieces[half:]
            middle = low + (high - low) * half / len(pieces)
        return self.search(first, low, middle, left, depth) or self.search(second, middle, high, left, depth)

    def _base_displacement(self, low: float, high: float) -> tuple[Vec3, Vec3]:
        """Return the base's position in W at s = low, and its possible displacement until s = high."""
        base, way = self._moving.base, self._moving.base_path
        if not self._moving.is_synchronous:
            return base, way
        (x, y, z), (wx, wy, wz), fraction = base, way, high - low
        return (x + low * wx, y + low * wy, z + low * wz), (fraction * wx, fraction * wy, fraction * wz)


_NO_DISPLACEMENT: Final = (0.0, 0.0, 0.0)


def is_clear(box: BarrierBox, p: Vec3, edges: Vec3, way: Vec3, room: float) -> bool:
    """Check the distance of a box around a moving point from a barrier.

    A barrier holds the whole path inside iff it holds both ends. From outside, the path is enclosed by the
    box around its ends, and halved where that comes too near, unless its middle is too near itself.

    Args:
        box: the barrier.
        p: the point at the start, in the barrier's frame, m.
        edges: half edges of the box around the point, m.
        way: displacement of the point, m.
        room: distance to keep, m.

    Returns:
        True if the box keeps the distance on the whole way.
    """
    (x, y, z), (ex, ey, ez), (wx, wy, wz) = p, edges, way
    (lx, ly, lz), (ux, uy, uz) = box.lower, box.upper
    ax, bx = (x - ex, x + wx + ex) if wx >= 0.0 else (x + wx - ex, x + ex)
    ay, by = (y - ey, y + wy + ey) if wy >= 0.0 else (y + wy - ey, y + ey)
    az, bz = (z - ez, z + wz + ez) if wz >= 0.0 else (z + wz - ez, z + ez)
    if box.keep_inside:
        return min(ax - lx, ux - bx, ay - ly, uy - by, az - lz, uz - bz) >= room
    if (
        lx - bx >= room
        or ax - ux >= room
        or ly - by >= room
        or ay - uy >= room
        or lz - bz >= room
        or az - uz >= room
    ):
        return True
    dx, dy, dz = max(lx - bx, ax - ux, 0.0), max(ly - by, ay - uy, 0.0), max(lz - bz, az - uz, 0.0)
    if sqrt(dx * dx + dy * dy + dz * dz) >= room:
        return True
    if norm(way) <= _MIN_BASE_STEP:
        return False
    half = (wx / 2.0, wy / 2.0, wz / 2.0)
    middle = (x + half[0], y + half[1], z + half[2])
    return (
        is_clear(box, middle, edges, _NO_DISPLACEMENT, room)
        and is_clear(box, p, edges, half, room)
        and is_clear(box, middle, edges, half, room)
    )
