"""The scenes a physics plant can be built with, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from aeros.sim.scenes.bare import Bare
from aeros.sim.scenes.dumpling_bench import DumplingBench
from aeros.sim.scenes.fetch import Fetch
from aeros.sim.scenes.scene import Scene
from aeros.sim.scenes.table import Table

SCENES: Final[dict[str, Callable[[], Scene]]] = {
    "bare": Bare,
    "table": Table,
    "fetch": Fetch,
    "dumpling_bench": DumplingBench,
}
"""Scene constructors by name."""
