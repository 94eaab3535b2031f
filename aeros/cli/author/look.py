"""`aeros look`: run a module's perceivers once on a simulated scene, and print values beside the truth."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aeros.agent.errors import AgentError
from aeros.agent.instructions.understand import understand
from aeros.apps.look.looking import look
from aeros.apps.look.picture_files import save_colours, save_depth
from aeros.cli.arguments import add_command, existing_path, parse_seed, print_warning
from aeros.cli.author.look_report import as_json, text_lines
from aeros.cli.author.module_argument import add_module
from aeros.cli.module_settings import add_module_settings, module_configurations
from aeros.cli.terminal.streams import print_data, print_line
from aeros.exit_codes import Exit, UsageError
from aeros.files import make_folder
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.perception.open_perceiver import open_by_policy
from aeros.runtime.ports import CameraPicture, Plant
from aeros.runtime.registry.folder_modules import FolderModules
from aeros.runtime.registry.installed import InstalledModules
from aeros.session.plant_factory import PLANTS, open_scene, runnable_plants
from aeros.session.scene_files import scene_with
from aeros.session.setup import SETUP_ERRORS, open_isolated_skills
from aeros.spec.diagnostics.codes import Diagnostics, did_you_mean
from aeros.spec.diagnostics.render import escape_invisible
from aeros.spec.model.ecm import Ecm
from aeros.spec.model.scene import Scene
from aeros.spec.text.discovery import all_module_folders, module_folders

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]

_EXAMPLES: Final = """\
The perceivers run as in `aeros run`: in the same worker, on the pictures of the same cameras with the
errors that the site declares.  The module is proved first, but needs no `ecm.lock`.  Each camera that a
perceiver asks for takes one picture from where the robot starts.  `truth` is the simulator's, where the
scene defines it; no run knows it.  The exit code is 1 if a perceiver fails or is not called, or if a value
differs from the truth.

examples:
  aeros look ecms/clean_table
  aeros look ecms/clean_table --seed 7 --save pictures
  aeros look ecms/clean_table --camera overhead --plant kinematic
  aeros look ecms/clean_table --task clean_table region=left
  aeros look ecms/fetch_object --scene shelf_behind       a scene with a robot replaces the task's
  aeros look ecms/clean_table --ideal-sensors --format json
