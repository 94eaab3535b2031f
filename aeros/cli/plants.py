"""Plants by name.  PyBullet is imported only where physics is asked for."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from aeros.runtime.configuration import Configuration
from aeros.runtime.ports import Plant
from aeros.spec.doubles import as_doubles
from aeros.spec.model import Task

PLANTS = ("physics", "kinematic", "symbolic")


class PlantRefusedError(Exception):
    """The plant or its output cannot be had; the message says why and what to do."""


@contextmanager
def open_plant(
    name: str, configuration: Configuration, task: Task, seed: int, film: Path | None
) -> Iterator[Plant]:
    """The plant `name`, ready for `task`, closed again however the block ends."""
    if name == "physics":
        plant = _physics(task.scene, seed, film)
    elif name == "kinematic":
        plant = _kinematic(task.scene, seed)
    else:
        plant = _symbolic(configuration, task, seed)
    try:
        yield plant
    finally:
        plant.close()


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


def _physics(scene: str | None, seed: int, film: Path | None) -> Plant:
    try:
        from aeros.sim.physics import make_plant
        from aeros.sim.scenes import SCENES
    except ImportError as error:
        raise PlantRefusedError(
            f"the physics plant needs `pip install 'aeros[sim]'` ({error.name} is missing); "
            "or use `--plant kinematic` or `--plant symbolic`"
        ) from error
    return make_plant(_known(scene, SCENES), seed, film)


def _known(scene: str | None, scenes: Collection[str]) -> str:
    """The task's scene, if there is one of that name."""
    if scene is None or scene not in scenes:
        raise PlantRefusedError(
            f"the task's scene is `{scene}`, but there is only {', '.join(scenes)}; or use `--plant symbolic`"
        )
    return scene
