"""A film of a run: pictures at even steps of simulated time, written as animated WebP."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from PIL import Image as Picture

from aeros.sim.geometry import Camera
from aeros.sim.world import World

FRAMES_MAX: Final = 90
"""Pictures kept; when there are more every second one goes and the step doubles."""


class Recorder:
    """Takes a picture every `period` simulated seconds and writes the film on `close`."""

    def __init__(self, path: Path, camera: Camera, period: float = 0.75) -> None:
        self._path = path
        self._camera = camera
        self._period = period
        self._next = 0.0
        self._frames: list[Picture.Image] = []

    def tick(self, world: World) -> None:
        """Take a picture of `world` when its time has come."""
        if world.time < self._next:
            return
        self._frames.append(Picture.fromarray(world.render(self._camera).rgb))
        if len(self._frames) > FRAMES_MAX:
            self._frames = self._frames[::2]
            self._period *= 2.0
        self._next = world.time + self._period

    def close(self) -> None:
        """Write the film; frames show for an eighth of a second, so it plays about four times as fast."""
        if self._frames:
            first, *rest = self._frames
            first.save(self._path, save_all=True, append_images=rest, duration=125, loop=0)
            self._frames = []
