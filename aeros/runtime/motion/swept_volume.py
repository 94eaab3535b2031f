"""Whether a moving body keeps out of volumes, and inside of others, during a whole motion.

Conservative: a stretch of path is enclosed by a straight way of the joints and how far its control points
are beside that, and each ball of the body by a box around its centre in the middle posture and how near
to that box its centre stays (`kinematics`), larger by its radius and by the clearance.  All that is taken
to be everywhere on the stretch of its way that the base may be on meanwhile: the same share of it where
one motion moves both, and all of it where base and joints are moved by motions that nothing keeps in step.
A stretch of path that is not clear is halved, down to `_MAX_SUBDIVISIONS` halvings of a piece; what is not
clear then
is refused, so a motion that passes a barrier more closely than the last enclosures are wide is refused,
and none that meets one is allowed.
"""

from __future__ import annotations

from math import sqrt
from typing import Final, NamedTuple

from aeros.runtime.motion.bezier import Piece, path_chord, split_in_half
from aeros.runtime.motion.kinematics import ForwardKinematics, chord_terms, norm
from aeros.runtime.ports import Ball, JointVector, RobotBody, Vec3

_MAX_SUBDIVISIONS: Final = 4
"""How often a piece of the path is halved at most: its enclosures are then a few tenths of a mm wide."""

_MIN_BASE_STEP: Final = 1e-3
"""Length of the base's way that is not divided any more, m."""

_ROUNDING: Final = 1e-9
"""More than what rounding takes from any distance here, m."""


class BarrierBox(NamedTuple):
    """A volume as the check sees it: corners, in W or from the base, and who heeds it."""

    id: str
    lower: Vec3
    upper: Vec3
    keep_inside: bool
    is_in_base_frame: bool
    links: frozenset[str] | None


class SweptMotion(NamedTuple):
    """What a robot may do from now on: its joints are within `slack` of a path, its base is on a way.

    base, way: from where in W, and how far, m.
    in_step: the base has made the same share of its way as the joints of their path; otherwise any.
    """

    body: RobotBody
    paths: tuple[list[Piece], ...]
    joint_tolerance: JointVector
    base: Vec3
    base_path: Vec3
    is_synchronous: bool


class BarrierBreach(NamedTuple):
    """What could not be shown to be clear: barrier, link, and where on the path, s from 0 to 1."""

    barrier: str
    link: str
    path_parameter: float


class Enclosure(NamedTuple):
    """What a ball of the body stays in, in B: whatever is within `radius` of a box with these half edges."""

    centre: Vec3
    edges: Vec3
    radius: float


_Pairs = list[tuple[Ball, list[BarrierBox]]]


def find_breach(moving: SweptMotion, boxes: list[BarrierBox], clearance: float) -> BarrierBreach | None:
    """The first breach that is found, or None if every link is clear of every barrier throughout."""
    pairs: _Pairs = []
    for ball in moving.body.balls:
        heeded = [one for one in boxes if one.links is None or ball.link in one.links]
        if heeded:
            pairs.append((ball, heeded))
    sweep = _SweepSearch(moving, clearance + _ROUNDING)
    for path in moving.paths:
        found = sweep.search(path, 0.0, 1.0, pairs, 0)
        if found is not None:
            return found
    return None


def ball_enclosures(
    body: RobotBody, pieces: list[Piece], slack: JointVector, balls: list[Ball]
) -> list[Enclosure]:
    """Where the balls may be, in B, while the joints are within `slack` of the pieces."""
    middle, half, width = path_chord(pieces)
    posture = ForwardKinematics(body, middle)
    along = chord_terms(half, [w + s for w, s in zip(width, slack, strict=True)])
    found = []
    for ball in balls:
        centre = posture.frames[ball.joint].to_base(ball.centre)
        edges, near = posture.chord_deviation_bound(ball.joint, centre, along)
        found.append(Enclosure(centre, edges, ball.radius + near))
    return found


class _SweepSearch:
    def __init__(self, moving: SweptMotion, clearance: float) -> None:
        self._moving = moving
        self._clearance = clearance

    def search(
        self, pieces: list[Piece], low: float, high: float, pairs: _Pairs, depth: int
    ) -> BarrierBreach | None:
        """A breach while s is in [low, high], which the pieces are the path of."""
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
        """From where in W, and how far, the base may be moved while s is in [low, high]."""
        base, way = self._moving.base, self._moving.base_path
        if not self._moving.is_synchronous:
            return base, way
        (x, y, z), (wx, wy, wz), made = base, way, high - low
        return (x + low * wx, y + low * wy, z + low * wz), (made * wx, made * wy, made * wz)


_NO_DISPLACEMENT: Final = (0.0, 0.0, 0.0)


def is_clear(box: BarrierBox, p: Vec3, edges: Vec3, way: Vec3, room: float) -> bool:
    """Whether what has these half edges around `p` keeps `room` from what the box forbids on its way.

    A box holds all of the way iff it holds its ends.  From outside, the way is enclosed by the box of its
    ends, and halved where that comes too near, unless its middle does too.
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
