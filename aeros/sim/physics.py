"""The physics plant: executes allowed actions on a PyBullet Panda, 240 ticks a second.

Implements `aeros.runtime.ports.Plant`.  It decides nothing: what it cannot do it refuses before any
motion, and when the monitor names a rule it stops within that tick.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from aeros.runtime.ports import Reading, Readings
from aeros.sim.motions import BlockedError
from aeros.sim.panda import Panda
from aeros.sim.randomness import Chance
from aeros.sim.robot import RobotState
from aeros.sim.scenes import SCENES
from aeros.sim.scenes.scene import Scene
from aeros.sim.ticking import TickingPlant
from aeros.sim.video import Recorder
from aeros.sim.world import World

_BLOCKED: Final = 0.05
"""Distance of a joint from its set point that no unhindered motion shows (0.005 seen at most), rad."""

_SETTLE_TICKS: Final = 120
"""Ticks a new world gets to come to rest before its clock starts."""


class PhysicsPlant(TickingPlant):
    """A scene in motion.  Its clock starts at 0 when everything put into the scene rests."""

    def __init__(self, scene: Scene, seed: int, recorder: Recorder | None = None) -> None:
        self._scene = scene
        self._recorder = recorder
        self._world = World()
        robot = Panda(self._world, scene.robot)
        scene.build(self._world, robot, Chance(seed))
        for _ in range(_SETTLE_TICKS):
            self._world.step()
        self._world.ticks = 0
        super().__init__(robot, scene.cameras)

    def now(self) -> float:
        """Simulated seconds since the scene came to rest."""
        return self._world.time

    def observe(self) -> Readings:
        """Robot sensors and scene now; what cameras saw, with the time they saw it."""
        time = self.now()
        values = {**self._fast_values(), "holding": self._robot.is_holding(), **self._scene.measure()}
        return {**self._seen, **{name: Reading(value, time) for name, value in values.items()}}

    def close(self) -> None:
        """Write the film, if one is taken, and end the simulation; safe to call twice."""
        if self._recorder is not None:
            self._recorder.close()
        self._world.close()

    # Inside.

    def _see(self, camera: str) -> Mapping[str, Any]:
        return self._scene.look(camera)

    def _pass_tick(self) -> None:
        self._world.step()
        self._scene.tick()
        if self._recorder is not None:
            self._recorder.tick(self._world)

    def _check_tracking(self) -> None:
        if self._robot.tracking_error(self._state) > _BLOCKED:
            raise BlockedError(f"blocked: the arm is held back at {_spell(self._state)}")


def _spell(state: RobotState) -> str:
    x, y, z = state.tool_position
    return f"({x:.3f}, {y:.3f}, {z:.3f}) m"


def make_plant(scene_name: str, seed: int, record: Path | None = None) -> PhysicsPlant:
    """A plant with scene `scene_name`, laid out by `seed`; `record` names a `.webp` film to write.

    The same scene, seed and actions repeat bit for bit.  Raises KeyError for an unknown scene.
    """
    scene = SCENES[scene_name]()
    recorder = None if record is None else Recorder(record, scene.view)
    return PhysicsPlant(scene, seed, recorder)
