"""Scenes of tasks: from the folder of the task's module, from AEROS, or from another module.

The scenes of several tasks are combined into one cell, and so are those of the tasks that one composes.

A scene is no code of the robot, so it is no part of a module's certificate: no proof speaks of it, and
another position of a crate in a simulator asks for no new certificate. It is part of the module's bundle.
The digest of a scene's files is part of the scene, so a report can name what a run took place in. The
registry keeps the files with the module.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from aeros.runtime.gate.configuration import Configuration
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.scene import Scene
from aeros.spec.model.variables import members_of
from aeros.spec.scenes.cells import load_cell
from aeros.spec.scenes.load import add_scene, known_scenes, load_scene, require_robot


def module_folders(configuration: Configuration, module: str | None) -> Sequence[str]:
    """List the folders in which scenes are looked for.

    Args:
        configuration: site and active modules.
        module: the module whose folder comes first; None for no preference.

    Returns:
        The folders of the modules.
    """
    ordered = sorted(configuration.modules.items(), key=lambda one: one[0] != module)
    return [ecm.folder for _, ecm in ordered]


def scene_of_task(configuration: Configuration, task: Task, extra: str | None = None) -> Scene:
    """Load the scene of a task.

    Args:
        configuration: site and active modules.
        task: the task.
        extra: a scene file whose things are added, or its name; None for none.

    Returns:
        The scene.

    Raises:
        UserError: the task names no scene or one that does not exist, a file has problems, or both scenes
            have the same names.
    """
    return scene_of_tasks(configuration, [task], extra)


def scene_of_tasks(configuration: Configuration, tasks: Sequence[Task], extra: str | None = None) -> Scene:
    """Load the scenes of several tasks, combined into one cell.

    Args:
        configuration: site and active modules.
        tasks: the tasks, at least one; the robot starts where the first one's scene has it.
        extra: as in `scene_of_task`; it is added to the whole.

    Returns:
        The scene of all.

    Raises:
        UserError: as in `scene_of_task`, or the scenes cannot be combined.
    """
    parts = [part for task in tasks for part in task.rehearsals(module_of(configuration, task))]
    folders = {module: module_folders(configuration, module) for module, _ in parts}
    scenes: list[tuple[str, str]] = []
    for module, task in parts:
        known = known_scenes(folders[module])
        if task.scene is None or task.scene not in known:
            headline = (
                f"the scene of `{task.id}` is `{task.scene}`, but there is only {', '.join(sorted(known))}"
            )
            help_ = ("add its file to the module's folder `scenes`", "or use `--plant symbolic`")
            raise UserError([Diagnostic("AE002", headline, help=help_)])
        scenes.append((module, task.scene))
    cameras, variables = _site_cameras(configuration), _state_variables(configuration)
    whole = load_cell(scenes, folders, cameras, variables)
    return whole if extra is None else add_scene(whole, extra, folders[parts[0][0]], cameras, variables)


def module_of(configuration: Configuration, task: Task) -> str:
    """Find the module of a task.

    Args:
        configuration: site and active modules.
        task: the task.

    Returns:
        The id of the module that provides it; the name of its scene if none does.
    """
    modules = configuration.modules.items()
    return next((id_ for id_, ecm in modules if _has(ecm, task)), task.scene or task.id)


def _has(module: Ecm, task: Task) -> bool:
    return any(one.span == task.span for one in module.tasks.values())


def scene_named(configuration: Configuration, name: str) -> Scene:
    """Load a scene by its name, whatever module has it.

    Args:
        configuration: site and active modules.
        name: its name, or the path of a file.

    Returns:
        The scene.

    Raises:
        UserError: there is no such file, or it has problems.
    """
    folders = module_folders(configuration, None)
    cameras, variables = _site_cameras(configuration), _state_variables(configuration)
    return require_robot(load_scene(name, folders, cameras, variables))


def scene_with(configuration: Configuration, tasks: Sequence[Task], name: str | None) -> Scene:
    """Load the scene of tasks, or another one.

    Args:
        configuration: site and active modules.
        tasks: the tasks.
        name: a scene, or the path of a file: one with a robot replaces that of the tasks, one without is
            added; None for none.

    Returns:
        The scene.

    Raises:
        UserError: as in `scene_of_tasks`; or there are no tasks, and the scene has no robot.
    """
    if name is not None:
        cameras, variables = _site_cameras(configuration), _state_variables(configuration)
        module = module_of(configuration, tasks[0]) if tasks else None
        found = load_scene(name, module_folders(configuration, module), cameras, variables)
        if found.robot is not None or not tasks:
            return require_robot(found)
    return scene_of_tasks(configuration, tasks, name)


def _site_cameras(configuration: Configuration) -> dict[str, Mapping[str, str]]:
    """Return for each module the site's names of cameras by the module's."""
    return {module: ecm.names.cameras for module, ecm in configuration.modules.items()}


def _state_variables(configuration: Configuration) -> dict[str, dict[str, tuple[str, ...]]]:
    """Return the members of each variable's enum, by module and short name; the site's by the empty name."""
    own = {module: members_of(ecm.state) for module, ecm in configuration.modules.items()}
    of_site = {name: one for name, one in configuration.site.state.items() if "." not in name}
    return {**own, "": members_of(of_site)}
