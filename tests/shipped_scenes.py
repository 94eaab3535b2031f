"""The scenes of AEROS and of the shipped modules, by name."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Final

from aeros.sim.geometry import Camera
from aeros.sim.layouts.cameras import fixed_camera
from aeros.spec.model.scene import Scene
from aeros.spec.scenes.load import load_scene

SHIPPED: Final = ("bare", "dumpling_bench", "fetch", "table")

ECMS: Final = Path(__file__).parents[1] / "ecms"

FOLDERS: Final = tuple(sorted(path.parent for path in ECMS.glob("*/ecm.yaml")))
"""Folders of the shipped modules."""


CAMERAS: Final = {
    module: {"overhead": "table_top", "mast": "table_side"} for module in ("clean_table", "inspect_table")
}
"""The reference site's names of cameras by those of a module, where they differ."""


@cache
def shipped_scene(name: str) -> Scene:
    """A scene by its name, with the reference site's cameras."""
    return load_scene(name, FOLDERS, CAMERAS)


def overhead(name: str) -> Camera:
    """The camera over a scene's bench."""
    cameras = shipped_scene(name).cameras
    return fixed_camera(cameras["table_top" if name == "table" else "overhead"])
