"""The plant of a run: scene extras, viewers, and the choice between this process and another."""

from __future__ import annotations

import argparse
import secrets
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from aeros.agent.errors import AgentError
from aeros.agent.identity import lock_folder
from aeros.agent.planning.routing import RoutedTask
from aeros.cli.arguments import print_warning
from aeros.exit_codes import Exit
from aeros.files import hold_temporary_folder, temporary_root
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import Plant
from aeros.session.plant_factory import (
    PHYSICS_PLANTS,
    PLANTS,
    connect_plant,
    draw_scene,
    load_faults,
    load_people,
    load_run_scene,
    open_plant,
    open_recorder,
    open_viewer,
    require_new_film,
    require_plant,
)
from aeros.session.scene_files import module_of
from aeros.session.setup import AUDIT, create_output_folder
from aeros.sim.film_file import FILE as POSES
from aeros.sim.hosting.host import HostLog, PlantHost
from aeros.spec.model.variables import measured_by_site

if TYPE_CHECKING:
    from aeros.sim.engine.people import Person
    from aeros.sim.faults.injector import FaultEvent
    from aeros.sim.faults.model import Fault
    from aeros.sim.physics import Viewer
    from aeros.spec.model.ecm import Task
    from aeros.spec.model.scene import Scene


class SceneExtras(NamedTuple):
    """The scene of a run, simulated people and faults.

    Attributes:
        people: Simulated people.
        faults: Faults to inject.
        scene: The scene; None if the plant has none, or another process loads it.
        drawn: Factors and changes that were drawn for the scene, by name; empty unless it is randomised.
    """

    people: Sequence[Person]
    faults: Sequence[Fault]
    scene: Scene | None
    drawn: Mapping[str, object] = MappingProxyType({})


@dataclass(frozen=True)
class PlantSetup:
    """Everything that a run needs to open its plant.

    Attributes:
        arguments: Parsed options of the command.
        configuration: The site and the active modules.
        task: The task, and the module that provides it.
        extras: The scene, its people and faults.
        viewers: Viewers that show the run.
        out: The run's output folder.
    """

    arguments: argparse.Namespace
    configuration: Configuration
    task: RoutedTask
    extras: SceneExtras
    viewers: Sequence[Viewer]
    out: Path


def is_remote(arguments: argparse.Namespace) -> bool:
    """Check the options for a plant in another process.

    Args:
        arguments: Parsed options of `aeros run`.

    Returns:
        True if another process serves the plant.
    """
    return arguments.plant_at is not None and not arguments.serve_plant


def load_scene_extras(
    arguments: argparse.Namespace, configuration: Configuration, tasks: Sequence[Task]
) -> SceneExtras:
    """Load scene, people and faults.

    Args:
        arguments: Parsed options of `aeros run`.
        configuration: Modules and site of the run.
        tasks: The tasks of the instruction, in order.

    Returns:
        The extras; empty if another process serves the plant, which loads them itself.
    """
    people = load_people(arguments.plant, arguments.people)
    if is_remote(arguments):
        return SceneExtras((), (), None)
    require_plant(arguments.plant)
    scene = load_run_scene(arguments.plant, arguments.scene, configuration, tasks, arguments.seed)
    if scene is not None and arguments.plant in PLANTS:
        _warn_of_unmeasured(configuration, tasks, scene)
    drawn: Mapping[str, object] = {}
    if arguments.randomise:
        scene, drawn = draw_scene(arguments.plant, scene, arguments.seed)
    faults = load_faults(arguments.plant, arguments.faults, configuration, scene)
    return SceneExtras(people, faults, scene, drawn)


def _warn_of_unmeasured(configuration: Configuration, tasks: Sequence[Task], scene: Scene) -> None:
    """Print a warning of variables of the tasks' modules that nothing in the scene measures."""
    parts = (part for task in tasks for part in task.rehearsals(module_of(configuration, task)))
    owners = {module for module, _ in parts}
    state = [one.state for module, one in configuration.modules.items() if module in owners]
    missing = [f"`{name}`" for each in state for name in scene.unmeasured(measured_by_site(each))]
    if missing:
        print_warning(f"the scene has no place or instrument for {', '.join(missing)}: unknown in this run")


@contextmanager
def open_outputs(arguments: argparse.Namespace, task: str) -> Iterator[tuple[Path, Sequence[Viewer]]]:
    """Open output folder and viewers before anything moves.

    Args:
        arguments: Parsed options of `aeros run`.
        task: Id of the task.

    Yields:
        The output folder, and window and recorder of poses as far as requested.
    """
    with ExitStack() as stack:
        spectators: list[Viewer] = []
        if is_remote(arguments):
            yield arguments.out, spectators
            return
        if arguments.view:
            spectators.append(open_viewer(arguments.plant))
            stack.callback(spectators[0].close)
        out = arguments.out
        if not arguments.serve_plant:
            given = arguments.out if arguments.out is not None and arguments.out.exists() else None
            out = create_output_folder(arguments.out, task)
            stack.push(lambda kind, _error, _trace: None if kind is None else _remove_unused(out, given))
        if arguments.film is not None:
            require_new_film(arguments.plant, arguments.film)
        if arguments.plant in PHYSICS_PLANTS and not arguments.no_film:
            spectators.append(open_recorder(arguments.plant, out / POSES))
        yield out, spectators


def _remove_unused(out: Path, given: Path | None) -> None:
    """Remove what a run has left that was refused before it had a record; keep a folder that was there."""
    if not (out / AUDIT).exists():
        with suppress(OSError):
            (out / POSES).unlink(missing_ok=True)
            if given is None:
                out.rmdir()


def lost_poses(viewers: Sequence[Viewer]) -> int:
    """Count the lines of the recording that could not be written.

    Args:
        viewers: Viewers that show the run.

    Returns:
        The number of lines; 0 without a recorder.
    """
    return sum(int(getattr(one, "lost", 0)) for one in viewers)


def open_run_plant(
    staged: PlantSetup, on_fault: Callable[[FaultEvent], None]
) -> AbstractContextManager[Plant]:
    """Open the plant in this process, or connect to the one served at `plant_at`.

    Args:
        staged: Setup of the plant.
        on_fault: Called with each injected fault.

    Returns:
        A context manager of the plant.
    """
    arguments, (people, faults, scene, _) = staged.arguments, staged.extras
    if is_remote(arguments):
        return closing(connect_plant(arguments.plant_at))
    return open_plant(
        arguments.plant,
        staged.configuration,
        staged.task.task,
        arguments.seed,
        staged.viewers,
        people,
        faults,
        on_fault,
        scene,
        ideal_sensors=arguments.ideal_sensors,
    )


def plant_socket() -> Path:
    """Choose the path of a socket for a plant that is served; the server creates its folder.

    Returns:
        A path that no other process uses.
    """
    root = temporary_root() or Path(tempfile.gettempdir())
    return root / f"plant-{secrets.token_hex(8)}" / "plant.sock"


def serve_plant(staged: PlantSetup) -> Exit:
    """Serve the plant to an agent in another process; end at once if another process serves it already.

    Args:
        staged: Setup of the plant.

    Returns:
        The exit code.
    """
    arguments = staged.arguments
    log = HostLog(staged.out / "plant.jsonl")
    with (
        suppress(AgentError),
        lock_folder(arguments.state / "plant", arguments.instruction),
        open_run_plant(staged, lambda one: log(one._asdict())) as plant,
        hold_temporary_folder(arguments.plant_at.parent),
    ):
        PlantHost(plant, log).serve(arguments.plant_at)
    return Exit.SUCCESS