"""


def add_to(commands: Subparsers) -> None:
    """Add the command and its arguments.

    Args:
        commands: Subparsers of `aeros`.
    """
    parser = add_command(commands, "look", __doc__, _EXAMPLES)
    add_module(parser)
    parser.add_argument(
        "--task",
        nargs="+",
        metavar=("NAME", "KEY=VALUE"),
        help="the task whose scene is looked at, with values of its parameters (default: the first one)",
    )
    parser.add_argument(
        "--scene",
        metavar="FILE|NAME",
        help="extra objects, as for `aeros run`; a scene with a robot replaces the task's",
    )
    parser.add_argument(
        "--camera",
        action="append",
        metavar="NAME",
        help="take a new picture with this camera alone, by the module's name or the site's; may be repeated",
    )
    parser.add_argument("--seed", type=parse_seed, default=0, help="seed of all random numbers (default: 0)")
    with_pictures = [name for name in PLANTS if name != "symbolic"]
    best = next((name for name in runnable_plants() if name in with_pictures), with_pictures[0])
    parser.add_argument("--plant", choices=with_pictures, default=best, help=f"default: {best}")
    parser.add_argument(
        "--ideal-sensors", action="store_true", help="sensors without the errors that the site declares"
    )
    parser.add_argument(
        "--save", type=Path, metavar="FOLDER", help="write CAMERA.png and CAMERA-depth.png to this folder"
    )
    parser.add_argument("--site", type=existing_path, help="the site file (default: as for `aeros run`)")
    add_module_settings(parser)
    parser.add_argument(
        "--state", type=Path, default=Path(".aeros"), help="the robot's own folder (default: .aeros)"
    )
    parser.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    parser.set_defaults(command=_command)


@dataclass(frozen=True)
class _Asked:
    """Module, scene, parameters and cameras of one look.

    Attributes:
        module: the module.
        scene: the scene.
        stated: values (SI) of parameters of tasks, by full name.
        cameras: the site's names of the chosen cameras; None for all.
    """

    module: Ecm
    scene: Scene
    stated: dict[str, Any]
    cameras: list[str] | None


def _command(arguments: argparse.Namespace) -> Exit:
    diagnostics = Diagnostics()
    folders = module_folders(arguments.module, diagnostics)
    diagnostics.raise_if_errors()
    if len(folders) != 1:
        raise UsageError(f"`{arguments.module}` holds several modules; name one")
    folders = all_module_folders([arguments.module, *(arguments.ecms or ())], diagnostics)
    diagnostics.raise_if_errors()
    source = FolderModules(
        folders,
        arguments.site,
        registry := InstalledModules(arguments.state),
        needs_certificates=False,
        configurations=module_configurations(arguments),
    )
    try:
        loaded = source.load(registry.snapshot())
        configuration = loaded.configuration
        asked = _asked(arguments, configuration, folders[0])
        with (
            open_isolated_skills(configuration, print_warning) as workers,
            _open(arguments, configuration, asked.scene) as plant,
        ):
            found = look(
                configuration,
                asked.module.id,
                plant,
                open_by_policy(workers),
                cameras=asked.cameras,
                stated=asked.stated,
            )
    except (AgentError, *SETUP_ERRORS) as refusal:
        print(f"aeros: {refusal}", file=sys.stderr)
        return Exit.REJECTED
    saved = list(_save(arguments.save, found.pictures.values())) if arguments.save is not None else []
    title = f"{asked.module.id}: scene {asked.scene.name}, seed {arguments.seed}, plant {arguments.plant}"
    if arguments.format == "json":
        print_data(as_json(found, asked.module.id, asked.scene.name, saved))
    else:
        for line in (title, *text_lines(found), *saved):
            print_line(line)
    return Exit.SUCCESS if found.is_right else Exit.REJECTED


def _open(
    arguments: argparse.Namespace, configuration: Configuration, scene: Scene
) -> AbstractContextManager[Plant]:
    return open_scene(
        arguments.plant, configuration, scene, arguments.seed, ideal_sensors=arguments.ideal_sensors
    )


def _asked(arguments: argparse.Namespace, configuration: Configuration, folder: Path) -> _Asked:
    """Find module, scene, parameters and cameras.

    Raises:
        UsageError: the module perceives nothing, has no scene, or has no such camera.
        InstructionError: there is no such task, or it has no such parameter.
        UserError: a scene has problems.
    """
    modules = configuration.modules
    here = folder.resolve()
    module = next((one for one in modules.values() if Path(one.folder).resolve() == here), None)
    if module is None:
        raise UsageError(f"the operator of this robot does not let a run use `{folder}`")
    if not module.perceivers and not module.definitions:
        raise UsageError(f"`{module.id}` has neither a perceiver nor a definition: it sees nothing")
    named = next((one.id for one in module.tasks.values() if one.scene is not None), None)
    words = arguments.task or ([] if named is None else [f"{module.id}.{named}"])
    tasks, stated = [], {}
    if words:
        routed = understand(shlex.join(words), modules).first
        tasks, stated = [routed.task], routed.variables
    elif arguments.scene is None:
        raise UsageError(f"no task of `{module.id}` names a scene: give one with --scene")
    scene = scene_with(configuration, tasks, arguments.scene)
    cameras = None if arguments.camera is None else [_site_camera(module, one) for one in arguments.camera]
    return _Asked(module, scene, stated, cameras)


def _site_camera(module: Ecm, name: str) -> str:
    """Return the site's name of a camera that a perceiver of the module asks for.

    Raises:
        UsageError: none asks for it.
    """
    known = {
        one: asked.camera
        for perceiver in module.perceivers.values()
        for asked in perceiver.pictures
        for one in (asked.camera, asked.name)
    }
    if name in known:
        return known[name]
    near = did_you_mean(name, known)
    hint = f"did you mean `{near}`?" if near else f"they ask for {', '.join(known) or 'none'}"
    raise UsageError(f"no perceiver of `{module.id}` asks for a camera `{escape_invisible(name)}`; {hint}")


def _save(folder: Path, pictures: Collection[CameraPicture]) -> Iterator[str]:
    """Write the pictures; yield a line for each file."""
    make_folder(folder)
    for picture in pictures:
        path = folder / f"{picture.camera}.png"
        save_colours(picture, path)
        yield f"saved {path}"
        depth = save_depth(picture, folder / f"{picture.camera}-depth.png")
        if depth is not None:
            scale = f"white {depth.nearest:.3f} m, black {depth.farthest:.3f} m"
            yield f"saved {depth.path}: {scale}"
