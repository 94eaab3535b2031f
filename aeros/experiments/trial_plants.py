"""Plants of trials, one for each seed: by declared probabilities, or physics with seeded faults."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

from aeros.distribution import install_command
from aeros.files import temporary_folder
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.motion.swept_volume import moves_joints
from aeros.runtime.ports import PlannedMotion, Plant, Trajectory
from aeros.session.plant_factory import surroundings_of
from aeros.session.sensor_models import sensor_setup
from aeros.sim.gilbert_elliott import GilbertElliottProcess
from aeros.sim.symbolic.outcomes import BurstOutcomes
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.skill import Action
from aeros.spec.diagnostics.codes import Diagnostic
from aeros.spec.diagnostics.errors import UserError
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.ecm import Ecm, Task
from aeros.spec.model.scene import Scene
from aeros.spec.model.site import Site

if TYPE_CHECKING:
    from aeros.sim.faults.injector import FaultEvent
    from aeros.sim.faults.model import Fault


@dataclass
class OpenPlant:
    """An open plant, and counts of what it did.

    Attributes:
        plant: the plant.
        counts: counts by the name that findings have them under.
        equivalent_interval: draws as `random_stream.py` reads them: on the symbolic plant it returns the
            outcomes drawn so far, on physics the numbers of the condition between which the same seed does
            the same.
    """

    plant: Plant
    counts: dict[str, int] = field(default_factory=dict)
    equivalent_interval: Callable[[], Any] | None = None


PlantFactory = Callable[[int], AbstractContextManager[OpenPlant]]
"""Opens the plant of a seed."""


def symbolic_plants(
    site: Site, modules: Mapping[str, Ecm], task: Task, bursts: Mapping[str, BurstOutcomes] | None = None
) -> PlantFactory:
    """Make symbolic plants ready, on which modules behave as they declare.

    Args:
        site: the site of the modules.
        modules: modules by id.
        task: its initial values are where each plant begins.
        bursts: outcomes of skills that are drawn in bursts, by `MODULE.SKILL`.

    Returns:
        A function that opens the plant of a seed.
    """
    rested = SymbolicPlant(site, modules, 0, to_doubles(task.start), bursts)

    @contextmanager
    def opened(seed: int) -> Iterator[OpenPlant]:
        plant = rested.reset(seed)
        yield OpenPlant(plant, equivalent_interval=plant.drawn_outcomes)

    return opened


def physics_plants(
    configuration: Configuration,
    scene: Scene,
    faults: str,
    process: GilbertElliottProcess | Mapping[str, GilbertElliottProcess],
) -> PlantFactory:
    """Make physics plants ready, in which declared faults happen at random.

    Args:
        configuration: the modules under their site.
        scene: the scene.
        faults: text of a faults file.
        process: the process by which every fault happens, or one for each fault by its name.

    Returns:
        A function that opens the plant of a seed.

    Raises:
        UserError: physics is not installed, or the text declares no faults.
    """
    try:
        from aeros.sim.faults.injector import FaultInjector
        from aeros.sim.physics import make_plant
        from aeros.sim.robot.robot_file import robot_of
    except ImportError as error:
        raise missing_physics_error(error) from error
    happening = _faults(faults, process, configuration, scene)
    errors, robot = sensor_setup(configuration), robot_of(configuration.site)

    @contextmanager
    def opened(seed: int) -> Iterator[OpenPlant]:
        found = OpenPlant(cast(Plant, None), {"faults": 0, "ik_solutions": 0})

        def count_fault(one: FaultEvent) -> None:
            found.counts["faults"] += one.event == "fault-started"

        injector = FaultInjector(happening, seed, count_fault)
        found.equivalent_interval = lambda: injector.equivalent_rates
        plant = make_plant(
            scene,
            seed,
            errors.survey,
            robot,
            sensors=errors.models,
            odometry=errors.odometry,
            disturbance=injector,
        )
        try:
            found.plant = cast(Plant, _CountingPlant(plant, found.counts))
            yield found
        finally:
            plant.close()

    return opened


def missing_physics_error(error: ImportError) -> UserError:
    """Describe what to install for the physics plant.

    Args:
        error: raised where a package is missing.

    Returns:
        The error for the user.
    """
    headline = f"the physics plant needs {install_command('sim')} ({error.name} is missing)"
    return UserError([Diagnostic("AE002", headline, help=("or use `--plant symbolic`",))])


def _faults(
    text: str,
    process: GilbertElliottProcess | Mapping[str, GilbertElliottProcess],
    configuration: Configuration,
    scene: Scene,
) -> tuple[Fault, ...]:
    from aeros.sim.faults.faults_file import read_faults

    around = surroundings_of(configuration, scene)
    with temporary_folder() as folder:
        path = folder / "faults.yaml"
        path.write_text(text, encoding="utf-8")
        declared = read_faults(str(path), around)
    each = {one.name: process[one.name] if isinstance(process, Mapping) else process for one in declared}
    return tuple(replace(one, process=each[one.name], max_count=None) for one in declared)


class _CountingPlant:
    """Plant that counts the points of planned paths, each of which is a solution of inverse kinematics."""

    def __init__(self, plant: Plant, counts: dict[str, int]) -> None:
        self._plant = plant
        self._counts = counts

    def plan(self, action: Action) -> PlannedMotion:
        """Implement `Plant.plan`."""
        plan = self._plant.plan(action)
        if isinstance(plan, Trajectory) and moves_joints(plan):
            self._counts["ik_solutions"] += sum(len(path) + 1 for path in plan.joint_paths)
        return plan

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)
