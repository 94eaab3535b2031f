"""The scenes a kinematic plant can be built with, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.sim.kinematic.scenes.bare import Bare
from aeros.sim.kinematic.scenes.dumpling_bench import DumplingBench
from aeros.sim.kinematic.scenes.fetch import Fetch
from aeros.sim.kinematic.scenes.scene import KinematicScene
from aeros.sim.kinematic.scenes.table import Table

__all__ = ["SCENES", "KinematicScene"]

SCENES: Final[dict[str, Callable[[], KinematicScene]]] = {
    "bare": Bare,
    "table": Table,
    "fetch": Fetch,
    "dumpling_bench": DumplingBench,
}
"""Scene constructors by name; the names are those of `aeros.sim.scenes`."""
