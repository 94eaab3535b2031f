"""Scenes that a kinematic plant can be built with, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.sim.kinematic.scenes.bare import KinematicBareScene
from aeros.sim.kinematic.scenes.dumpling_bench import KinematicDumplingBench
from aeros.sim.kinematic.scenes.fetch import KinematicFetchScene
from aeros.sim.kinematic.scenes.scene import KinematicScene
from aeros.sim.kinematic.scenes.table import KinematicTableScene

__all__ = ["SCENES", "KinematicScene"]

SCENES: Final[dict[str, Callable[[], KinematicScene]]] = {
    "bare": KinematicBareScene,
    "table": KinematicTableScene,
    "fetch": KinematicFetchScene,
    "dumpling_bench": KinematicDumplingBench,
}
"""Scene constructors by name; the names are those of `aeros.sim.scenes`."""
