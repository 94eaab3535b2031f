"""A table to clean, in physics: friction holds sponge and clutter, contact wipes.

A cell of the dirt map is wiped in the tick in which the sponge's face is over it, nearer than 1.5 mm,
and presses on the table with more than 1 N.  Not modelled: dirt that sticks or spreads, a soft sponge.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from aeros.sim.geometry import Camera
from aeros.sim.layouts.dirt import DirtMap
from aeros.sim.layouts.table import (
    AREA,
    AT_REST,
    BIN,
    BIN_INNER,
    CAN,
    CUBE,
    PRESSING,
    SPONGE,
    lay_table,
    measured_on_table,
)
from aeros.sim.panda import Panda
from aeros.sim.randomness import Chance
from aeros.sim.robot import RobotOptions
from aeros.sim.scenes.furniture import MODELS, add_open_box, add_table
from aeros.sim.scenes.scene import Through, as_it_is
from aeros.sim.world import World

FOAM_FRICTION: Final = 0.3
RUBBER_FRICTION: Final = 1.0
"""Friction of the wet foam and of the grip block: with 0.6 on both the sponge creeps up in the fingers."""

SWIVEL_FRICTION: Final = 0.004
"""Dry friction of the sponge's swivel, N·m: the block stands up by itself, and 4 N lay the foam flat."""


class Table:
    """The table."""

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
        laid = lay_table(chance)
        self._rest = laid.rest
        self._sponge = world.add_urdf(str(MODELS / "sponge.urdf"), *laid.sponge)
        world.set_friction(self._sponge, -1, FOAM_FRICTION)
        world.set_friction(self._sponge, _BLOCK, RUBBER_FRICTION)
        world.set_joint_friction(self._sponge, _BLOCK, SWIVEL_FRICTION)
        blue, green = (0.20, 0.35, 0.80, 1.0), (0.25, 0.60, 0.30, 1.0)
        cube = world.add_box((CUBE, CUBE, CUBE), *laid.cube, mass=0.08, colour=blue)
        can = world.add_cylinder(*CAN, *laid.can, mass=0.08, colour=green)
        self._clutter = (cube, can)

    def tick(self) -> None:
        """Wipe the cells under the pressed sponge."""
        if self._world.contact_force(self._sponge, self._table) > PRESSING:
            self._dirt.wipe(self._world.pose(self._sponge), SPONGE)

    def measure(self) -> Mapping[str, Any]:
        """See `measured_on_table`."""
        still = self._world.speed(self._sponge) < AT_REST
        return measured_on_table(
            self._rest,
            self._world.pose(self._sponge),
            [self._world.pose(body) for body in self._clutter],
            wiped=self._dirt.wiped_fraction,
            let_go=still and not self._world.contacts(self._sponge, self._robot.body),
        )

    def thing(self, name: str) -> int:
        """See `Scene`."""
        cube, can = self._clutter
        return {"sponge": self._sponge, "cube": cube, "can": can}[name]

    def look(self, camera: str, through: Through = as_it_is) -> Mapping[str, Any]:
        """There is no camera: poses are measured."""
        raise KeyError(camera)


_BLOCK: Final = 0
"""Link of the grip block, and its joint, the swivel (models/sponge.urdf)."""
