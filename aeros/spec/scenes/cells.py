"""The cell of one or several tasks: the scene of each, loaded and combined."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from aeros.spec.model.scene import Scene
from aeros.spec.scenes.combining import combine
from aeros.spec.scenes.load import known_scenes, load_scene, require_robot


def load_cell(
    scenes: Sequence[tuple[str, str]],
    folders: Mapping[str, Sequence[str | os.PathLike[str]]],
    cameras: Mapping[str, Mapping[str, str]] = MappingProxyType({}),
    variables: Mapping[str, Mapping[str, Sequence[str]]] | None = None,
) -> Scene:
    """Load the scenes of tasks and combine them.

    Args:
        scenes: module and scene of each task, the first task's first.
        folders: for each of these modules the folders of modules, its own first.
        cameras: as in `load_scene`.
        variables: as in `load_scene`.

    Returns:
        The cell; the robot starts where the first scene has it.

    Raises:
        UserError: there is no such scene, one has problems or no robot, or they cannot be combined.
    """
    found: dict[str, Scene] = {}
    files: set[Path] = set()
    for module, name in scenes:
        path = known_scenes(folders[module]).get(name, Path(name)).resolve()
        if path not in files:
            files.add(path)
            label = module if module not in found else f"{module}_{name}"
            found[label] = require_robot(load_scene(name, folders[module], cameras, variables))
    return combine(found)
