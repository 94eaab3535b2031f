"""A room for fetching, with physics: the can is found in rendered pictures and held by friction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.sim.bullet.panda import Panda
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.geometry import Camera
from aeros.sim.layouts.fetch import (
    CAMERAS,
    CAN_ROLLING_RESISTANCE,
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
from aeros.sim.perception.detection import detect_red_cylinder
from aeros.sim.randomness import RandomSource
from aeros.sim.scenes.scene import DetectionFilter, unfiltered


class FetchScene:
    """Scene of the room: two stands, a can and a decoy."""

    robot = ROBOT
    view = Camera(eye=(0.2, -2.3, 1.9), target=(1.1, -0.35, 0.4), field_of_view=50.0)
    pushable_objects: tuple[str, ...] = ("can", "decoy")
    cameras = CAMERAS
    initial_cameras: tuple[str, ...] = ("mast",)

    def build(self, world: PhysicsWorld, robot: Panda, chance: RandomSource) -> None:
        """Implement `Scene.build`: stands, can and decoy at random."""
        self._world = world
        self._robot = robot
        self._seen: LastDetection | None = None
        world.bodies.add_box((6.0, 6.0, 0.05), (1.0, 0.0, -0.025), colour=(0.75, 0.74, 0.70, 1.0))
        self._laid = laid = sample_room_layout(chance)
        pick, place = laid.stands
        world.bodies.add_box(STAND_SIZE, pick, colour=(0.78, 0.70, 0.58, 1.0))
        red, blue = (0.80, 0.10, 0.08, 1.0), (0.15, 0.30, 0.75, 1.0)
        self._decoy = world.bodies.add_box(DECOY_SIZE, laid.decoy, mass=0.1, colour=blue)
        self._can = world.bodies.add_cylinder(*CAN_SIZE, laid.can, mass=0.15, colour=red)
        world.bodies.set_rolling_resistance(self._can, CAN_ROLLING_RESISTANCE)
        world.bodies.add_box(STAND_SIZE, place, colour=(0.78, 0.70, 0.58, 1.0))

    def tick(self) -> None:
        """Implement `Scene.tick`: forget where the can was seen once it is held."""
        if self._seen is not None and self._robot.is_holding() and self._is_held():
            self._seen = None

    def measure(self) -> Mapping[str, Any]:
        """Implement `Scene.measure`; see `room_measurements`."""
        base = self._robot.read_sensors().base_position
        return room_measurements(self._laid, base, self._is_held(), self._seen, self._world.time)

    def body(self, name: str) -> int:
        """Implement `Scene.body`."""
        return {"can": self._can, "decoy": self._decoy}[name]

    def camera(self, name: str) -> Camera:
        """Implement `Scene.camera`: `mast` stands on the carriage, `hand` moves with the tool."""
        state = self._robot.read_sensors()
        return camera_at(name, state.base_position, state.tool_position, self._robot.tool_command()[1])

    def detect(self, camera: str, through: DetectionFilter = unfiltered) -> Mapping[str, Any]:
        """Implement `Scene.detect`: find the can by colour and depth in a picture of `mast` or `hand`."""
        eye = self.camera(camera)
        found = through(detect_red_cylinder(self._world.renderer.render(eye), eye, CAN_SIZE))
        self._seen = None if found is None else LastDetection(found.position, self._world.time)
        return camera_measurements(camera, found, self._laid.delivery)

    def _is_held(self) -> bool:
        """Return True if both fingers touch the can and nothing else does."""
        others = any(contact.body_b != self._robot.body for contact in self._world.contacts(self._can))
        return len(self._finger_links()) == 2 and not others

    def _finger_links(self) -> set[int]:
        """Return the finger links that touch the can."""
        touching = {contact.link_b for contact in self._world.contacts(self._can, self._robot.body)}
        return touching & set(self._robot.fingers)
