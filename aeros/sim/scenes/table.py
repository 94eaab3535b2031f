"""A table to clean: a dirty area, a sponge at its rest, two pieces of clutter beside the area, a bin.

A cell of the dirt map is wiped in the tick in which the sponge's face is over it, nearer than 1.5 mm,
and presses on the table with more than 1 N.  Not modelled: dirt that sticks or spreads, a soft sponge.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import dist, pi
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from aeros.sim.panda import Panda, RobotOptions
from aeros.sim.randomness import Chance
from aeros.sim.scenes.dirt import DirtMap
from aeros.sim.scenes.furniture import MODELS, add_open_box, add_table
from aeros.sim.scenes.scene import Through, as_it_is
from aeros.sim.world import Camera, Pose, Triple, World, turned, yaw_of

AREA: Final = ((0.35, -0.15), (0.65, 0.15))
"""Lowest and highest corner (x, y) of the area to wipe, m."""

SPONGE: Final = (0.10, 0.07, 0.03)
"""Edges of the sponge's foam, m (models/sponge.urdf)."""

FOAM_FRICTION: Final = 0.3
RUBBER_FRICTION: Final = 1.0
"""Friction of the wet foam and of the grip block: with 0.6 on both the sponge creeps up in the fingers."""

SWIVEL_FRICTION: Final = 0.004
"""Dry friction of the sponge's swivel, N·m: the block stands up by itself, and 4 N lay the foam flat."""

REST: Final = (0.45, 0.34)
"""Nominal middle of the sponge's rest, m."""

BIN: Final = (0.45, -0.50, 0.005)
"""Middle of the bin's floor, m."""

BIN_INNER: Final = (0.18, 0.16, 0.08)
"""Length, width and depth of the bin, m."""

CUBE: Final = 0.04
"""Edge of the first piece of clutter, m."""

CAN: Final = (0.02, 0.05)
"""Radius and height of the second piece of clutter, m."""

CLUTTER: Final = ((0.38, -0.255), (0.56, -0.255))
"""Nominal places of the pieces, m: beside the area, so that wiping may come first, and clear
of the bin by the width of the hand."""

SPREAD: Final = 0.03
"""Clutter and the sponge's rest are up to this far from their nominal places in x and in y, m."""

WIPED: Final = 0.95
"""Share of wiped cells from which the table counts as wiped."""

PRESSING: Final = 1.0
"""Force of the sponge on the table above which it wipes, N."""

AT_REST: Final = 0.01
"""Speed below which a thing rests, m/s."""


