"""Link-distance check: during a whole motion the links of a robot, and what it holds, keep off each other.

Conservative, as `swept_volume` is. A `Hull` encloses each link: all points within a radius of the convex hull
of some corners. Two hulls are apart if some direction separates them: along it, all corners of one lie beyond
all corners of the other, by more than both radii and the clearance. Any direction will do, so the search for
one need not be trusted. It is E. G. Gilbert's (SIAM J. Control 4, 1966): the point nearest to 0 of the
difference of two convex sets. The distance of two links depends only on the joints between them. So the inner
link is taken to stand where it is in the middle of a stretch of path, with all joints up to its own. Each
corner of the outer link is enclosed as a ball is for barriers. A stretch that is not clear is halved.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from math import dist
from typing import Final, NamedTuple

from aeros.kinematic_chain import pairs_that_may_meet
from aeros.runtime.motion.bezier import Piece, path_chord, split_in_half
from aeros.runtime.motion.kinematic_bounds import ChordTerms, ForwardKinematics, chord_terms, norm
from aeros.runtime.motion.swept_volume import ROUNDING, Enclosure, SweptMotion
from aeros.runtime.ports import Hull, RobotBody, Vec3

_MAX_LINK_SUBDIVISIONS: Final = 8
"""Greatest number of halvings of a piece of path, needed only where links pass at about the clearance."""

_MAX_DIRECTIONS: Final = 24
"""Greatest number of directions that are tried for two hulls."""


class LinkContact(NamedTuple):
    """Two links for which the motion could not be shown to keep them apart.

    Attributes:
        inner: the link with fewer joints between it and the base.
        outer: the other link.
        distance: upper bound of their hulls' distance there, m.
        path_parameter: place on the path, s from 0 to 1.
    """

    inner: str
    outer: str
    distance: float
    path_parameter: float


class HullPair(NamedTuple):
    """The hulls of two links, each with one ball that encloses it and costs less to check.

    Attributes:
        inner: hull of the link with fewer joints between it and the base.
        outer: hull of the other link.
        inner_ball: ball around `inner`.
        outer_ball: ball around `outer`.
    """

    inner: Hull
    outer: Hull
    inner_ball: Hull
    outer_ball: Hull


def find_link_contact(moving: SweptMotion, clearance: float) -> LinkContact | None:
    """Search for two links that may come near each other during a motion.

    Args:
        moving: the motion; its base does not matter.
        clearance: distance to keep between links, m.

    Returns:
        The first contact found, or None if every two links that can meet keep apart throughout.
    """
    pairs = hull_pairs(moving.body, moving.held)
    search = _ContactSearch(moving, clearance + ROUNDING)
    for path in moving.paths:
        contact = search.search(path, 0.0, 1.0, pairs, 0)
        if contact is not None:
            return contact
    return None


@lru_cache(maxsize=8)
def hull_pairs(body: RobotBody, held: Hull | None = None) -> list[HullPair]:
    """List the pairs of hulls to check, with their balls.

    Args:
        body: the robot.
        held: what it holds; it is checked like a link.

    Returns:
        The pairs, inner link first.
    """
    hulls = body.hulls if held is None else (*body.hulls, held)
    return [
        HullPair(inner, outer, _enclosing_ball(inner), _enclosing_ball(outer))
        for inner, outer in pairs_that_may_meet(hulls, body.exempt_pairs)
    ]


def _enclosing_ball(hull: Hull) -> Hull:
    columns = [*zip(*hull.corners, strict=True)]
    x, y, z = ((min(column) + max(column)) / 2.0 for column in columns)
    reach = max(dist((x, y, z), corner) for corner in hull.corners)
    return Hull(hull.link, hull.joint, ((x, y, z),), hull.radius + reach)


class PostureRange:
    """The links' places while the joints are near a chord: middle + λ·half ± room, λ in [−1, 1]; rad.

    Args:
        body: the robot.
        middle: position of each joint in the middle of the chord, rad.
        half: half the chord of each joint, rad.
        room: greatest distance of each joint from the chord, rad.
    """

    def __init__(
        self, body: RobotBody, middle: Sequence[float], half: Sequence[float], room: Sequence[float]
    ) -> None:
        self._posture = ForwardKinematics(body, middle)
        self._half = half
        self._room = room
        # By `id`, as hulls are long to hash.
        self._standing: dict[int, list[Vec3]] = {}
        self._moving: dict[tuple[int, int], list[Enclosure]] = {}

    def find_gap(self, pair: HullPair, room: float) -> float | None:
        """Try to show that two links keep apart by `room`, anywhere near the chord.

        Args:
            pair: the links' hulls.
            room: least distance of the links, m.

        Returns:
            None if they keep apart; otherwise an upper bound of their hulls' distance in the middle, m.
        """
        if self._search(pair.inner_ball, pair.outer_ball, room).direction is not None:
            return None
        found = self._search(pair.inner, pair.outer, room)
        if found.direction is not None:
            return None
        return max(0.0, found.distance - pair.inner.radius - pair.outer.radius)

    def _search(self, inner: Hull, outer: Hull, room: float) -> Separation:
        reach = room + inner.radius + outer.radius
        return search_separation(self._corners(inner), self._enclosures(outer, inner.joint), reach)

    def _corners(self, hull: Hull) -> list[Vec3]:
        found = self._standing.get(id(hull))
        if found is None:
            frame = self._posture.frames[hull.joint]
            found = self._standing[id(hull)] = [frame.to_base(corner) for corner in hull.corners]
        return found

    def _enclosures(self, hull: Hull, standing: int) -> list[Enclosure]:
        """Enclose each corner while the first `standing` joints stand in the middle of the chord."""
        found = self._moving.get((id(hull), standing))
        if found is None:
            along = self._chord_terms(standing)
            found = self._moving[id(hull), standing] = [
                Enclosure(p, *self._posture.chord_deviation_bound(hull.joint, p, along, standing))
                for p in self._corners(hull)
            ]
        return found

    def _chord_terms(self, standing: int) -> ChordTerms:
        none = [0.0] * standing
        return chord_terms(
            [*none, *self._half[standing:]], [*none, *self._room[standing:]], self._posture.slides
        )


def separation(inner: Iterable[Vec3], outer: Iterable[Enclosure], direction: Vec3) -> float:
    """Bound how far the outer corners lie beyond the inner ones along a direction, times its length.

    Args:
        inner: corners that stand, m.
        outer: enclosures of corners that move.
        direction: from the inner to the outer corners, of any length.

    Returns:
        A lower bound of direction·(p − q) for every p in the enclosures and every q in `inner`.
    """
    nx, ny, nz = direction
    ax, ay, az, length = abs(nx), abs(ny), abs(nz), norm(direction)
    return min(
        [
            nx * x + ny * y + nz * z - ax * ex - ay * ey - az * ez - length * radius
            for (x, y, z), (ex, ey, ez), radius in outer
        ]
    ) - max([nx * x + ny * y + nz * z for x, y, z in inner])


class Separation(NamedTuple):
    """Result of a search for a direction along which corners are apart.

    Attributes:
        direction: None if none was found.
        distance: upper bound of the distance of the corners' convex hulls, each corner in the middle of its
            enclosure, m.
    """

    direction: Vec3 | None
    distance: float


def search_separation(inner: Sequence[Vec3], outer: Sequence[Enclosure], reach: float) -> Separation:
    """Search for a direction along which outer corners are apart from inner ones by `reach`.

    Args:
        inner: corners that stand, m.
        outer: enclosures of corners that move.
        reach: m, above 0.

    Returns:
        A direction, if one was found: the corners' convex hulls then keep apart by `reach`.
    """
    x, y, z = _difference(outer[0].centre, inner[0])
    for _ in range(_MAX_DIRECTIONS):
        length = norm((x, y, z))
        if 0.0 < reach * length <= separation(inner, outer, (x, y, z)):
            return Separation((x, y, z), length)
        if length < reach:
            break
        near = min(outer, key=lambda one: x * one.centre[0] + y * one.centre[1] + z * one.centre[2]).centre
        far = max(inner, key=lambda p: x * p[0] + y * p[1] + z * p[2])
        # Go on with the point nearest to 0 on the way to the farthest point against the direction.
        sx, sy, sz = _difference(near, far)
        dx, dy, dz = sx - x, sy - y, sz - z
        square = dx * dx + dy * dy + dz * dz
        share = -(x * dx + y * dy + z * dz) / square if square > 0.0 else 0.0
        if share <= 0.0:
            break
        share = min(share, 1.0)
        x, y, z = x + share * dx, y + share * dy, z + share * dz
    else:
        # Between long sides the search alternates between them. Those of obstacles are along the axes of B.
        for direction in ((x, y, 0.0), (x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)):
            if 0.0 < reach * norm(direction) <= separation(inner, outer, direction):
                return Separation(direction, norm((x, y, z)))
    return Separation(None, norm((x, y, z)))


def _difference(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


class _ContactSearch:
    def __init__(self, moving: SweptMotion, clearance: float) -> None:
        self._moving = moving
        self._clearance = clearance

    def search(
        self, pieces: list[Piece], low: float, high: float, pairs: list[HullPair], depth: int
    ) -> LinkContact | None:
        """Return a contact while s is in [low, high], of which `pieces` are the path, or None."""
        middle, half, width = path_chord(pieces)
        room = [w + s for w, s in zip(width, self._moving.joint_tolerance, strict=True)]
        links = PostureRange(self._moving.body, middle, half, room)
        left, halfway = [], (low + high) / 2.0
        for pair in pairs:
            gap = links.find_gap(pair, self._clearance)
            if gap is None:
                continue
            if gap < self._clearance or (len(pieces) == 1 and depth == _MAX_LINK_SUBDIVISIONS):
                return LinkContact(pair.inner.link, pair.outer.link, gap, halfway)
            left.append(pair)
        if not left:
            return None
        if len(pieces) == 1:
            first, second = ([part] for part in split_in_half(pieces[0]))
            depth += 1
        else:
            count = len(pieces) // 2
            first, second = pieces[:count], pieces[count:]
            halfway = low + (high - low) * count / len(pieces)
        return self.search(first, low, halfway, left, depth) or self.search(
            second, halfway, high, left, depth
        )
