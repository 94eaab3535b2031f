"""Plants by name.  PyBullet is imported only where physics is asked for."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from aeros.runtime.configuration import Configuration
from aeros.runtime.ports import Plant
from aeros.sim.hosting.remote import RemotePlant
from aeros.spec.doubles import as_doubles
from aeros.spec.model import Task

if TYPE_CHECKING:
    from aeros.sim.bodies import Body
    from aeros.sim.faults.injector import Happening
    from aeros.sim.faults.model import Fault
    from aeros.sim.people import Person
    from aeros.sim.physics import Spectator
    from aeros.sim.scenes.scene import Scene

_START: Final = 60.0
"""Seconds for a plant in another process to be there: it proves its modules and builds its scene first."""

_LISTENS: Final = 1.0
"""Seconds from a socket that is there to one that is listened to."""

_LOOK_EVERY: Final = 0.02  # s

PLANTS = ("physics", "kinematic", "symbolic")


class PlantRefusedError(Exception):
    """The plant or its output cannot be had; the message says why and what to do."""


def people_of(plant: str, name_or_path: str | None) -> tuple[Person, ...]:
    """Who is to walk about on `plant`.  Raises UserError for a file that does not say so."""
    if name_or_path is None:
        return ()
    if plant != "physics":
        raise PlantRefusedError(f"`--person` needs the physics plant: the {plant} plant has no people")
    with _importing_physics():
        from aeros.sim.people_file import read_people
    return read_people(name_or_path)


def faults_of(
    plant: str, name_or_path: str | None, configuration: Configuration, task: Task
) -> Sequence[Fault]:
    """What is to go wrong on `plant`.  Raises UserError for a file that does not say so."""
    if name_or_path is None:
        return ()
    if plant != "physics":
        raise PlantRefusedError(
            f"`--faults` needs the physics plant: what goes wrong on the {plant} plant are declared outcomes"
        )
    with _importing_physics():
        from aeros.sim.faults.reading import Surroundings, read_faults
    _, scene = _scene(task.scene)
    skills = [f"{ecm.id}.{skill}" for ecm in configuration.modules.values() for skill in ecm.skills]
    known = Surroundings(configuration.site.state, skills, scene.things, scene.cameras)
    return read_faults(name_or_path, known)


def bodies_of(plant: str, name_or_path: str | None, task: Task, seed: int) -> Sequence[Body]:
    """What is to stand and lie about on `plant` besides the task's own things.

    Raises UserError for a file that does not say so, and where any of it would be in something's place.
    """
    if name_or_path is None:
        return ()
    if plant != "physics":
        raise PlantRefusedError(
            f"`--scene` needs the physics plant: on the {plant} plant nothing is in the way"
        )
    with _importing_physics():
        from aeros.sim.physics import make_plant
        from aeros.sim.scene_file import read_bodies
    known, _ = _scene(task.scene)
    bodies = read_bodies(name_or_path)
    make_plant(known, seed, bodies=bodies).close()
    return bodies


def film_of(plant: str, path: Path) -> Spectator:
    """Who films `plant`, and writes that to `path` when it is closed.  Refuses what would fail then."""
    _needs_physics("--record", plant)
    with _importing_physics():
        from aeros.sim.video import FilmError, Recorder
    try:
        return Recorder(path)
    except FilmError as refusal:
        raise PlantRefusedError(f"{refusal}; give another file with --record") from refusal


def window_of(plant: str) -> Spectator:
    """Who shows `plant` in a window."""
    _needs_physics("--view", plant)
    with _importing_physics():
        from aeros.sim.window import Window, WindowError
    try:
        return Window()
    except WindowError as refusal:
        raise PlantRefusedError(f"--view: {refusal}; or use --record, which needs no display") from refusal


def _needs_physics(option: str, plant: str) -> None:
    if plant != "physics":
        raise PlantRefusedError(
            f"`{option}` needs the physics plant: the {plant} plant has nothing to be seen; "
            "`--mcap` keeps what is measured on any plant"
        )


@contextmanager
def open_plant(
    name: str,
    configuration: Configuration,
    task: Task,
    seed: int,
    spectators: Sequence[Spectator] = (),
    people: Sequence[Person] = (),
    faults: Sequence[Fault] = (),
    tell: Callable[[Happening], None] | None = None,
    bodies: Sequence[Body] = (),
) -> Iterator[Plant]:
    """The plant `name`, ready for `task`, closed again however the block ends.

    tell: hears of each of the `faults` as it happens.
    """
    if name == "physics":
        plant = _physics(task.scene, seed, spectators, people, faults, tell, bodies)
    elif name == "kinematic":
        plant = _kinematic(task.scene, seed)
    else:
        plant = _symbolic(configuration, task, seed)
    try:
        yield plant
    finally:
        try:
            plant.close()
        except OSError as failure:
            raise PlantRefusedError(f"the film cannot be written: {failure}") from failure


def joined(path: Path) -> RemotePlant:
    """The plant that another process serves at `path`, once it is there."""
    latest = time.monotonic() + _START
    while True:
        try:
            return RemotePlant(path)
        except OSError as failure:
            if isinstance(failure, ConnectionRefusedError):
                # The socket is there, and nobody behind it: it listens in a moment, or it never will again.
                latest = min(latest, time.monotonic() + _LISTENS)
            if time.monotonic() >= latest:
                raise PlantRefusedError(
                    f"nobody serves a plant at `{path}` ({failure.strerror}); if its process ended, so did "
                    "the simulated plant: begin the task anew, by its instruction"
                ) from failure
        time.sleep(_LOOK_EVERY)


def _symbolic(configuration: Configuration, task: Task, seed: int) -> Plant:
    from aeros.sim.symbolic import SymbolicPlant

    return SymbolicPlant(configuration.site, configuration.modules, seed, as_doubles(task.initial))


def _kinematic(scene: str | None, seed: int) -> Plant:
    try:
        from aeros.sim.kinematic.plant import make_plant
        from aeros.sim.kinematic.scenes import SCENES
    except ImportError as error:
        raise PlantRefusedError(
            f"the kinematic plant needs `pip install 'aeros[kinematic]'` ({error.name} is missing); "
            "or use `--plant symbolic`"
        ) from error
    return make_plant(_known(scene, SCENES), seed)


def _physics(
    scene: str | None,
    seed: int,
    spectators: Sequence[Spectator],
    people: Sequence[Person],
    faults: Sequence[Fault],
    tell: Callable[[Happening], None] | None,
    bodies: Sequence[Body],
) -> Plant:
    known_scene, _ = _scene(scene)
    from aeros.sim.faults.injector import Injector
    from aeros.sim.physics import make_plant

    disturbance = None if tell is None else Injector(faults, seed, tell)
    return make_plant(
        known_scene, seed, spectators=spectators, people=people, disturbance=disturbance, bodies=bodies
    )


def _scene(scene: str | None) -> tuple[str, Scene]:
    """The scene that a task takes place in, by name and as it is before it is built."""
    with _importing_physics():
        from aeros.sim.scenes import SCENES
    known = _known(scene, SCENES)
    return known, SCENES[known]()


@contextmanager
def _importing_physics() -> Iterator[None]:
    try:
        yield
    except ImportError as error:
        raise PlantRefusedError(
            f"the physics plant needs `pip install 'aeros[sim]'` ({error.name} is missing); "
            "or use `--plant kinematic` or `--plant symbolic`"
        ) from error


def _known(scene: str | None, scenes: Collection[str]) -> str:
    """The task's scene, if there is one of that name."""
    if scene is None or scene not in scenes:
        raise PlantRefusedError(
            f"the task's scene is `{scene}`, but there is only {', '.join(scenes)}; or use `--plant symbolic`"
        )
    return scene
