"""Ways round obstacles: straight lines of the tool over and beside them, and of a base beside them.

A graph of places is searched for the shortest way: the start, the target, and at several heights the places
of both, places around each obstacle, and places near the robot's base. A way is checked as a whole, leg by
leg, by the same code that decides motions. A leg that fails is removed, and the search goes on (LazySP:
C. Dellin, S. Srinivasa, ICAPS 2016). So a way that is found is one that will be allowed, and the search need
not be trusted. There is no chance in it: equal worlds give equal ways.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from heapq import heappop, heappush
from math import cos, dist, pi, sin
from typing import Final, TypeVar

from aeros.runtime.motion.swept_volume import BarrierBox
from aeros.runtime.ports import Vec3

_LEG_COST: Final = 0.15
"""Length that each further leg counts for, m: it begins and ends at rest."""

_RISES: Final = (0.06, 0.16, 0.30)
"""Heights over an obstacle's top at which the tool may pass over it, m: the hand is below the wrist, and what
it holds is below the hand."""

_ASIDE: Final = (0.14, 0.24, 0.36)
"""Distances from an obstacle's sides at which the tool may pass it, m."""

_BASE_ASIDE: Final = (0.035, 0.15)
"""Distances from an enlarged obstacle at which a base may turn off, m: more than `_ROOM`."""

_DRAWN_IN: Final = (0.32, 0.45)
"""Distances from the base at which the tool may turn about it, m."""

_TURNS: Final = tuple(pi * step / 6.0 for step in range(-4, 5))
"""Directions from the base of these places, rad."""

MOST_TRIES: Final = 60
"""Greatest number of ways that are checked: some two seconds of computation."""

_APART: Final = 0.04
"""Least distance of two columns, or of two heights, of via points, m: ways beside a failing one fail, too."""

_ROOM: Final = 0.03
"""Distance that the tool point itself keeps from obstacles in the graph, m; the links are checked later."""

_Place = TypeVar("_Place", bound=Sequence[float])

Check = Callable[[Sequence[Vec3]], int | None]
"""Decides the legs to these places one after the other; returns the index of the first that fails."""


def find_detour(
    start: Vec3,
    target: Vec3,
    base: Vec3,
    obstacles: Sequence[BarrierBox],
    is_allowed: Callable[[Vec3], bool],
    check: Check,
) -> list[Vec3] | None:
    """Find the shortest way round obstacles that passes its check.

    Args:
        start: position of the tool in W, m.
        target: where it is to be, m.
        base: position of the robot's base, m.
        obstacles: what is in the way, in W.
        is_allowed: False for a place at which no leg may end, whatever the way to it is.
        check: decides a way.

    Returns:
        The ends of the legs, with the target last; None if none was found.
    """
    return _find_way(
        [start, target], _via_points(start, target, base, obstacles), obstacles, is_allowed, check
    )


def find_base_detour(
    start: Vec3,
    target: Vec3,
    obstacles: Sequence[BarrierBox],
    is_allowed: Callable[[Vec3], bool],
    check: Check,
) -> list[Vec3] | None:
    """Find the shortest way of a base beside obstacles that passes its check.

    Args:
        start: position of the base in W, m.
        target: where it is to be, m.
        obstacles: boxes in W that the position keeps out of: obstacles, enlarged by what drives.
        is_allowed: False for a place at which no leg may end, whatever the way to it is.
        check: decides a way.

    Returns:
        The ends of the legs, with the target last; None if none was found.
    """
    columns = [
        (x, y)
        for box in obstacles
        for off in _BASE_ASIDE
        for x in (start[0], target[0], box.lower[0] - off, box.upper[0] + off)
        for y in (start[1], target[1], box.lower[1] - off, box.upper[1] + off)
    ]
    places = [(x, y, start[2]) for x, y in _apart(columns)]
    return _find_way([start, target], places, obstacles, is_allowed, check)


