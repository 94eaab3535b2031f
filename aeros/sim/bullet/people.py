"""People around the robot: capsules that walk along declared ways, and how near they are to it.

They are moved, not pushed: nothing they touch feels them, so that being near is all they do to a robot.
Not modelled: arms that reach out, which is what a site's intrusion distance is for.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import dist, inf
from typing import Final

from aeros.sim.bullet.client import bullet
from aeros.sim.bullet.world import Colour, PhysicsWorld
from aeros.sim.geometry import UPRIGHT
from aeros.sim.randomness import RandomSource

DEFAULT_HEIGHT: Final = 1.75
DEFAULT_RADIUS: Final = 0.25
"""A person, if nothing else is declared, m: enclosed by a capsule of that height and radius."""

_CLOTHES: Final[Colour] = (0.30, 0.42, 0.50, 1.0)

MAX_SPEED: Final = 12.0
"""Speed that nobody exceeds, m/s."""

_DISTANCE_STEP: Final = 0.02
"""How much nearer than at the last tick is looked for first, m: robot and person together at 4.8 m/s."""

Position2 = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Waypoint:
    """One place on a way, x and y in W, m.

    speed: how fast it is walked to, m/s; arrive: when it is reached instead, s, unless nobody walks so
        fast.  The first has neither.
    stay: how long they stand there, s.
    """

    position: Position2
    speed: float | None = None
    arrival_time: float | None = None
    dwell: float = 0.0


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody, and the way they go; lengths in m, times in s.

    floor: height in W of what they stand on.
    spread: each place is up to this far from where it is declared, in x and in y, by chance.
    delay: everything is up to this much later, by chance.
    """

    name: str
    path: tuple[Waypoint, ...]
    height: float = DEFAULT_HEIGHT
    radius: float = DEFAULT_RADIUS
    floor: float = 0.0
    position_spread: float = 0.0
    max_delay: float = 0.0


class WalkSchedule:
    """Where one person is at which time, as `chance` has it (channel: their name)."""

    def __init__(self, person: Person, chance: RandomSource) -> None:
        draw = chance.generator(f"person {person.name}").uniform(-1.0, 1.0, 1 + 2 * len(person.path))
        late = person.max_delay * (1.0 + float(draw[0])) / 2.0
        self._times: list[float] = []
        self._places: list[Position2] = []
        for number, one in enumerate(person.path):
            dx, dy = (person.position_spread * float(part) for part in draw[1 + 2 * number : 3 + 2 * number])
            place = (one.position[0] + dx, one.position[1] + dy)
            if number == 0:
                self._add_keyframe(0.0, place)
                self._add_keyframe(one.dwell + late, place)
                continue
            left, way = self._times[-1], dist(self._places[-1], place)
            there = left + way / (one.speed or MAX_SPEED)
            if one.arrival_time is not None:
                there = max(there, one.arrival_time + late)
            self._add_keyframe(there, place)
            self._add_keyframe(there + one.dwell, place)

    def position(self, time: float) -> Position2:
        """Where they are, x and y in W, m."""
        after = bisect_right(self._times, time)
        if after == len(self._times):
            return self._places[-1]
        t0, t1 = self._times[after - 1], self._times[after]
        (x0, y0), (x1, y1) = self._places[after - 1], self._places[after]
        share = (time - t0) / (t1 - t0)
        return (x0 + share * (x1 - x0), y0 + share * (y1 - y0))

    def _add_keyframe(self, time: float, place: Position2) -> None:
        self._times.append(time)
        self._places.append(place)


class People:
    """People in a world, and their distance from the robot there."""

    def __init__(
        self, world: PhysicsWorld, robot: int, people: Sequence[Person], chance: RandomSource
    ) -> None:
        """Put them where they are at first.  robot: its body."""
        self._world = world
        self._robot = robot
        self._chance = chance
        self._walkers = [_PersonBody(world, one, chance) for one in people]

    def add_person(self, person: Person) -> None:
        """Let somebody come who was not there; their way begins now."""
        self._walkers.append(_PersonBody(self._world, person, self._chance, self._world.time))

    def update(self, time: float) -> None:
        """Put them where they are at `time`, s."""
        for one in self._walkers:
            one.update(time)

    def distance(self, within: float) -> float:
        """Of the nearest person from any part of the robot, m; inf where nobody is nearer than `within`.

        0 where they overlap.  What the robot holds is no part of it.
        """
        if not self._walkers:
            return inf
        return max(0.0, min(one.distance(self._robot, within) for one in self._walkers))


class _PersonBody:
    """One person's body."""

    def __init__(self, world: PhysicsWorld, person: Person, chance: RandomSource, since: float = 0.0) -> None:
        self._client = world.client
        self._since = since
        self._walk = WalkSchedule(person, chance)
        self._middle = person.floor + person.height / 2.0
        self._last = inf
        length = person.height - 2.0 * person.radius
        shape = bullet.createCollisionShape(
            bullet.GEOM_CAPSULE, radius=person.radius, height=length, physicsClientId=self._client
        )
        visual = bullet.createVisualShape(
            bullet.GEOM_CAPSULE,
            radius=person.radius,
            length=length,
            rgbaColor=_CLOTHES,
            physicsClientId=self._client,
        )
        self._body: int = bullet.createMultiBody(0.0, shape, visual, physicsClientId=self._client)
        bullet.setCollisionFilterGroupMask(self._body, -1, 0, 0, physicsClientId=self._client)
        self.update(since)

    def update(self, time: float) -> None:
        x, y = self._walk.position(time - self._since)
        bullet.resetBasePositionAndOrientation(
            self._body, (x, y, self._middle), UPRIGHT, physicsClientId=self._client
        )

    def distance(self, robot: int, within: float) -> float:
        """Asked first for links about as near as the last time: the others cost more than all the rest."""
        near = self._query_distance(robot, min(within, self._last + _DISTANCE_STEP))
        self._last = near if near < inf else self._query_distance(robot, within)
        return self._last

    def _query_distance(self, robot: int, within: float) -> float:
        points = bullet.getClosestPoints(robot, self._body, within, physicsClientId=self._client)
        return min((float(point[8]) for point in points), default=inf)
