"""Distance from a barrier at the worst position of a refused motion, for the message that refuses it.

The swept-volume check decides; this only measures at some positions of the path, so nothing is allowed or
denied because of it. Distances are those of the enclosures that the check uses: balls of the links, and the
box around what is held.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, log2, sqrt
from typing import Final, NamedTuple

from aeros.runtime.motion.bezier import Piece, split_in_half
from aeros.runtime.motion.swept_volume import BarrierBox, Enclosure, SweptMotion, ball_enclosures
from aeros.runtime.ports import Ball, Hull, JointVector, Vec3

_POSITIONS: Final = 64
"""Least number of steps into which a whole path is cut, if it has fewer pieces."""

_BASE_STEPS: Final = 8
"""Number of steps on the way of a base that moves on its own."""


class NearestApproach(NamedTuple):
    """The position of a motion at which a link is nearest to a barrier, or deepest in it.

    Attributes:
        distance: from the barrier's faces on the side where the link has to stay, m; negative on the other.
        path_parameter: place on the path, s from 0 to 1.
    """

    distance: float
    path_parameter: float


def find_nearest_approach(moving: SweptMotion, box: BarrierBox, link: str) -> NearestApproach:
    """Measure the distance of a link from a barrier at positions of a motion, and find the least.

    Args:
        moving: the motion.
        box: the barrier.
        link: name of a link of the body, or that of what is held.

    Returns:
        The least distance found; distances between the positions may be a little less.
    """
    parts: list[Ball | Hull] = [*moving.body.balls, *([] if moving.held is None else [moving.held])]
    enclosing = [part for part in parts if part.link == link]
    return min(
        NearestApproach(_distance(box, shifted(enclosure, offset)), s)
        for path in moving.paths
        for s, q in _positions(path)
        for enclosure in ball_enclosures(moving.body, [(q, q, q, q)], moving.joint_tolerance, enclosing)
        for offset in _base_offsets(moving, box, s)
    )


def shifted(enclosure: Enclosure, offset: Vec3) -> Enclosure:
    """Move an enclosure.

    Args:
        enclosure: the enclosure, in the base's frame.
        offset: its displacement, m.

    Returns:
        The enclosure at its new place.
    """
    x, y, z = (a + b for a, b in zip(enclosure.centre, offset, strict=True))
    return enclosure._replace(centre=(x, y, z))


def _positions(path: list[Piece]) -> Iterator[tuple[float, JointVector]]:
    """Yield places on a path, s from 0 to 1, with the joint positions there."""
    halvings = max(0, ceil(log2(_POSITIONS / len(path))))
    pieces = list(path)
    for _ in range(halvings):
        pieces = [half for piece in pieces for half in split_in_half(piece)]
    yield 0.0, pieces[0][0]
    for number, piece in enumerate(pieces, 1):
        yield number / len(pieces), piece[3]


def _base_offsets(moving: SweptMotion, box: BarrierBox, s: float) -> Iterator[Vec3]:
    """Yield where the base may be at `s`, in the frame of the barrier."""
    if box.is_in_base_frame:
        yield (0.0, 0.0, 0.0)
        return
    is_alone = any(moving.base_path) and not moving.is_synchronous
    for done in [step / _BASE_STEPS for step in range(_BASE_STEPS + 1)] if is_alone else [s]:
        (x, y, z), (wx, wy, wz) = moving.base, moving.base_path
        yield (x + done * wx, y + done * wy, z + done * wz)


def _distance(box: BarrierBox, enclosure: Enclosure) -> float:
    """Return the distance of an enclosure from the faces of a barrier, m; negative on the wrong side."""
    rows = zip(enclosure.centre, enclosure.edges, box.lower, box.upper, strict=True)
    if box.keep_inside:
        return min(min(c - e - low, high - c - e) for c, e, low, high in rows) - enclosure.radius
    gaps = [max(low - c - e, c - e - high) for c, e, low, high in rows]
    if max(gaps) < 0.0:
        return max(gaps) - enclosure.radius
    return sqrt(sum(max(gap, 0.0) ** 2 for gap in gaps)) - enclosure.radius
