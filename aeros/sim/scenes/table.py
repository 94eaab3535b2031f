"""A table to clean, with physics: friction holds sponge and clutter, contact wipes, a picture verifies.

A cell of the dirt map is wiped in the tick in which the sponge's face is over it, nearer than 1.5 mm, and
presses on the table with more than 1 N. Dirt is painted where the map has it, so that cameras see it.
Not modelled: dirt that sticks or spreads, a soft sponge.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import dist
from typing import Any, Final

import numpy as np

from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Camera
from aeros.sim.layouts.table import (
    BIN,
    BIN_INNER,
    CAMERAS,
    CAN_SIZE,
    CUBE_EDGE,
    MAST_CAMERA,
    OVERHEAD_CAMERA,
    REST_TOLERANCE,
    SPONGE_SIZE,
    WIPED_THRESHOLD,
    WIPING_AREA,
    WIPING_FORCE,
    DirtMap,
    sample_table_layout,
    table_detections,
    table_measurements,
)
from aeros.sim.perception.detection import MIN_PIXELS
from aeros.sim.perception.inspection import inspect_table
from aeros.sim.perception.table_detection import detect_table
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotOptions
from aeros.sim.scenes.furniture import MODELS, add_open_box, add_table
from aeros.sim.scenes.scene import DetectionFilter, unfiltered

FOAM_FRICTION: Final = 0.3
RUBBER_FRICTION: Final = 1.0
"""Friction of the wet foam and of the grip block: with 0.6 on both the sponge creeps up in the fingers."""

SWIVEL_FRICTION: Final = 0.004
"""Dry friction of the sponge's swivel, N·m: the block stands up by itself, and 4 N lay the foam flat."""


CAN_ROLLING: Final = 0.001
"""Rolling resistance of the can, m: without any, one that fell over rolls off the table."""


class TableScene:
    """Scene of the table: dirty area, sponge, two pieces of clutter, a bin."""

    robot = RobotOptions()
    view = Camera(eye=(1.25, 0.75, 0.75), target=(0.42, -0.05, 0.05), field_of_view=45.0)
    pushable_objects: tuple[str, ...] = ("sponge", "cube", "can")
    cameras = CAMERAS
    initial_cameras: tuple[str, ...] = ("overhead",)

    def build(self, world: PhysicsWorld, robot: Panda, chance: RandomSource) -> None:
        """Implement `Scene.build`: sponge and clutter at random, table and bin fixed."""
        self._world = world
        self._table = add_table(world)
        self._dirt = DirtMap(*WIPING_AREA)
        self._picture = world.bodies.add_textured_rectangle(*WIPING_AREA, _DIRT_HEIGHT)
        self._paint()
        add_open_box(world, BIN_INNER, BIN)
        laid = sample_table_layout(chance)
        self._rest = laid.rest
        self._sponge = world.bodies.add_urdf(str(MODELS / "sponge.urdf"), *laid.sponge)
        world.bodies.set_friction(self._sponge, -1, FOAM_FRICTION)
        world.bodies.set_friction(self._sponge, _GRIP_BLOCK_LINK, RUBBER_FRICTION)
        world.bodies.set_joint_friction(self._sponge, _GRIP_BLOCK_LINK, SWIVEL_FRICTION)
        blue, green = (0.20, 0.35, 0.80, 1.0), (0.25, 0.60, 0.30, 1.0)
        cube = world.bodies.add_box((CUBE_EDGE, CUBE_EDGE, CUBE_EDGE), *laid.cube, mass=0.08, colour=blue)
        can = world.bodies.add_cylinder(*CAN_SIZE, *laid.can, mass=0.08, colour=green)
        world.bodies.set_rolling_resistance(can, CAN_ROLLING)
        self._clutter = (cube, can)

    def tick(self) -> None:
        """Implement `Scene.tick`: wipe the cells under the pressed sponge."""
        if self._world.contact_force(self._sponge, self._table) > WIPING_FORCE:
            before = self._dirt.wiped_fraction
            self._dirt.wipe(self._world.pose(self._sponge), SPONGE_SIZE)
            if self._dirt.wiped_fraction != before:
                self._paint()

    def measure(self) -> Mapping[str, Any]:
        """Implement `Scene.measure`; see `table_measurements`."""
        return table_measurements(self._rest, self._dirt.wiped_fraction)

    def body(self, name: str) -> int:
        """Implement `Scene.body`."""
        cube, can = self._clutter
        return {"sponge": self._sponge, "cube": cube, "can": can}[name]

    def camera(self, name: str) -> Camera:
        """Implement `Scene.camera`: both are fixed."""
        return {"overhead": OVERHEAD_CAMERA, "mast": MAST_CAMERA}[name]

    def detect(self, camera: str, through: DetectionFilter = unfiltered) -> Mapping[str, Any]:
        """Implement `Scene.detect`.

        `overhead` detects sponge and clutter; see `table_detections`. `mast` verifies: the area is clean,
        the sponge is at its rest and nothing else is there; a picture that shows no sponge verifies
        nothing.
        """
        if camera == "overhead":
            view = detect_table(self._world.renderer.render(OVERHEAD_CAMERA), OVERHEAD_CAMERA)
            pieces = map(through, view.pieces)
            shown = [piece for piece in pieces if piece is not None]
            return table_detections(self._rest, through(view.sponge), shown)
        seen = inspect_table(self._world.renderer.render(MAST_CAMERA), MAST_CAMERA)
        sponge = through(None if seen.sponge is None else DetectedObject(seen.sponge))
        returned = sponge is not None and dist(sponge.position, self._rest) < REST_TOLERANCE
        return {
            "table_verified": returned
            and seen.clean_share >= WIPED_THRESHOLD
            and seen.other_pixels < MIN_PIXELS
        }

    def _paint(self) -> None:
        """Show the dirt to cameras."""
        self._world.renderer.paint(
            self._picture, np.where(self._dirt.wiped[:, :, None], _TABLE_COLOUR, _DIRT_COLOUR)
        )


_TABLE_COLOUR: Final = np.array([199, 179, 148], dtype=np.uint8)
"""The table's own colour."""

_DIRT_COLOUR: Final = np.array([90, 76, 64], dtype=np.uint8)

_DIRT_HEIGHT: Final = 0.0005
"""Height of the painted dirt over the table, m."""

_GRIP_BLOCK_LINK: Final = 0
"""Link of the grip block, and its joint, the swivel (models/sponge.urdf)."""