def _find_way(
    ends: list[Vec3],
    via_points: Sequence[Vec3],
    obstacles: Sequence[BarrierBox],
    is_allowed: Callable[[Vec3], bool],
    check: Check,
) -> list[Vec3] | None:
    graph = _Graph(list(ends), obstacles)
    for place in via_points:
        if place not in graph.places and not _is_near(place, obstacles) and is_allowed(place):
            graph.places.append(place)
    for _ in range(MOST_TRIES):
        way = graph.shortest_way()
        if way is None:
            return None
        ends = [graph.places[number] for number in way[1:]]
        failed = check(ends)
        if failed is None:
            return ends
        graph.remove(way[failed], way[failed + 1])
    return None


def _via_points(start: Vec3, target: Vec3, base: Vec3, obstacles: Sequence[BarrierBox]) -> list[Vec3]:
    heights = [start[2], target[2], base[2] + 0.36, base[2] + 0.45]
    heights += [box.upper[2] + rise for box in obstacles for rise in _RISES]
    columns = [start[:2], target[:2]]
    for box in obstacles:
        (ax, ay, _), (bx, by, _) = box.lower, box.upper
        for off in _ASIDE:
            xs, ys = (ax - off, (ax + bx) / 2.0, bx + off), (ay - off, (ay + by) / 2.0, by + off)
            columns += [(x, y) for x in xs for y in ys]
    columns += [
        (base[0] + far * cos(turn), base[1] + far * sin(turn)) for far in _DRAWN_IN for turn in _TURNS
    ]
    apart = _apart(columns)
    return [(x, y, z) for (z,) in _apart([(z,) for z in heights]) for x, y in apart]


def _apart(places: Sequence[_Place]) -> list[_Place]:
    """Leave out places that are near one that comes before them."""
    kept: list[_Place] = []
    for place in places:
        if all(dist(place, other) >= _APART for other in kept):
            kept.append(place)
    return kept


class _Graph:
    """Places and the legs between them, from place 0 to place 1.

    A leg is examined when the search comes to it: the tool point itself meets no obstacle on it.
    """

    def __init__(self, places: list[Vec3], obstacles: Sequence[BarrierBox]) -> None:
        self.places = places
        self._obstacles = obstacles
        # The straight way is what is to be avoided.
        self._is_leg: dict[tuple[int, int], bool] = {(0, 1): False}

    def remove(self, one: int, other: int) -> None:
        """Remove a leg."""
        self._is_leg[one, other] = False

    def shortest_way(self) -> list[int] | None:
        """Return the shortest way (A*), of equal ones always the same; None if there is none."""
        places, target = self.places, self.places[1]
        queue: list[tuple[float, float, int, int]] = [(0.0, 0.0, 0, 0)]
        before: dict[int, int] = {}
        while queue:
            _, length, place, came_from = heappop(queue)
            if place in before:
                continue
            before[place] = came_from
            if place == 1:
                way = [1]
                while way[-1] != 0:
                    way.append(before[way[-1]])
                return way[::-1]
            here = places[place]
            for other, there in enumerate(places):
                if other not in before and self._has_leg(place, other):
                    further = length + dist(here, there) + _LEG_COST
                    # Another leg leads from there to the target, at least.
                    rest = 0.0 if other == 1 else dist(there, target) + _LEG_COST
                    heappush(queue, (further + rest, further, other, place))
        return None

    def _has_leg(self, one: int, other: int) -> bool:
        known = self._is_leg.get((one, other))
        if known is None:
            known = not _meets(self.places[one], self.places[other], self._obstacles)
            self._is_leg[one, other] = known
        return known


def _is_near(place: Vec3, obstacles: Sequence[BarrierBox]) -> bool:
    return any(
        all(a - _ROOM < p < b + _ROOM for a, p, b in zip(box.lower, place, box.upper, strict=True))
        for box in obstacles
    )


def _meets(start: Vec3, end: Vec3, obstacles: Sequence[BarrierBox]) -> bool:
    """Check if a line comes within `_ROOM` of an obstacle (slab method)."""
    for box in obstacles:
        enter, leave = 0.0, 1.0
        for a, b, lower, upper in zip(start, end, box.lower, box.upper, strict=True):
            low, high = lower - _ROOM, upper + _ROOM
            if a == b:
                leave = leave if low < a < high else -1.0
                continue
            first, last = sorted(((low - a) / (b - a), (high - a) / (b - a)))
            enter, leave = max(enter, first), min(leave, last)
        if enter < leave:
            return True
    return False
