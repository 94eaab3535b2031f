"""Whether a moving body keeps out of volumes, and inside of others, during a whole motion.

Conservative: a stretch of path is enclosed by the box of its control points, and each ball of the body
by the ball around its centre in the box's middle posture, larger by how far the box lets that centre
move (`kinematics`), by half the way of the base meanwhile, and by the clearance.  A stretch that is not
clear is halved, down to `_DEPTH` halvings of a piece of the path; what is not clear then is refused, so
a motion that passes a barrier more closely than the last enclosures are wide is refused, and none that
meets one is allowed.
"""

from __future__ import annotations

from math import sqrt
from typing import Final, NamedTuple

from aeros.runtime.bezier import Piece, halves, span_of
from aeros.runtime.kinematics import Posture, norm
from aeros.runtime.ports import Ball, Body, Joints, Trajectory, Triple

_DEPTH: Final = 4
"""How often a piece of the path is halved at most: its enclosures are then a few tenths of a mm wide."""

_ROUNDING: Final = 1e-9
"""More than what rounding takes from any distance here, m."""


class Box(NamedTuple):
    """A volume as the check sees it: corners, in W or from the base, and who heeds it."""

    id: str
    lower: Triple
    upper: Triple
    inside: bool
    in_base: bool
    links: frozenset[str] | None


class Breach(NamedTuple):
    """What could not be shown to be clear: barrier, link, and where on the path, s from 0 to 1."""

    barrier: str
    link: str
    at: float


class Enclosure(NamedTuple):
    """A ball, in the frame of the base's start or of W, that a ball of the body stays in."""

    centre: Triple
    radius: float


_Pairs = list[tuple[Ball, list[Box]]]


def breach_of(trajectory: Trajectory, boxes: list[Box], clearance: float) -> Breach | None:
    """The first breach that is found, or None if every link is clear of every barrier throughout."""
    pairs: _Pairs = []
    for ball in trajectory.body.balls:
        heeded = [one for one in boxes if one.links is None or ball.link in one.links]
        if heeded:
            pairs.append((ball, heeded))
    slack = trajectory.servo.slack if trajectory.servo else (0.0,) * len(trajectory.body.rows)
    sweep = _Sweep(trajectory, slack, clearance + _ROUNDING)
    for path in trajectory.paths:
        found = sweep.search(list(path), 0.0, 1.0, pairs, 0)
        if found is not None:
            return found
    return None


def enclosures(
    body: Body, pieces: list[Piece], slack: Joints, balls: list[Ball], moved: float = 0.0
) -> list[Enclosure]:
    """Where the balls may be, in B, while the joints are within `slack` of the pieces.

    moved: by how much the base may be off the middle of its way meanwhile, m.
    """
    middle, width = span_of(pieces)
    posture = Posture(body, middle)
    room = [w + s for w, s in zip(width, slack, strict=True)]
    found = []
    for ball in balls:
        centre = posture.frames[ball.joint].place(ball.centre)
        spread, _ = posture.spread(ball.joint, centre, room)
        found.append(Enclosure(centre, ball.radius + spread + moved))
    return found


class _Sweep:
    def __init__(self, trajectory: Trajectory, slack: Joints, clearance: float) -> None:
        self._body = trajectory.body
        self._base = trajectory.base
        self._way = trajectory.way
        self._travel = norm(trajectory.way)
        self._slack = slack
        self._clearance = clearance

    def search(
        self, pieces: list[Piece], low: float, high: float, pairs: _Pairs, depth: int
    ) -> Breach | None:
        """A breach while s is in [low, high], which the pieces are the path of."""
        moved = self._travel * (high - low) / 2.0
        at = (low + high) / 2.0
        balls = [ball for ball, _ in pairs]
        left: _Pairs = []
        places = enclosures(self._body, pieces, self._slack, balls, moved)
        for (ball, boxes), (centre, radius) in zip(pairs, places, strict=True):
            close = [box for box in boxes if not self._clear(box, centre, at, radius, moved)]
            if close:
                left.append((ball, close))
        if not left:
            return None
        if len(pieces) == 1 and depth == _DEPTH:
            ball, close = left[0]
            return Breach(close[0].id, ball.link, at)
        if len(pieces) == 1:
            first, second = ([half] for half in halves(pieces[0]))
            depth += 1
            middle = at
        else:
            half = len(pieces) // 2
            first, second = pieces[:half], pieces[half:]
            middle = low + (high - low) * half / len(pieces)
        return self.search(first, low, middle, left, depth) or self.search(second, middle, high, left, depth)

    def _clear(self, box: Box, centre: Triple, at: float, radius: float, moved: float) -> bool:
        if box.in_base:
            # What the base's way adds moves box and ball alike.
            p, room = centre, radius - moved + self._clearance
        else:
            base, way = self._base, self._way
            p = (
                centre[0] + base[0] + at * way[0],
                centre[1] + base[1] + at * way[1],
                centre[2] + base[2] + at * way[2],
            )
            room = radius + self._clearance
        (x, y, z), (lx, ly, lz), (ux, uy, uz) = p, box.lower, box.upper
        if box.inside:
            return min(x - lx, ux - x, y - ly, uy - y, z - lz, uz - z) >= room
        dx, dy, dz = max(lx - x, x - ux, 0.0), max(ly - y, y - uy, 0.0), max(lz - z, z - uz, 0.0)
        return sqrt(dx * dx + dy * dy + dz * dz) >= room
