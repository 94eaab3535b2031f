"""A table to clean, without physics: a cell is wiped where the held sponge is pressed on it.

Not modelled: what the arm hides from the camera, errors of a picture's inspection.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.kinematic.scenes.bare import TABLE
from aeros.sim.kinematic.things import Round, Thing, Things, slab
from aeros.sim.layouts.dirt import DirtMap
from aeros.sim.layouts.table import (
    AREA,
    AT_REST,
    BIN,
    BIN_INNER,
    CAMERAS,
    CAN,
    CUBE,
    PRESSING,
    SPONGE,
    lay_table,
    measured_on_table,
)
from aeros.sim.randomness import Chance
from aeros.sim.robot import RobotOptions, RobotState


class Table:
    """The table.  Fingers close on the sponge's block (models/sponge.urdf)."""

    robot = RobotOptions()
    cameras = CAMERAS

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
        """See `measured_on_table`."""
        return measured_on_table(
            self._rest,
            self._sponge.pose,
            [thing.pose for thing in self._clutter],
            wiped=self._dirt.wiped_fraction,
            let_go=self._sponge.speed < AT_REST and not self._things.holds(self._sponge),
        )

    def look(self, camera: str, state: RobotState, yaw: float, time: float) -> Mapping[str, Any]:
        """Whether the area is clean, the sponge at its rest, and nothing else on the table."""
        now = self.measure(state, time)
        return {"table_verified": now["table_wiped"] and now["table_organized"]}
