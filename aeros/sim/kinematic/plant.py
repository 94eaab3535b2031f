"""The kinematic plant: decided profiles followed exactly, 240 ticks a second, things moved by geometry.

Implements `aeros.runtime.ports.Plant`, the middle rung of the fidelity ladder: motions are the physics
plant's own, but no motor, friction or inertia is between a set point and where the robot is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.runtime.ports import Reading, Readings
from aeros.sim.clock import TICK
from aeros.sim.kinematic.robot import BLOCKING_FORCE, KinematicRobot
from aeros.sim.kinematic.scenes import SCENES, KinematicScene
from aeros.sim.randomness import RandomSource
from aeros.sim.robot.motions import BlockedError
from aeros.sim.ticked_plant import TickingPlant


class KinematicPlant(TickingPlant):
    """A scene in motion.  Its clock starts at 0."""

    def __init__(self, scene: KinematicScene, seed: int) -> None:
        self._scene = scene
        self._ticks = 0
        self._load = 0.0
        self._arm = KinematicRobot(scene.robot, scene.build(RandomSource(seed)))
        super().__init__(self._arm, scene.cameras)
        for camera in scene.initial_cameras:
            self._publish_detection(
                {name: Reading(value, 0.0) for name, value in self._detect(camera).items()}
            )

    def now(self) -> float:
        """Simulated seconds since the scene was laid out."""
        return self._ticks * TICK

    def observe(self) -> Readings:
        """Robot and scene now; what cameras saw, with the time they saw it."""
        time = self.now()
        values = {
            **self._fast_values(),
            "holding": self._robot.is_holding(),
            **self._scene.measure(self._state, time),
        }
        return {**self._seen, **{name: Reading(value, time) for name, value in values.items()}}

    def close(self) -> None:
        """Nothing is held."""

    # Inside.

    def _detect(self, camera: str) -> Mapping[str, Any]:
        return self._scene.detect(camera, self._state, self._robot.tool_command()[1], self.now())

    def _step_world(self) -> None:
        self._arm.tick()
        self._ticks += 1
        self._scene.tick()

    def _check_tracking(self) -> None:
        before, self._load = self._load, self._robot.wrist_vertical_force()
        if self._load > BLOCKING_FORCE and self._load > before:
            raise BlockedError(f"blocked: the hand presses down with {self._load:.0f} N")


def make_plant(scene_name: str, seed: int) -> KinematicPlant:
    """A plant with scene `scene_name`, laid out by `seed` as the physics plant lays it out.

    The same scene, seed and actions repeat bit for bit.  Raises KeyError for an unknown scene.
    """
    return KinematicPlant(SCENES[scene_name](), seed)