class Table:
    """The table.  Channels of chance: rest, clutter."""

    robot = RobotOptions()
    view = Camera(eye=(1.25, 0.75, 0.75), target=(0.42, -0.05, 0.05), field_of_view=45.0)
    things: tuple[str, ...] = ("sponge", "cube", "can")
    cameras: tuple[str, ...] = ()

    def build(self, world: World, robot: Panda, chance: Chance) -> None:
        """Place the sponge's rest, the sponge on it, and the clutter by chance; the bin is fixed."""
        self._world = world
        self._robot = robot
        self._table = add_table(world)
        self._dirt = DirtMap(*AREA)
        add_open_box(world, BIN_INNER, BIN)
        dx, dy, turn = (float(part) for part in chance.on("rest").uniform(-1.0, 1.0, 3))
        self._rest: Triple = (REST[0] + SPREAD * dx, REST[1] + SPREAD * dy, SPONGE[2] / 2)
        place = (*self._rest[:2], self._rest[2] + 0.001)
        self._sponge = world.add_urdf(str(MODELS / "sponge.urdf"), place, turned(0.1 * turn))
        world.set_friction(self._sponge, -1, FOAM_FRICTION)
        world.set_friction(self._sponge, _BLOCK, RUBBER_FRICTION)
        world.set_joint_friction(self._sponge, _BLOCK, SWIVEL_FRICTION)
        self._clutter = _lay_clutter(world, chance)

    def tick(self) -> None:
        """Wipe the cells under the pressed sponge."""
        if self._world.contact_force(self._sponge, self._table) > PRESSING:
            self._dirt.wipe(self._world.pose(self._sponge), SPONGE)

    def measure(self) -> Mapping[str, Any]:
        """Poses of sponge, clutter and bin, and the task's predicates.

        clutter_position and clutter_yaw are of the first piece outside the bin, absent when there is
        none.  A piece counts until it is in the bin, wherever else it is.
        """
        sponge = self._world.pose(self._sponge)
        loose = [pose for pose in map(self._world.pose, self._clutter) if not _in_bin(pose.position)]
        values: dict[str, Any] = {
            "sponge_position": sponge.position,
            "sponge_yaw": _half_turn(yaw_of(sponge.orientation)),
            "sponge_rest_position": self._rest,
            "bin_position": (BIN[0], BIN[1], BIN[2] + BIN_INNER[2]),
            "clutter_on_table": bool(loose),
            "wiping_area_clear": not any(_in_area(pose.position) for pose in loose),
            "wiped_fraction": self._dirt.wiped_fraction,
            "table_wiped": self._dirt.wiped_fraction >= WIPED,
            "table_organized": not loose and self._sponge_at_rest(sponge),
        }
        if loose:
            values["clutter_position"] = loose[0].position
            values["clutter_yaw"] = _quarter_turn(yaw_of(loose[0].orientation))
        return values

    def thing(self, name: str) -> int:
        """See `Scene`."""
        cube, can = self._clutter
        return {"sponge": self._sponge, "cube": cube, "can": can}[name]

    def look(self, camera: str, through: Through = as_it_is) -> Mapping[str, Any]:
        """There is no camera: poses are measured."""
        raise KeyError(camera)

    def _sponge_at_rest(self, sponge: Pose) -> bool:
        """The sponge lies within 30 mm of its rest, still and let go."""
        near = dist(sponge.position, self._rest) < 0.03
        still = self._world.speed(self._sponge) < AT_REST
        return near and still and not self._world.contacts(self._sponge, self._robot.body)


_BLOCK: Final = 0
"""Link of the grip block, and its joint, the swivel (models/sponge.urdf)."""


def _lay_clutter(world: World, chance: Chance) -> tuple[int, int]:
    """A cube and a can, upright, up to `SPREAD` from their nominal places."""
    draw = chance.on("clutter").uniform(-1.0, 1.0, 5)
    (x, y), (u, v) = CLUTTER
    blue, green = (0.20, 0.35, 0.80, 1.0), (0.25, 0.60, 0.30, 1.0)
    cube = world.add_box(
        (CUBE, CUBE, CUBE),
        (x + SPREAD * draw[0], y + SPREAD * draw[1], CUBE / 2 + 0.001),
        turned(0.5 * draw[2]),
        mass=0.08,
        colour=blue,
    )
    radius, height = CAN
    place = (u + SPREAD * draw[3], v + SPREAD * draw[4], height / 2 + 0.001)
    can = world.add_cylinder(radius, height, place, mass=0.08, colour=green)
    return cube, can


def _in_bin(place: Triple) -> bool:
    offset = np.abs(np.array(place[:2]) - np.array(BIN[:2]))
    within = bool((offset < np.array(BIN_INNER[:2]) / 2).all())
    return within and BIN[2] < place[2] < BIN[2] + BIN_INNER[2]


def _in_area(place: Triple) -> bool:
    """Whether a piece's middle is where sponge and fingers pass (60 mm around the area)."""
    at: NDArray[np.float64] = np.array(place[:2])
    low, high = np.array(AREA[0]) - 0.06, np.array(AREA[1]) + 0.06
    return bool((at > low).all() and (at < high).all())


def _half_turn(yaw: float) -> float:
    """The same heading of a box, in [-π/2, π/2)."""
    return (yaw + pi / 2) % pi - pi / 2


def _quarter_turn(yaw: float) -> float:
    """The same heading of a cube, in [-π/4, π/4)."""
    return (yaw + pi / 4) % (pi / 2) - pi / 4
