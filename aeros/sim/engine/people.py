"""Simulated people: capsules on scripted paths, and their distance from the robot.

They are moved, not pushed, and nothing they touch feels them: they affect a robot only by being near.
Not modelled: arms that reach out; a site's intrusion distance allows for them.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import dist, inf, sqrt
from typing import Final

from aeros.runtime.ports import PersonFigure
from aeros.sim.engine.engine import Engine
from aeros.sim.randomness import RandomSource
from aeros.sim.scanners.sections import Disc

DEFAULT_HEIGHT: Final = 1.75
DEFAULT_RADIUS: Final = 0.25
"""A person, if nothing else is declared, m: enclosed by a capsule of that height and radius."""

MAX_SPEED: Final = 12.0
"""Greatest walking speed, m/s."""

Position2 = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A place on a path, x and y in W.

    Attributes:
        position: m.
        speed: walking speed to it, m/s; the first waypoint has none.
        arrival_time: when it is reached, s, unless that needs more than `MAX_SPEED`; given instead of
            `speed`.
        dwell: time spent there, s.
    """

    position: Position2
    speed: float | None = None
    arrival_time: float | None = None
    dwell: float = 0.0


@dataclass(frozen=True, slots=True)
class Person:
    """A person and their path; lengths in m, times in s.

    Attributes:
        name: keys the random draws.
        path: waypoints, the first where they are at the start.
        height: of the capsule.
        radius: of the capsule.
        floor: height in W of the floor they stand on; None for that of the cell.
        position_spread: greatest random offset of each waypoint, in x and in y.
        max_delay: greatest random delay of the whole path.
    """

    name: str
    path: tuple[Waypoint, ...]
    height: float = DEFAULT_HEIGHT
    radius: float = DEFAULT_RADIUS
    floor: float | None = None
    position_spread: float = 0.0
    max_delay: float = 0.0


class WalkSchedule:
    """Position of a person over time, with random offsets and delay.

    Args:
        person: the person and their path.
        chance: random source; channel `person NAME`.
    """

    def __init__(self, person: Person, chance: RandomSource) -> None:
        draw = chance.generator(f"person {person.name}").uniform(-1.0, 1.0, 1 + 2 * len(person.path))
        delay = person.max_delay * (1.0 + float(draw[0])) / 2.0
        self._times: list[float] = []
        self._places: list[Position2] = []
        for number, waypoint in enumerate(person.path):
            dx, dy = (person.position_spread * float(part) for part in draw[1 + 2 * number : 3 + 2 * number])
            place = (waypoint.position[0] + dx, waypoint.position[1] + dy)
            if number == 0:
                self._add_keyframe(0.0, place)
                self._add_keyframe(waypoint.dwell + delay, place)
                continue
            departure, distance = self._times[-1], dist(self._places[-1], place)
            arrival = departure + distance / (waypoint.speed or MAX_SPEED)
            if waypoint.arrival_time is not None:
                arrival = max(arrival, waypoint.arrival_time + delay)
            self._add_keyframe(arrival, place)
            self._add_keyframe(arrival + waypoint.dwell, place)

    def position(self, time: float) -> Position2:
        """Interpolate the position at a time.

        Args:
            time: since the start of the path, s.

        Returns:
            x and y in W, m.
        """
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
    """The people in a world, and their distance from the robot.

    Attributes:
        walkers: each person's body, in the order in which they were added.
    """

    def __init__(
        self,
        engine: Engine,
        robot: int,
        people: Sequence[Person],
        chance: RandomSource,
        floor: float = 0.0,
    ) -> None:
        """Place everybody at the start of their path.

        Args:
            engine: the engine with the world that they are in.
            robot: number of the robot's body.
            people: the people.
            chance: random source of offsets and delays.
            floor: height in W of the cell's floor, m.
        """
        self._engine = engine
        self._robot = robot
        self._chance = chance
        self._floor = floor
        self.walkers: list[_Walker] = []
        for person in people:
            self._add(person, 0.0)

    @property
    def bodies(self) -> list[int]:
        """Numbers of their bodies."""
        return [walker.body for walker in self.walkers]

    def add_person(self, person: Person) -> None:
        """Add a person, whose path begins now.

        Args:
            person: the person.
        """
        self._add(person, self._engine.world.time)

    def update(self, time: float) -> None:
        """Move everybody to their position at a time.

        Args:
            time: on the plant's clock, s.
        """
        for walker in self.walkers:
            walker.update(time)

    def figures(self) -> list[PersonFigure]:
        """Locate everybody.

        Returns:
            The people where they are, in the order in which they were added.
        """
        return [walker.figure() for walker in self.walkers]

    def sections(self, height: float) -> list[Disc]:
        """Cut them with a level plane.

        Args:
            height: of the plane in W, m.

        Returns:
            The sections of those whom the plane meets.
        """
        return [disc for walker in self.walkers if (disc := walker.section(height)) is not None]

    def distance(self, within: float) -> float:
        """Measure the true distance of the nearest person from any part of the robot.

        An object that the robot holds is not part of it.

        Args:
            within: range of the measurement, m.

        Returns:
            The distance, m; 0 if they overlap, inf if nobody is within the range.
        """
        nearest = min((walker.distance(self._robot, within) for walker in self.walkers), default=inf)
        return max(0.0, nearest)

    def _add(self, person: Person, since: float) -> None:
        standing = replace(person, floor=self._floor if person.floor is None else person.floor)
        self.walkers.append(_Walker(self._engine, standing, self._chance, since))


class _Walker:
    """A person in the world, on their path; `body` is the number of their capsule."""

    def __init__(self, engine: Engine, person: Person, chance: RandomSource, since: float) -> None:
        self._since = since
        self._walk = WalkSchedule(person, chance)
        self._place = (0.0, 0.0)
        self._middle = (person.floor or 0.0) + person.height / 2.0
        self._radius = person.radius
        self._half = (person.height - 2.0 * person.radius) / 2.0
        self._capsule = engine.add_person(person.height, person.radius)
        self.body = self._capsule.number
        self.update(since)

    def update(self, time: float) -> None:
        x, y = self._place = self._walk.position(time - self._since)
        self._capsule.move((x, y, self._middle))

    def figure(self) -> PersonFigure:
        """Locate the person."""
        height = 2.0 * (self._half + self._radius)
        return PersonFigure(*self._place, self._middle - height / 2.0, height, self._radius)

    def section(self, height: float) -> Disc | None:
        """Cut the capsule with a level plane; None if the plane does not meet it."""
        beyond = max(0.0, abs(height - self._middle) - self._half)
        if beyond >= self._radius:
            return None
        return Disc(*self._place, sqrt(self._radius**2 - beyond**2))

    def distance(self, robot: int, within: float) -> float:
        """Measure the distance from the robot."""
        return self._capsule.distance(robot, within)
