"""The kinematic plant: decided profiles followed exactly, 240 ticks a second, things moved by geometry.

Implements `aeros.runtime.ports.Plant`, the middle rung of the fidelity ladder: motions are the physics
plant's own, but no motor, friction or inertia is between a set point and where the robot is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aeros.runtime.ports import Reading, Readings
from aeros.sim.clock import TICK
from aeros.sim.kinematic.robot import BLOCKED, KinematicRobot
from aeros.sim.kinematic.scenes import SCENES, KinematicScene
from aeros.sim.randomness import Chance
from aeros.sim.robot.motions import BlockedError
from aeros.sim.ticked_plant import TickingPlant


class KinematicPlant(TickingPlant):
    """A scene in motion.  Its clock starts at 0."""

    def __init__(self, scene: KinematicScene, seed: int) -> None:
        self._scene = scene
        self._ticks = 0
        self._load = 0.0
        self._arm = KinematicRobot(scene.robot, scene.lay(Chance(seed)))
        super().__init__(self._arm, scene.cameras)
        for camera in scene.watching:
            self._show({name: Reading(value, 0.0) for name, value in self._see(camera).items()})

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

    def _see(self, camera: str) -> Mapping[str, Any]:
        return self._scene.look(camera, self._state, self._robot.tool_command()[1], self.now())

    def _pass_tick(self) -> None:
        self._arm.tick()
        self._ticks += 1
        self._scene.tick()

    def _check_tracking(self) -> None:
        before, self._load = self._load, self._robot.wrist_load()
        if self._load > BLOCKED and self._load > before:
            raise BlockedError(f"blocked: the hand presses down with {self._load:.0f} N")


def make_plant(scene_name: str, seed: int) -> KinematicPlant:
    """A plant with scene `scene_name`, laid out by `seed` as the physics plant lays it out.

    The same scene, seed and actions repeat bit for bit.  Raises KeyError for an unknown scene.
    """
    return KinematicPlant(SCENES[scene_name](), seed)
