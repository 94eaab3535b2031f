"""Things that are gripped, carried and let go, by geometry alone.

What is gripped moves with the tool, and so does what lies on it; what is let go falls at once on what is
under it, and stays.  Everything is upright.
Not modelled: friction, so nothing slips; that closing fingers shift or turn what they grip; things and
links that meet, but for what is held and pressed on a surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Final, NamedTuple

from aeros.sim.geometry import Pose, Vector3, to_frame, to_world, yaw_of, yaw_orientation

STIFFNESS: Final = 10_000.0
"""Force per depth by which what is pressed on a surface would be below it, N/m.  Chosen, not measured: the
4 N that skills press with are 0.4 mm, and force control closes its loop at 5 rad/s, far below its filter."""

PAD_HALF_LENGTH: Final = 0.009
"""Finger pads reach this far above and below the tool centre point, m."""


class Surface(NamedTuple):
    """A level surface: the pose of its middle, and its half edges, m."""

    centre: Pose
    half: tuple[float, float]

    def is_under(self, place: Vector3) -> bool:
        """Whether `place` is over it."""
        x, y, z = to_frame(self.centre, place)
        return abs(x) <= self.half[0] and abs(y) <= self.half[1] and z >= -_CONTACT_TOLERANCE


_CONTACT_TOLERANCE: Final = 0.005
"""How far below a surface a place still counts as over it, m: what is pressed on it is on it."""


def slab(x: float, y: float, top: float, length: float, width: float, yaw: float = 0.0) -> Surface:
    """The surface around (x, y) at height `top`, all in m."""
    return Surface(Pose((x, y, top), yaw_orientation(yaw)), (length / 2, width / 2))


@dataclass
class GraspableObject:
    """Something that fingers can close on.

    pose: of its own frame, in W.
    low, high: corners of the part to grip, in that frame, m.
    foot: from its frame's origin down to its underside, m.
    carries: its top as something others lie on, in its frame; None if nothing can.
    """

    pose: Pose
    low: Vector3
    high: Vector3
    underside_depth: float
    top_surface: Surface | None = None

    def width_between(self, tool: Pose) -> float | None:
        """How wide it is along the fingers' way, y of the tool; None where it is not between the pads.

        The box turned in the fingers is as wide as its corners are apart.
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
        """Go where the fingers take it, as far as it can; the force with which it is pressed down, N."""
        x, y, z = target.position
        lowest = support + self.underside_depth
        self.pose = Pose((x, y, max(z, lowest)), target.orientation)
        return STIFFNESS * max(0.0, lowest - z)

    def drop_onto_support(self, support: float) -> None:
        """Lie on what is under it."""
        x, y, _ = self.pose.position
        self.pose = Pose((x, y, support + self.underside_depth), self.pose.orientation)


@dataclass
class CylindricalObject(GraspableObject):
    """A thing that is round about its own z axis."""

    def _span(self, turn: float) -> float:
        return self.high[1] - self.low[1]


class ObjectSet:
    """All that can be gripped, and the fixed surfaces under it.  At the start everything falls."""

    def __init__(self, things: Sequence[GraspableObject], slabs: Sequence[Surface]) -> None:
        self._things = tuple(things)
        self._slabs = tuple(slabs)
        # What moves with the tool: where it is in the tool's frame, and its turn against it.
        self._held: dict[int, tuple[Vector3, float]] = {}
        self.load = 0.0
        for thing in self._things:
            thing.drop_onto_support(self._support(thing.pose.position, thing))

    def holds(self, thing: GraspableObject) -> bool:
        """Whether the fingers hold it, or what it lies on."""
        return any(self._things[number] is thing for number in self._held)

    def is_lifted(self, thing: GraspableObject) -> bool:
        """Whether `thing` touches nothing under it."""
        place = thing.pose.position
        return place[2] - thing.underside_depth > self._support(place, thing) + 1e-6

    @property
    def is_holding(self) -> bool:
        """Whether the fingers hold anything."""
        return bool(self._held)

    def width_between(self, tool: Pose) -> float | None:
        """The width of what is between the fingers, m."""
        widths = (thing.width_between(tool) for thing in self._things)
        return max((width for width in widths if width is not None), default=None)

    def grip(self, tool: Pose) -> None:
        """Hold what is between the fingers, with all that lies on it."""
        for number, thing in enumerate(self._things):
            if thing.width_between(tool) is None:
                continue
            for one in (number, *self._stacked_on(thing)):
                pose = self._things[one].pose
                turn = yaw_of(pose.orientation) - yaw_of(tool.orientation)
                self._held[one] = (to_frame(tool, pose.position), turn)

    def release(self) -> None:
        """Let everything fall that was held: what was gripped first, then what lies on it."""
        for number in list(self._held):
            del self._held[number]
            thing = self._things[number]
            thing.drop_onto_support(self._support(thing.pose.position, thing))

    def tick(self, tool: Pose, gap: float) -> None:
        """Move what is held with the tool, and measure how hard the hand presses down.

        gap: between the fingers, m.
        """
        tips = [to_world(tool, (0.0, side * gap / 2.0, 0.0)) for side in (-1.0, 1.0)]
        below = max(self._highest(self._slabs, tip) - tip[2] + PAD_HALF_LENGTH for tip in tips)
        self.load = STIFFNESS * max(0.0, below)
        yaw = yaw_of(tool.orientation)
        for number, (place, turn) in self._held.items():
            thing = self._things[number]
            wanted = Pose(to_world(tool, place), yaw_orientation(yaw + turn))
            self.load += thing.move_with_gripper(wanted, self._support(wanted.position, thing))

    def _stacked_on(self, thing: GraspableObject) -> list[int]:
        top = _top_surface(thing)
        return [
            number
            for number, other in enumerate(self._things)
            if top is not None and other is not thing and top.is_under(other.pose.position)
        ]

    def _support(self, place: Vector3, thing: GraspableObject) -> float:
        """The height of the highest surface under `thing`, which is at `place`, m."""
        tops = [_top_surface(other) for other in self._things if other is not thing and not self.holds(other)]
        return self._highest([*self._slabs, *(top for top in tops if top is not None)], place)

    @staticmethod
    def _highest(surfaces: Sequence[Surface], place: Vector3) -> float:
        return max((one.centre.position[2] for one in surfaces if one.is_under(place)), default=-inf)


def _top_surface(thing: GraspableObject) -> Surface | None:
    """Where others lie on it, in W."""
    if thing.top_surface is None:
        return None
    middle = to_world(thing.pose, thing.top_surface.centre.position)
    return Surface(Pose(middle, thing.pose.orientation), thing.top_surface.half)
