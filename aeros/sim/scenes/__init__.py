"""Scenes that a physics plant can be built with, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.sim.scenes.bare import BareScene
from aeros.sim.scenes.dumpling_bench import DumplingBenchScene
from aeros.sim.scenes.fetch import FetchScene
from aeros.sim.scenes.scene import Scene
from aeros.sim.scenes.table import TableScene

SCENES: Final[dict[str, Callable[[], Scene]]] = {
    "bare": BareScene,
    "table": TableScene,
    "fetch": FetchScene,
    "dumpling_bench": DumplingBenchScene,
}
"""Scene constructors by name."""
