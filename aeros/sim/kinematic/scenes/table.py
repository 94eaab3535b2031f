"""A table to clean, without physics: a cell is wiped where the held sponge is pressed on it.

Not modelled: what the arm hides from the camera, errors of a picture's inspection.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.detected_object import Sight
from aeros.sim.geometry import yaw_of
from aeros.sim.kinematic.objects import Round, Thing, Things, slab
from aeros.sim.kinematic.scenes.bare import TABLE
from aeros.sim.layouts.dirt import DirtMap
from aeros.sim.layouts.table import (
    AREA,
    BIN,
    BIN_INNER,
    CAMERAS,
    CAN,
    CUBE,
    PRESSING,
    SPONGE,
    WIPED,
    known_of_table,
    lay_table,
    seen_on_table,
)
from aeros.sim.randomness import Chance
from aeros.sim.robot.robot import RobotOptions, RobotState


class Table:
    """The table.  Fingers close on the sponge's block (models/sponge.urdf)."""

    robot = RobotOptions()
    cameras = CAMERAS
    watching: tuple[str, ...] = ("overhead",)

    def lay(self, chance: Chance) -> Things:
        """The sponge at its rest and the clutter, by chance; table and bin are fixed."""
        laid = lay_table(chance)
        self._rest = laid.rest
        self._dirt = DirtMap(*AREA)
        self._sponge = Thing(laid.sponge, (-0.025, -0.020, 0.019), (0.025, 0.020, 0.049), SPONGE[2] / 2)
        half, (radius, height) = CUBE / 2, CAN
        self._clutter = (
            Thing(laid.cube, (-half, -half, -half), (half, half, half), half),
            Round(laid.can, (-radius, -radius, -height / 2), (radius, radius, height / 2), height / 2),
        )
        floor = slab(*BIN, *BIN_INNER[:2])
        self._things = Things((self._sponge, *self._clutter), (TABLE, floor))
        return self._things

    def tick(self) -> None:
        """Wipe the cells under the pressed sponge."""
        if self._things.holds(self._sponge) and self._things.load > PRESSING:
            self._dirt.wipe(self._sponge.pose, SPONGE)

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """See `known_of_table`."""
        return known_of_table(self._rest, self._dirt.wiped_fraction)

    def look(self, camera: str, state: RobotState, yaw: float, time: float) -> Mapping[str, Any]:
        """What lies on the table; by `mast`, whether it is clean and nothing but the sponge, at its rest."""
        seen = self._seen()
        if camera == "overhead":
            return seen
        return {"table_verified": self._dirt.wiped_fraction >= WIPED and seen["table_organized"]}

    def _seen(self) -> dict[str, Any]:
        """What lies there, and is not in the hand."""
        lying = [thing for thing in self._clutter if not self._things.holds(thing)]
        sponge = None if self._things.holds(self._sponge) else _sight(self._sponge)
        return seen_on_table(self._rest, sponge, [_sight(thing) for thing in lying])


def _sight(thing: Thing) -> Sight:
    """As it is."""
    return Sight(thing.pose.position, None, yaw_of(thing.pose.orientation))
