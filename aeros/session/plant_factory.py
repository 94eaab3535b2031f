"""Open plants by name, with people, faults, bodies and videos; PyBullet is imported only for physics."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, get_args

from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import Plant
from aeros.sim.hosting.remote import RemotePlant
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.ecm import Task

if TYPE_CHECKING:
    from aeros.sim.bullet.bodies import SceneBody
    from aeros.sim.bullet.people import Person
    from aeros.sim.faults.faults_file import FaultContext
    from aeros.sim.faults.injector import FaultEvent
    from aeros.sim.faults.model import Fault
    from aeros.sim.physics import Viewer
    from aeros.sim.scenes.scene import Scene

_START_TIMEOUT_S: Final = 60.0
"""Time for a plant in another process to start: it proves its modules and builds its scene first."""

_LISTEN_TIMEOUT_S: Final = 1.0
"""Time from the creation of a socket until it accepts connections."""

_POLL_INTERVAL_S: Final = 0.02

PlantName = Literal["physics", "kinematic", "symbolic"]

PLANTS: Final[tuple[PlantName, ...]] = get_args(PlantName)


class PlantSetupError(Exception):
    """A plant or an output of it that cannot be opened; the message says why and what to do."""


def load_people(plant: str, name_or_path: str | None) -> tuple[Person, ...]:
    """Read the people file of a run.

    Args:
        plant: The plant's name.
        name_or_path: A file, or the name of one that comes with AEROS; None for no people.

    Returns:
        The simulated people; empty for None.

    Raises:
        UserError: The file is not a people file.
        PlantSetupError: The plant has no people.
    """
    if name_or_path is None:
        return ()
    if plant != "physics":
        raise PlantSetupError(f"`--people` needs the physics plant: the {plant} plant has no people")
    with _physics_import_errors():
        from aeros.sim.bullet.people_file import read_people
    return read_people(name_or_path)


def load_faults(
    plant: str, name_or_path: str | None, configuration: Configuration, task: Task
) -> Sequence[Fault]:
    """Read the faults file of a run.

    Args:
        plant: The plant's name.
        name_or_path: A file, or the name of one that comes with AEROS; None for no faults.
        configuration: The vocabulary and the skills that faults may name.
        task: The task; its scene has the objects and cameras that faults may name.

    Returns:
        The faults to inject; empty for None.

    Raises:
        UserError: The file is not a faults file, or names something that does not exist.
        PlantSetupError: The plant has no faults.
    """
    if name_or_path is None:
        return ()
    if plant != "physics":
        raise PlantSetupError(
            f"`--faults` needs `--plant physics`; on {plant}, failures are declared outcomes"
        )
    with _physics_import_errors():
        from aeros.sim.faults.faults_file import read_faults
    _, scene = _unbuilt_scene(task.scene)
    return read_faults(name_or_path, surroundings_of(configuration, scene))


def surroundings_of(configuration: Configuration, scene: Scene) -> FaultContext:
    """Collect the names that a faults file may use: state variables, skills, objects and cameras.

    Args:
        configuration: Site and modules; skills are named `MODULE.SKILL`.
        scene: The scene, which need not be built.

    Returns:
        The names by sort.
    """
    from aeros.sim.faults.faults_file import FaultContext

    skills = [f"{ecm.id}.{skill}" for ecm in configuration.modules.values() for skill in ecm.skills]
    return FaultContext(configuration.site.state, skills, scene.pushable_objects, scene.cameras)


def load_bodies(plant: str, name_or_path: str | None, task: Task, seed: int) -> Sequence[SceneBody]:
    """Read the scene file of a run: bodies besides the task's own objects.

    Args:
        plant: The plant's name.
        name_or_path: A file, or the name of one that comes with AEROS; None for none.
        task: The task; its scene is built once, to find bodies that overlap something.
        seed: Seed of the plant.

    Returns:
        The bodies; empty for None.

    Raises:
        UserError: The file is not a scene file, or a body overlaps something.
        PlantSetupError: The plant has no bodies.
    """
    if name_or_path is None:
        return ()
    if plant != "physics":
        raise PlantSetupError(f"`--scene` needs the physics plant: the {plant} plant has no obstacles")
    with _physics_import_errors():
        from aeros.sim.bullet.scene_file import read_bodies
        from aeros.sim.physics import make_plant
    known, _ = _unbuilt_scene(task.scene)
    bodies = read_bodies(name_or_path)
    make_plant(known, seed, bodies=bodies).close()
    return bodies


def open_video(plant: str, path: Path) -> Viewer:
    """Open a video of `plant`, written to `path` when it is closed.

    Args:
        plant: The plant's name.
        path: The file; its suffix selects the format.

    Returns:
        The recorder.

    Raises:
        PlantSetupError: The plant has no image, or the video cannot be written.
    """
    _require_physics("--video", plant)
    with _physics_import_errors():
        from aeros.sim.bullet.video import VideoError, VideoRecorder
    try:
        return VideoRecorder(path)
    except VideoError as refusal:
        raise PlantSetupError(f"{refusal}; give another file with --video") from refusal


def open_viewer(plant: str) -> Viewer:
    """Open a window that shows `plant`.

    Args:
        plant: The plant's name.

    Returns:
        The window.

    Raises:
        PlantSetupError: The plant has no image, or there is no display.
    """
    _require_physics("--view", plant)
    with _physics_import_errors():
        from aeros.sim.bullet.window import ViewerWindow, WindowError
    try:
        return ViewerWindow()
    except WindowError as refusal:
        raise PlantSetupError(f"--view: {refusal}; or use --video, which needs no display") from refusal


def _require_physics(option: str, plant: str) -> None:
    if plant != "physics":
        raise PlantSetupError(
            f"`{option}` needs the physics plant: the {plant} plant has no image; "
            "`--mcap` records measurements on any plant"
        )


@contextmanager
def open_plant(
    name: str,
    configuration: Configuration,
    task: Task,
    seed: int,
    spectators: Sequence[Viewer] = (),
    people: Sequence[Person] = (),
    faults: Sequence[Fault] = (),
    on_fault: Callable[[FaultEvent], None] | None = None,
    bodies: Sequence[SceneBody] = (),
) -> Iterator[Plant]:
    """Open the plant `name`, ready for `task`; it is closed however the block ends.

    Args:
        name: One of `PLANTS`.
        configuration: The vocabulary, and the outcomes that the symbolic plant draws from.
        task: Its scene and initial state.
        seed: Seed of all random numbers.
        spectators: Video recorder or window (physics).
        people: Simulated people (physics).
        faults: Faults to inject (physics).
        on_fault: Called with each event of `faults` as it happens; None to inject no fault.
        bodies: Further objects in the scene (physics).

    Yields:
        The plant.

    Raises:
        PlantSetupError: The extra is missing, there is no such scene, or the video cannot be written.
    """
    if name == "physics":
        plant = _build_physics(task.scene, seed, spectators, people, faults, on_fault, bodies)
    elif name == "kinematic":
        plant = _build_kinematic(task.scene, seed)
    else:
        plant = _build_symbolic(configuration, task, seed)
    try:
        yield plant
    finally:
        try:
            plant.close()
        except OSError as failure:
            raise PlantSetupError(f"the video cannot be written: {failure}") from failure


def connect_plant(path: Path) -> RemotePlant:
    """Connect to the plant that another process serves, and wait until it is there.

    Args:
        path: The Unix socket of that process.

    Returns:
        The plant's client.

    Raises:
        PlantSetupError: No process serves a plant there within 60 s.
    """
    latest = time.monotonic() + _START_TIMEOUT_S
    while True:
        try:
            return RemotePlant(path)
        except OSError as failure:
            if isinstance(failure, ConnectionRefusedError):
                # The socket exists but nobody listens: the process listens shortly, or it has ended.
                latest = min(latest, time.monotonic() + _LISTEN_TIMEOUT_S)
            if time.monotonic() >= latest:
                raise PlantSetupError(
                    f"no plant at `{path}` ({failure.strerror}); the simulated plant has ended, "
                    "so start the task again"
                ) from failure
        time.sleep(_POLL_INTERVAL_S)


def _build_symbolic(configuration: Configuration, task: Task, seed: int) -> Plant:
    from aeros.sim.symbolic.plant import SymbolicPlant

    return SymbolicPlant(configuration.site, configuration.modules, seed, to_doubles(task.initial))


def _build_kinematic(scene: str | None, seed: int) -> Plant:
    try:
        from aeros.sim.kinematic.plant import make_plant
        from aeros.sim.kinematic.scenes import SCENES
    except ImportError as error:
        raise PlantSetupError(
            f"the kinematic plant needs `pip install 'aeros[kinematic]'` ({error.name} is missing); "
            "or use `--plant symbolic`"
        ) from error
    return make_plant(_checked_scene(scene, SCENES), seed)


def _build_physics(
    scene: str | None,
    seed: int,
    spectators: Sequence[Viewer],
    people: Sequence[Person],
    faults: Sequence[Fault],
    on_fault: Callable[[FaultEvent], None] | None,
    bodies: Sequence[SceneBody],
) -> Plant:
    known_scene, _ = _unbuilt_scene(scene)
    from aeros.sim.faults.injector import FaultInjector
    from aeros.sim.physics import make_plant

    disturbance = None if on_fault is None else FaultInjector(faults, seed, on_fault)
    return make_plant(
        known_scene, seed, spectators=spectators, people=people, disturbance=disturbance, bodies=bodies
    )


def _unbuilt_scene(scene: str | None) -> tuple[str, Scene]:
    """Return the scene of a task: its name, and the scene before it is built."""
    with _physics_import_errors():
        from aeros.sim.scenes import SCENES
    known = _checked_scene(scene, SCENES)
    return known, SCENES[known]()


@contextmanager
def _physics_import_errors() -> Iterator[None]:
    try:
        yield
    except ImportError as error:
        raise PlantSetupError(
            f"the physics plant needs `pip install 'aeros[sim]'` ({error.name} is missing); "
            "or use `--plant kinematic` or `--plant symbolic`"
        ) from error


def _checked_scene(scene: str | None, scenes: Collection[str]) -> str:
    """Check that a plant has the scene.

    Raises:
        PlantSetupError: `scene` is not one of `scenes`.
    """
    if scene is None or scene not in scenes:
        raise PlantSetupError(
            f"the task's scene is `{scene}`, but there is only {', '.join(scenes)}; or use `--plant symbolic`"
        )
    return scene
