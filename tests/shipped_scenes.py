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


@cache
def shipped_scene(name: str) -> Scene:
    """A scene by its name."""
    return load_scene(name, FOLDERS)


def overhead(name: str) -> Camera:
    """The camera over a scene's bench."""
    return fixed_camera(shipped_scene(name).cameras["overhead"])
