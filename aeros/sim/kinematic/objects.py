"""Objects that are gripped, carried and released, by geometry alone.

A gripped object moves with the tool, and so does what lies on it. A released object falls at once onto what
is under it and stays there. Everything is upright.
Not modelled: friction, so nothing slips; shift or turn of an object by closing fingers; collisions of
objects and links, except that a held object presses on a surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Final, NamedTuple

from aeros.sim.geometry import Pose, Vector3, to_frame, to_world, yaw_of, yaw_orientation

STIFFNESS: Final = 10_000.0
"""Contact stiffness: force per depth of a pressed object below the surface, N/m. Chosen, not measured: the
4 N that skills press with are 0.4 mm, and force control closes its loop at 5 rad/s, far below its
filter."""

PAD_HALF_LENGTH: Final = 0.009
"""Finger pads reach this far above and below the tool centre point, m."""


class Surface(NamedTuple):
    """A horizontal rectangle.

    Attributes:
        centre: pose of its middle, in W or in an object's frame.
        half: half of its length and width, m.
    """

    centre: Pose
    half: tuple[float, float]

    def is_under(self, place: Vector3) -> bool:
        """Compare a position with the rectangle.

        Args:
            place: in the frame that `centre` is in, m.

        Returns:
            True if it is over the rectangle, up to 5 mm below its height.
        """
        # It is horizontal, so the height above it is the same in both frames.
        if place[2] - self.centre.position[2] < -_CONTACT_TOLERANCE:
            return False
        x, y, _ = to_frame(self.centre, place)
        return abs(x) <= self.half[0] and abs(y) <= self.half[1]


_CONTACT_TOLERANCE: Final = 0.005
"""Depth below a surface up to which a position counts as over it, m: a pressed object is still on it."""


def slab(x: float, y: float, top: float, length: float, width: float, yaw: float = 0.0) -> Surface:
    """Make a horizontal rectangle around (x, y).

    Args:
        x: of its middle, m.
        y: of its middle, m.
        top: its height, m.
        length: along x at yaw 0, m.
        width: along y at yaw 0, m.
        yaw: rad.

    Returns:
        The surface, in the frame of the coordinates.
    """
    return Surface(Pose((x, y, top), yaw_orientation(yaw)), (length / 2, width / 2))


@dataclass
class GraspableObject:
    """An object that fingers can close on.

    Attributes:
        pose: of its own frame, in W.
        low: lowest corner of the part to grip, in that frame, m.
        high: highest corner of that part, m.
        underside_depth: from its frame's origin down to its underside, m.
        top_surface: its top as a support for others, in its frame; None if nothing can lie on it.
    """

    pose: Pose
    low: Vector3
    high: Vector3
    underside_depth: float
    top_surface: Surface | None = None

    def width_between(self, tool: Pose) -> float | None:
        """Measure the object between the fingers, along y of the tool.

        An object turned in the fingers is as wide as the extent of its corners.

        Args:
            tool: pose of the tool in W.

        Returns:
            The width, m; None if it is not between the pads.
        """
        x, y, z = to_frame(self.pose, tool.position)
        within = self.low[0] <= x <= self.high[0] and self.low[1] <= y <= self.high[1]
        if not within or not self.low[2] - PAD_HALF_LENGTH <= z <= self.high[2] + PAD_HALF_LENGTH:
            return None
        return self._span(yaw_of(tool.orientation) - yaw_of(self.pose.orientation))

    def _span(self, turn: float) -> float:
        ahead, aside, _ = to_frame(Pose((0.0, 0.0, 0.0), yaw_orientation(turn)), (1.0, 0.0, 0.0))
        length, width = self.high[0] - self.low[0], self.high[1] - self.low[1]
        return length * abs(aside) + width * abs(ahead)

    def move_with_gripper(self, target: Pose, support: float) -> float:
        """Move with the fingers, but not below the supporting surface.

        Args:
            target: pose in W that the fingers ask for.
            support: height of the surface under it in W, m.

        Returns:
            The force with which it is pressed down, N.
        """
        x, y, z = target.position
        lowest = support + self.underside_depth
        self.pose = Pose((x, y, max(z, lowest)), target.orientation)
        return STIFFNESS * max(0.0, lowest - z)

    def drop_onto_support(self, support: float) -> None:
        """Fall onto the surface below.

        Args:
            support: height of that surface in W, m.
        """
        x, y, _ = self.pose.position
        self.pose = Pose((x, y, support + self.underside_depth), self.pose.orientation)


@dataclass
class CylindricalObject(GraspableObject):
    """An object that is round about its own z axis."""

    def _span(self, turn: float) -> float:
        return self.high[1] - self.low[1]


class ObjectSet:
    """All graspable objects and the fixed surfaces under them.

    At the start every object falls onto the surface under it.

    Args:
        things: the objects.
        slabs: the fixed surfaces, in W.

    Attributes:
        load: force with which hand and held objects press down, N.
    """

    def __init__(self, things: Sequence[GraspableObject], slabs: Sequence[Surface]) -> None:
        self._things = tuple(things)
        self._slabs = tuple(slabs)
        # Held objects by index: position in the tool's frame, m, and yaw relative to the tool, rad.
        self._held: dict[int, tuple[Vector3, float]] = {}
        self.load = 0.0
        for thing in self._things:
            thing.drop_onto_support(self._support(thing.pose.position, thing))

    def holds(self, thing: GraspableObject) -> bool:
        """Check if an object is carried by the hand.

        Args:
            thing: one of the objects.

        Returns:
            True if the fingers hold it, or an object that it lies on.
        """
        return any(self._things[number] is thing for number in self._held)

    def is_lifted(self, thing: GraspableObject) -> bool:
        """Check if an object is off its support.

        Args:
            thing: one of the objects.

        Returns:
            True if it touches nothing under it.
        """
        place = thing.pose.position
        return place[2] - thing.underside_depth > self._support(place, thing) + 1e-6

    @property
    def is_holding(self) -> bool:
        """True if the fingers hold anything."""
        return bool(self._held)

    def width_between(self, tool: Pose) -> float | None:
        """Measure the widest object between the fingers.

        Args:
            tool: pose of the tool in W.

        Returns:
            Its width along y of the tool, m; None if there is none.
        """
        widths = (thing.width_between(tool) for thing in self._things)
        return max((width for width in widths if width is not None), default=None)

    def grip(self, tool: Pose) -> None:
        """Attach the objects between the fingers, and all that lies on them, to the tool.

        Args:
            tool: pose of the tool in W.
        """
        for number, thing in enumerate(self._things):
            if thing.width_between(tool) is None:
                continue
            for attached in (number, *self._stacked_on(thing)):
                pose = self._things[attached].pose
                turn = yaw_of(pose.orientation) - yaw_of(tool.orientation)
                self._held[attached] = (to_frame(tool, pose.position), turn)

    def release(self) -> None:
        """Drop all held objects: the gripped ones first, then those that lie on them."""
        for number in list(self._held):
            del self._held[number]
            thing = self._things[number]
            thing.drop_onto_support(self._support(thing.pose.position, thing))

    def tick(self, tool: Pose, gap: float) -> None:
        """Move held objects with the tool, and update `load`.

        Args:
            tool: pose of the tool in W.
            gap: between the fingers, m.
        """
        tips = [to_world(tool, (0.0, side * gap / 2.0, 0.0)) for side in (-1.0, 1.0)]
        below = max(self._highest(self._slabs, tip) - tip[2] + PAD_HALF_LENGTH for tip in tips)
        self.load = STIFFNESS * max(0.0, below)
        yaw = yaw_of(tool.orientation)
        for number, (place, turn) in self._held.items():
            thing = self._things[number]
            target = Pose(to_world(tool, place), yaw_orientation(yaw + turn))
            self.load += thing.move_with_gripper(target, self._support(target.position, thing))

    def _stacked_on(self, thing: GraspableObject) -> list[int]:
        top = _top_surface(thing)
        return [
            number
            for number, other in enumerate(self._things)
            if top is not None and other is not thing and top.is_under(other.pose.position)
        ]

    def _support(self, place: Vector3, thing: GraspableObject) -> float:
        """Return the height of the highest surface under `thing` at `place`, m."""
        tops = [_top_surface(other) for other in self._things if other is not thing and not self.holds(other)]
        return self._highest([*self._slabs, *(top for top in tops if top is not None)], place)

    @staticmethod
    def _highest(surfaces: Sequence[Surface], place: Vector3) -> float:
        return max(
            (surface.centre.position[2] for surface in surfaces if surface.is_under(place)), default=-inf
        )


def _top_surface(thing: GraspableObject) -> Surface | None:
    """Return the top surface of an object in W."""
    if thing.top_surface is None:
        return None
    middle = to_world(thing.pose, thing.top_surface.centre.position)
    return Surface(Pose(middle, thing.pose.orientation), thing.top_surface.half)
