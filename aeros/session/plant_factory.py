"""Open plants by name, with people, faults, scenes and recordings; an engine is imported only for physics."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Final

from aeros.distribution import install_command
from aeros.files import make_folder
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.ports import Plant
from aeros.session.plant_provider import PlantProviderError, PlantRequest, open_provided_plant
from aeros.session.scene_files import scene_with
from aeros.session.sensor_models import SensorSetup, sensor_setup
from aeros.sim.hosting.remote import RemotePlant
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.ecm import Task
from aeros.spec.model.scene import Scene
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.sim.engine.people import Person
    from aeros.sim.faults.faults_file import FaultContext
    from aeros.sim.faults.injector import FaultEvent
    from aeros.sim.faults.model import Fault
    from aeros.sim.layouts.randomisation import RandomisedScene
    from aeros.sim.physics import Viewer

_START_TIMEOUT_S: Final = 60.0
"""Time for a plant in another process to start: it proves its modules and builds its scene first."""

_LISTEN_TIMEOUT_S: Final = 1.0
"""Time from the creation of a socket until it accepts connections."""

_POLL_INTERVAL_S: Final = 0.02

PLANTS: Final = ("physics", "mujoco", "kinematic", "symbolic")
"""Plants that come with AEROS."""

PHYSICS_PLANTS: Final = ("physics", "mujoco")
"""Plants with physics: `physics` on PyBullet, `mujoco` on MuJoCo; people, faults and obstacles need one."""


_PACKAGES: Final = {"physics": "pybullet", "mujoco": "mujoco", "kinematic": "numpy"}
"""The package that each plant needs; the symbolic one needs none."""


def runnable_plants() -> list[str]:
    """List the plants whose packages are installed.

    Returns:
        Their names, that of the plant nearest to a robot first; the symbolic one is always among them.
    """
    return [name for name in PLANTS if name not in _PACKAGES or find_spec(_PACKAGES[name]) is not None]


class PlantSetupError(Exception):
    """A plant or an output of it that cannot be opened; the message says why and what to do."""


def require_plant(name: str) -> None:
    """Check before a run has a record that the packages of its plant are installed.

    Args:
        name: The plant's name; one of another distribution is not checked.

    Raises:
        PlantSetupError: A package is missing.
    """
    package = _PACKAGES.get(name)
    if package is not None and find_spec(package) is None:
        raise _missing(name, package)


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
    if plant not in PHYSICS_PLANTS:
        raise PlantSetupError(f"`--people` needs the physics plant: the {plant} plant has no people")
    with _physics_import_errors(plant):
        from aeros.sim.engine.people_file import read_people
    return read_people(name_or_path)


def load_faults(
    plant: str, name_or_path: str | None, configuration: Configuration, scene: Scene | None
) -> Sequence[Fault]:
    """Read the faults file of a run.

    Args:
        plant: The plant's name.
        name_or_path: A file, or the name of one that comes with AEROS; None for no faults.
        configuration: The vocabulary and the skills that faults may name.
        scene: The scene, with the objects and cameras that faults may name; None on a plant without faults.

    Returns:
        The faults to inject; empty for None.

    Raises:
        UserError: The file is not a faults file, or names something that does not exist.
        PlantSetupError: The plant has no faults.
    """
    if name_or_path is None:
        return ()
    if plant not in PHYSICS_PLANTS or scene is None:
        raise PlantSetupError(
            f"`--faults` needs `--plant physics`; on {plant}, failures are declared outcomes"
        )
    with _physics_import_errors(plant):
        from aeros.sim.faults.faults_file import read_faults
    return read_faults(name_or_path, surroundings_of(configuration, scene))


def surroundings_of(configuration: Configuration, scene: Scene) -> FaultContext:
    """Collect the names that a faults file may use: state variables, skills, objects, cameras, scanners.

    Args:
        configuration: Site and modules; skills are named `MODULE.SKILL`.
        scene: The scene.

    Returns:
        The names by sort.
    """
    from aeros.sim.faults.faults_file import FaultContext, faults_in

    skills = [f"{ecm.id}.{skill}" for ecm in configuration.modules.values() for skill in ecm.skills]
    state = configuration.site.state
    measured = {name: one for name, one in state.items() if one.sensor is not None and "." not in one.sensor}
    files = {
        name: path for ecm in configuration.modules.values() for name, path in faults_in(ecm.folder).items()
    }
    area = configuration.site.area_scanners
    scanners = () if area is None else tuple(one.name for one in area.scanners)
    bodies = tuple(scene.bodies)
    return FaultContext(measured, skills, scene.movable, tuple(scene.cameras), scanners, files, bodies)


def load_run_scene(
    plant: str, extra: str | None, configuration: Configuration, tasks: Sequence[Task], seed: int
) -> Scene | None:
    """Load the scene of a run.

    Args:
        plant: The plant's name.
        extra: A scene file, or its name, that is added to the tasks', or replaces it if it has a robot; None
            for none.
        configuration: Site and modules, whose folders have scenes.
        tasks: The tasks, in order. A scene that is put together from several files is built once, to find
            bodies that overlap.
        seed: Seed of the plant.

    Returns:
        The scene of all; None on a plant without one.

    Raises:
        UserError: There is no such scene, a file is no scene file, a body overlaps another one, or the site's
            robot cannot be used.
        PlantSetupError: The plant has no obstacles.
    """
    if extra is not None and plant not in PHYSICS_PLANTS:
        raise PlantSetupError(f"`--scene` needs the physics plant: the {plant} plant has no obstacles")
    if plant == "symbolic" or (plant not in PLANTS and not _has_scene(tasks)):
        return None
    scene = scene_with(configuration, tasks, extra)
    if plant not in PLANTS:
        return scene
    _check_robot(configuration.site)
    if len(scene.parts) > 1:
        _build(plant, configuration.site, scene, seed, sensor_setup(configuration, ideal=True)).close()
    return scene


def _check_robot(site: Site) -> None:
    """Read the robot of a site, so that a run with an unusable one is refused before it has a record."""
    with suppress(ImportError):  # the plant names what is missing
        from aeros.sim.robot.robot_file import robot_of

        robot_of(site)


def draw_scene(plant: str, scene: Scene | None, seed: int) -> RandomisedScene:
    """Draw the properties for which a scene declares ranges.

    Args:
        plant: The plant's name.
        scene: The scene; None on a plant without one.
        seed: Seed of all random numbers.

    Returns:
        The scene, and what was drawn.

    Raises:
        PlantSetupError: The plant has no scene, or the scene declares no ranges.
    """
    if scene is None or plant not in PLANTS:
        raise PlantSetupError(f"`--randomise` draws properties of a scene: the {plant} plant has none")
    with _physics_import_errors(plant):
        from aeros.sim.layouts.randomisation import has_ranges, randomise_scene
    if not has_ranges(scene):
        raise PlantSetupError(
            f"the scene `{scene.name}` declares no ranges; add `randomise` to its bodies or to the scene "
            "(docs/reference/scene.md)"
        )
    return randomise_scene(scene, seed)


def open_recorder(plant: str, path: Path) -> Viewer:
    """Open a recording of the poses of `plant`, from which films are made.

    Args:
        plant: The plant's name.
        path: The file; lines are appended.

    Returns:
        The recorder.

    Raises:
        PlantSetupError: The file cannot be written.
    """
    with _physics_import_errors(plant):
        from aeros.sim.film.recorder import PoseRecorder
    try:
        return PoseRecorder(path)
    except OSError as failure:
        raise PlantSetupError(f"cannot write `{path}`: {failure.strerror}; use --no-film") from failure


def require_new_film(plant: str, path: Path) -> None:
    """Check before a run that its film can be written after it.

    Args:
        plant: The plant's name.
        path: The film's file.

    Raises:
        PlantSetupError: The plant has no image, or the file exists already or cannot be written.
    """
    if plant not in PHYSICS_PLANTS:
        raise _no_image("--film", plant)
    try:
        make_folder(path.parent)
        with TemporaryFile(dir=path.parent):
            pass
    except OSError as failure:
        raise PlantSetupError(
            f"cannot write film `{path}`: {failure.strerror}; give another file with --film"
        ) from failure
    if path.exists():
        raise PlantSetupError(f"`{path}` exists already; give another file with --film")


def open_viewer(plant: str) -> Viewer:
    """Open a window that shows `plant`.

    Args:
        plant: The plant's name.

    Returns:
        The window.

    Raises:
        PlantSetupError: The plant has no image, or there is no display.
    """
    if plant == "mujoco":
        raise PlantSetupError("`--view` needs the physics plant: a window shows PyBullet alone; use `--film`")
    if plant != "physics":
        raise _no_image("--view", plant)
    with _physics_import_errors(plant):
        from aeros.sim.bullet.window import ViewerWindow, WindowError
    try:
        return ViewerWindow()
    except WindowError as refusal:
        raise PlantSetupError(f"--view: {refusal}; or use --film, which needs no display") from refusal


def _no_image(option: str, plant: str) -> PlantSetupError:
    return PlantSetupError(
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
    scene: Scene | None = None,
    *,
    ideal_sensors: bool = False,
) -> Iterator[Plant]:
    """Open the plant `name`, ready for `task`; it is closed however the block ends.

    Args:
        name: One of `PLANTS`, or the plant of another distribution.
        configuration: The vocabulary, and the outcomes that the symbolic plant draws from.
        task: Its scene and initial state.
        seed: Seed of all random numbers.
        spectators: Recorder of poses or window (physics).
        people: Simulated people (physics).
        faults: Faults to inject (physics).
        on_fault: Called with each event of `faults` as it happens; None to inject no fault.
        scene: The scene; None for that of the task.
        ideal_sensors: Sensors without the errors that the site declares (all but symbolic).

    Yields:
        The plant.

    Raises:
        PlantSetupError: The extra or the plant is missing, or a recording cannot be completed.
        UserError: There is no such scene, or it cannot be built.
    """
    scene = scene or load_run_scene(name, None, configuration, [task], seed)
    factor = 1.0 if scene is None else scene.sensor_factor
    errors = sensor_setup(configuration, ideal=ideal_sensors, factor=factor)
    plant: Plant
    if name not in PLANTS:
        plant = _open_provided(name, PlantRequest(configuration.site, scene, to_doubles(task.start), seed))
    elif scene is None:
        plant = _build_symbolic(configuration, task, seed)
    else:
        plant = _build(name, configuration.site, scene, seed, errors, spectators, people, faults, on_fault)
    try:
        yield plant
    finally:
        try:
            plant.close()
        except OSError as failure:
            raise PlantSetupError(f"the recording cannot be completed: {failure}") from failure


def open_scene(
    name: str, configuration: Configuration, scene: Scene, seed: int, *, ideal_sensors: bool = False
) -> AbstractContextManager[Plant]:
    """Open a simulator in a scene, without people, faults and viewers.

    Args:
        name: `physics`, `mujoco` or `kinematic`.
        configuration: Its site has the errors of the sensors.
        scene: The scene.
        seed: Seed of all random numbers.
        ideal_sensors: As in `open_plant`.

    Returns:
        The plant; it is closed however the block ends.

    Raises:
        PlantSetupError: The extra is missing.
        UserError: The scene cannot be built.
    """
    return closing(make_simulator(name, configuration, scene, seed, ideal_sensors=ideal_sensors))


def make_simulator(
    name: str, configuration: Configuration, scene: Scene, seed: int, *, ideal_sensors: bool = False
) -> Plant:
    """Make a simulator as `open_scene` opens it; the caller closes it.

    Args:
        name: As in `open_scene`.
        configuration: As in `open_scene`.
        scene: As in `open_scene`.
        seed: As in `open_scene`.
        ideal_sensors: As in `open_plant`.

    Returns:
        The plant.

    Raises:
        PlantSetupError: The extra is missing.
        UserError: The scene cannot be built.
    """
    return _build(name, configuration.site, scene, seed, sensor_setup(configuration, ideal=ideal_sensors))


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


def _has_scene(tasks: Sequence[Task]) -> bool:
    """Return True if the tasks, or those that they compose, name scenes."""
    return all(part.scene is not None for task in tasks for _, part in task.rehearsals(""))


def _open_provided(name: str, request: PlantRequest) -> Plant:
    try:
        return open_provided_plant(name, request)
    except PlantProviderError as failure:
        raise PlantSetupError(str(failure)) from failure


def _build_symbolic(configuration: Configuration, task: Task, seed: int) -> Plant:
    from aeros.sim.symbolic.plant import SymbolicPlant

    return SymbolicPlant(configuration.site, configuration.modules, seed, to_doubles(task.start))


def _build(
    name: str,
    site: Site,
    scene: Scene,
    seed: int,
    errors: SensorSetup,
    spectators: Sequence[Viewer] = (),
    people: Sequence[Person] = (),
    faults: Sequence[Fault] = (),
    on_fault: Callable[[FaultEvent], None] | None = None,
) -> Plant:
    if name in PHYSICS_PLANTS:
        return _build_physics(name, site, scene, seed, errors, spectators, people, faults, on_fault)
    return _build_kinematic(site, scene, seed, errors)


def _build_kinematic(site: Site, scene: Scene, seed: int, errors: SensorSetup) -> Plant:
    try:
        from aeros.sim.kinematic.plant import make_plant
        from aeros.sim.robot.robot_file import robot_of
    except ImportError as error:
        raise _missing("kinematic", error.name) from error
    return make_plant(scene, seed, errors.survey, errors.scanners, robot_of(site))


def _build_physics(
    name: str,
    site: Site,
    scene: Scene,
    seed: int,
    errors: SensorSetup,
    spectators: Sequence[Viewer],
    people: Sequence[Person],
    faults: Sequence[Fault],
    on_fault: Callable[[FaultEvent], None] | None,
) -> Plant:
    with _physics_import_errors(name):
        from aeros.sim.faults.injector import FaultInjector
        from aeros.sim.physics import make_bullet_engine, make_mujoco_engine, make_plant
        from aeros.sim.robot.robot_file import robot_of

        engine = (make_mujoco_engine if name == "mujoco" else make_bullet_engine)()

    disturbance = None if on_fault is None else FaultInjector(faults, seed, on_fault)
    return make_plant(
        scene,
        seed,
        errors.survey,
        robot_of(site),
        engine=engine,
        sensors=errors.models,
        odometry=errors.odometry,
        scanners=errors.scanners,
        spectators=spectators,
        people=people,
        disturbance=disturbance,
    )


@contextmanager
def _physics_import_errors(plant: str) -> Iterator[None]:
    try:
        yield
    except ImportError as error:
        raise _missing(plant, error.name) from error


def _missing(plant: str, package: str | None) -> PlantSetupError:
    """Return the error for a plant whose package is missing; it names the plants that can run here."""
    needed = install_command("sim" if plant == "physics" else plant)
    return PlantSetupError(
        f"the {plant} plant needs {needed} ({package} is missing); "
        f"plants that can run here: {', '.join(runnable_plants())}"
    )
