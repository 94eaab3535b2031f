"""A table to clean, without physics: a cell is wiped where the held sponge is pressed on it.

Not modelled: occlusion by the arm; errors in inspecting a picture.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import yaw_of
from aeros.sim.kinematic.objects import CylindricalObject, GraspableObject, ObjectSet, slab
from aeros.sim.kinematic.scenes.bare import TABLE
from aeros.sim.layouts.table import (
    BIN,
    BIN_INNER,
    CAMERAS,
    CAN_SIZE,
    CUBE_EDGE,
    SPONGE_SIZE,
    WIPED_THRESHOLD,
    WIPING_AREA,
    WIPING_FORCE,
    DirtMap,
    sample_table_layout,
    table_detections,
    table_measurements,
)
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions, RobotState


class KinematicTableScene:
    """Scene of the table; fingers close on the sponge's block (models/sponge.urdf)."""

    robot = RobotOptions()
    cameras = CAMERAS
    initial_cameras: tuple[str, ...] = ("overhead",)

    def build(self, chance: RandomSource) -> ObjectSet:
        """Implement `KinematicScene.build`: sponge and clutter at random, table and bin fixed."""
        laid = sample_table_layout(chance)
        self._rest = laid.rest
        self._dirt = DirtMap(*WIPING_AREA)
        self._sponge = GraspableObject(
            laid.sponge, (-0.025, -0.020, 0.019), (0.025, 0.020, 0.049), SPONGE_SIZE[2] / 2
        )
        half, (radius, height) = CUBE_EDGE / 2, CAN_SIZE
        self._clutter = (
            GraspableObject(laid.cube, (-half, -half, -half), (half, half, half), half),
            CylindricalObject(
                laid.can, (-radius, -radius, -height / 2), (radius, radius, height / 2), height / 2
            ),
        )
        floor = slab(*BIN, *BIN_INNER[:2])
        self._things = ObjectSet((self._sponge, *self._clutter), (TABLE, floor))
        return self._things

    @property
    def holds_sponge(self) -> bool:
        """The truth: the hand holds the sponge."""
        return self._things.holds(self._sponge)

    @property
    def sponge_height(self) -> float:
        """The truth: height of the foam's middle in W, m."""
        return self._sponge.pose.position[2]

    def tick(self) -> None:
        """Implement `KinematicScene.tick`: wipe the cells under the pressed sponge."""
        if self._things.holds(self._sponge) and self._things.load > WIPING_FORCE:
            self._dirt.wipe(self._sponge.pose, SPONGE_SIZE)

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """Implement `KinematicScene.measure`; see `table_measurements`."""
        return table_measurements(self._rest, self._dirt.wiped_fraction)

    def detect(self, camera: str, state: RobotState, yaw: float, time: float) -> Mapping[str, Any]:
        """Implement `KinematicScene.detect` from true poses.

        `overhead` detects sponge and clutter; `mast` verifies that the table is clean, the sponge at its
        rest and nothing else there.
        """
        seen = self._visible_things()
        if camera == "overhead":
            return seen
        return {"table_verified": self._dirt.wiped_fraction >= WIPED_THRESHOLD and seen["table_organized"]}

    def _visible_things(self) -> dict[str, Any]:
        """Return detections of all objects that are not held."""
        lying = [thing for thing in self._clutter if not self._things.holds(thing)]
        sponge = None if self._things.holds(self._sponge) else _to_detection(self._sponge)
        return table_detections(self._rest, sponge, [_to_detection(thing) for thing in lying])


def _to_detection(thing: GraspableObject) -> DetectedObject:
    """Return an exact detection of an object."""
    return DetectedObject(thing.pose.position, None, yaw_of(thing.pose.orientation))
