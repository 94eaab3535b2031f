"""A room for fetching, without physics: a camera gives the can's true position if it is in the picture.

Not modelled: occlusion of the can, by the arm or anything else; detection errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.detected_object import DetectedObject
from aeros.sim.geometry import Pose, add, is_in_view, yaw_orientation
from aeros.sim.kinematic.objects import CylindricalObject, GraspableObject, ObjectSet, slab
from aeros.sim.layouts.fetch import (
    CAMERAS,
    CAN_SIZE,
    DECOY_SIZE,
    ROBOT,
    STAND_SIZE,
    LastDetection,
    camera_at,
    camera_measurements,
    room_measurements,
    sample_room_layout,
)
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.robot import RobotState


class KinematicFetchScene:
    """Scene of the room: two stands, a can and a decoy."""

    robot = ROBOT
    cameras = CAMERAS
    initial_cameras: tuple[str, ...] = ("mast",)

    def build(self, chance: RandomSource) -> ObjectSet:
        """Implement `KinematicScene.build`: stands, can and decoy at random."""
        self._laid = laid = sample_room_layout(chance)
        self._seen: LastDetection | None = None
        (radius, height), (x, y, z) = CAN_SIZE, (edge / 2 for edge in DECOY_SIZE)
        low, high = (-radius, -radius, -height / 2), (radius, radius, height / 2)
        self._can = CylindricalObject(Pose(laid.can, yaw_orientation(0.0)), low, high, height / 2)
        decoy = GraspableObject(Pose(laid.decoy, yaw_orientation(0.0)), (-x, -y, -z), (x, y, z), z)
        stands = [slab(stand[0], stand[1], STAND_SIZE[2], *STAND_SIZE[:2]) for stand in laid.stands]
        self._things = ObjectSet((self._can, decoy), (slab(1.0, 0.0, 0.0, 6.0, 6.0), *stands))
        return self._things

    def tick(self) -> None:
        """Implement `KinematicScene.tick`: forget where the can was seen once it is held."""
        if self._things.holds(self._can):
            self._seen = None

    def measure(self, state: RobotState, time: float) -> Mapping[str, Any]:
        """Implement `KinematicScene.measure`; see `room_measurements`."""
        held = self._things.holds(self._can) and self._things.is_lifted(self._can)
        return room_measurements(self._laid, state.base_position, held, self._seen, time)

    def detect(self, camera: str, state: RobotState, yaw: float, time: float) -> Mapping[str, Any]:
        """Implement `KinematicScene.detect`: the can's middle, if the middle of its top is in the picture."""
        middle = self._can.pose.position
        eye = camera_at(camera, state.base_position, state.tool_position, yaw)
        seen = is_in_view(eye, add(middle, (0.0, 0.0, CAN_SIZE[1] / 2)))
        self._seen = LastDetection(middle, time) if seen else None
        return camera_measurements(camera, DetectedObject(middle) if seen else None, self._laid.delivery)
