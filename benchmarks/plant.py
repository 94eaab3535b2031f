"""Measure the cost of deciding and of physics, and the parts of a trial: `python -m benchmarks.plant`.

Each task runs on the physics plant from its beginning to its measured goal: agent with its memory, gate,
monitor and audit record as in `aeros run`, without a recording of poses.  Modules are proved and the gate is
compiled once; skills run in this process, as for modules that the site trusts (`benchmarks.isolation`
measures the cost of a worker).  Three times are measured, in turn, of the very same motions:

- raw: PyBullet alone steps a world of the same scene, its motors set as they were in the run;
- plant: a plant receives the same actions without an agent or gate: planning, motors, sensors;
- run: the whole, so that what it takes beyond `plant` is gate, monitor of limits, audit, memory and agent;

and the time beyond `plant` for measuring the distance of a person at every tick.  At the end all things must
be in the same places, to the last bit.

Then the same trials run on one process, and on each of two at the same time, by the clock: this alone needs a
machine that does nothing else.  For comparison PyBullet alone does the same: it steps the motions of one such
trial as often, again on one process and on each of two.  The machine causes what PyBullet loses; AEROS causes
only what trials lose beyond it.

Processor time is measured, as other work on the machine adds little or nothing to it.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import Any, Final, NamedTuple

from aeros.agent.agent import start_agent
from aeros.agent.memory.store import Memory
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.motion.trajectory import MotionDecider
from aeros.runtime.ports import Plant
from aeros.runtime.proving import prove_configuration
from aeros.runtime.records.encode_decisions import IncrementalDecisionEncoder
from aeros.runtime.skills.in_process_run import InProcessRun, run_in_process
from aeros.session.assembly import build_executor
from aeros.session.scene_files import scene_of_task
from aeros.sim.bullet.renderer import Renderer
from aeros.sim.bullet.robot import BulletRobot
from aeros.sim.bullet.world import PhysicsWorld
from aeros.sim.engine.people import People, Person, Waypoint
from aeros.sim.fixed_step_plant import FixedStepPlant
from aeros.sim.physics import PhysicsPlant, make_plant
from aeros.sim.scenes.physics_scene import PhysicsScene
from aeros.spec.text.discovery import reference_site_path
from benchmarks.command import build_parser, print_json
from benchmarks.plant_replay import (
    Call,
    MotorTape,
    RecordingPlant,
    body_states,
    record_motor_commands,
    replay_calls,
    replay_motor_commands,
)
from benchmarks.profiler import Part, measure_shares

_TASKS: Final = {
    "make_dumplings": "make dumplings",
    "clean_table": "clean the table",
    "fetch_object": "fetch the object",
}

_PERSON: Final = Person("bystander", (Waypoint((-4.0, 0.0)),))
"""Somebody who stands where nothing is stopped for them; their distance is measured all the same."""

_REST: Final = "agent, executor and the rest"

_PARTS: Final[tuple[Part, ...]] = (
    ("PyBullet's steps", PhysicsWorld, ("step",)),
    ("pictures", Renderer, ("render",)),
    ("motor commands", BulletRobot, ("set_arm_motors", "command_base", "set_finger_motors")),
    ("robot's sensors", BulletRobot, ("read_sensors", "finger_forces", "wrist_vertical_force")),
    ("the scene's own measures", PhysicsScene, ("tick", "measure")),
    ("people", People, ("update", "distance")),
    ("plant: planning", FixedStepPlant, ("plan",)),
    ("plant: servoing, ticks and the rest", PhysicsPlant, ("observe",)),
    ("plant: servoing, ticks and the rest", FixedStepPlant, ("begin", "advance", "stop")),
    ("monitor", RuntimeMonitor, ("__init__", "__call__", "add", "remove")),
    ("gate", CompiledGate, ("decide", "decide_jointly")),
    ("whole motions decided", MotionDecider, ("decide",)),
    ("audit record", AuditLog, ("append",)),
    ("encoding decisions as records", IncrementalDecisionEncoder, ("encode", "encode_motion")),
    (
        "agent's memory",
        Memory,
        ("start_episode", "end_episode", "add_event", "set_fact", "mark_interrupted", "end_session"),
    ),
    ("skill code", InProcessRun, ("resume",)),
)


class SharedSetup(NamedTuple):
    """Configuration and gate that all runs share."""

    configuration: Configuration
    gate: CompiledGate


@dataclass(frozen=True)
class RecordedRun:
    """A recorded run: calls to its plant, motor commands, and where everything was at its end."""

    calls: list[Call]
    tape: MotorTape
    places: list[object]


@dataclass(frozen=True)
class TaskTimings:
    """Timings of one task, processor seconds unless stated otherwise.

    Attributes:
        task: name of the task.
        reached: True if it reached its goal.
        simulated: seconds on the plant's clock.
        ticks: steps of the world.
        build_s: building the world, which is then at rest.
        raw_physics_s: PyBullet alone.
        plant_s: the plant with the same actions.
        run_s: the whole run.
        with_person: the plant, measuring the distance of a person at every tick.
        is_reproduced: True if all three ended with everything in the same places.
        overhead: share of `raw_physics_s` that deciding takes.
        distances: share of `raw_physics_s` that measuring a person's distance takes.
        parts: seconds by part of the run.
    """

    task: str
    reached: bool
    simulated: float
    ticks: int
    build_s: float
    raw_physics_s: float
    plant_s: float
    run_s: float
    with_person: float
    is_reproduced: bool
    overhead: float
    distances: float
    parts: dict[str, float]


def prepare() -> SharedSetup:
    """Prove all modules of this repository, and compile their gate."""
    configuration, _ = prove_configuration(
        [Path(__file__).parents[1] / "ecms"], reference_site_path(), certified=True
    )
    return SharedSetup(configuration, CompiledGate(configuration))


def build(common: SharedSetup, task: str, seed: int, people: tuple[Person, ...] = ()) -> PhysicsPlant:
    """Build a plant with the scene of the task."""
    configuration = common.configuration
    scene = scene_of_task(configuration, configuration.modules[task].tasks[task])
    return make_plant(scene, seed, people=people)


@contextmanager
def open_built_plant(
    common: SharedSetup, task: str, seed: int, people: tuple[Person, ...] = ()
) -> Iterator[PhysicsPlant]:
    """Build a plant with the scene of the task, and close it afterwards."""
    plant = build(common, task, seed, people)
    try:
        yield plant
    finally:
        plant.close()


def run(common: SharedSetup, plant: Plant, task: str, folder: Path) -> tuple[bool, float]:
    """Run the task; return whether its goal is measured at the end, and processor seconds."""
    configuration = common.configuration
    with ExitStack() as stack:
        audit = AuditLog(folder / "audit.jsonl", durability=configuration.site.durability)
        stack.enter_context(audit)
        began = time.process_time()
        executor = build_executor(configuration, plant, audit, run_in_process, gate=common.gate)
        stack.enter_context(executor)
        agent = stack.enter_context(start_agent(folder / "state", configuration.site.id, executor))
        report = agent.run(_TASKS[task])
        return report.reached, time.process_time() - began


def record_run(common: SharedSetup, task: str, seed: int, folder: Path) -> RecordedRun:
    """Run once, and record calls, motor commands and the end."""
    with open_built_plant(common, task, seed) as plant, record_motor_commands() as tape:
        noting = RecordingPlant(plant)
        run(common, noting, task, folder)
        return RecordedRun(noting.calls, tape, body_states(plant))


def measure(common: SharedSetup, task: str, seed: int, rounds: int, parent: Path) -> TaskTimings:
    """Measure the three ways in turn, several times, and return the medians."""
    times: dict[str, list[float]] = {name: [] for name in ("building", "raw", "plant", "run", "person")}
    same = True
    reached = False
    simulated = 0.0
    with _folder(parent) as folder:
        noted = record_run(common, task, seed, folder)
    for _ in range(rounds):
        with open_built_plant(common, task, seed) as plant:
            times["raw"].append(replay_motor_commands(noted.tape, plant))
            same &= body_states(plant) == noted.places
        with open_built_plant(common, task, seed) as plant:
            times["plant"].append(replay_calls(plant, noted.calls))
            same &= body_states(plant) == noted.places
        with open_built_plant(common, task, seed, (_PERSON,)) as plant:
            times["person"].append(replay_calls(plant, noted.calls))
        began = time.process_time()
        with open_built_plant(common, task, seed) as plant, _folder(parent) as folder:
            times["building"].append(time.process_time() - began)
            reached, took = run(common, plant, task, folder)
            times["run"].append(took)
            simulated = plant.now()
            same &= body_states(plant) == noted.places
    with (
        open_built_plant(common, task, seed) as plant,
        _folder(parent) as folder,
        measure_shares(_PARTS, _REST) as shares,
    ):
        run(common, plant, task, folder)
    middle = {name: statistics.median(values) for name, values in times.items()}
    return TaskTimings(
        task,
        reached,
        simulated,
        len(noted.tape) - 1,
        middle["building"],
        middle["raw"],
        middle["plant"],
        middle["run"],
        middle["person"],
        same,
        (middle["run"] - middle["plant"]) / middle["raw"],
        (middle["person"] - middle["plant"]) / middle["raw"],
        dict(sorted(shares.seconds.items(), key=lambda one: -one[1])),
    )


@contextmanager
def _folder(parent: Path) -> Iterator[Path]:
    with tempfile.TemporaryDirectory(dir=parent) as folder:
        yield Path(folder)


# In parallel.

WorkFactory = Callable[[SharedSetup, str, Path], Callable[[int], object]]
"""Factory that prepares a process for a task and returns the work to do for each seed."""

_common: tuple[SharedSetup, Barrier] | None = None


def _prepare(start: Barrier) -> None:
    global _common
    _common = prepare(), start


def _trials(common: SharedSetup, task: str, parent: Path) -> Callable[[int], object]:
    """Return a function that runs the trial of a seed."""

    def trial(seed: int) -> object:
        with open_built_plant(common, task, seed) as plant, _folder(parent) as folder:
            return run(common, plant, task, folder)

    return trial


def _steps(common: SharedSetup, task: str, parent: Path) -> Callable[[int], object]:
    """Return a function that steps a new world by PyBullet alone, with the motor commands of one trial."""
    with _folder(parent) as folder:
        tape = record_run(common, task, 1, folder).tape

    def steps(_: int) -> object:
        with open_built_plant(common, task, 1) as plant:
            return replay_motor_commands(tape, plant)

    return steps


def _make(work: WorkFactory, task: str, trials: int, parent: Path) -> tuple[float, float]:
    """Measure seconds by the clock, and of this processor, of some work in a process that is prepared.

    It begins once all processes are prepared, so that each does it once and none waits for another.
    """
    if _common is None:
        sys.exit("the process is not prepared")
    common, start = _common
    make = work(common, task, parent)
    make(1)  # only makes warm
    start.wait()
    began, began_cpu = time.perf_counter(), time.process_time()
    for seed in range(trials):
        make(seed)
    return time.perf_counter() - began, time.process_time() - began_cpu


def parallel_times(work: WorkFactory, task: str, trials: int, workers: int, parent: Path) -> dict[str, float]:
    """Measure seconds of the same work on each of several processes at the same time.

    By the clock, of the slowest process; and of processors, of all.
    """
    # Each starts afresh: a copy of this one would hold what it has measured.
    context = get_context("spawn")
    with ProcessPoolExecutor(workers, context, _prepare, (context.Barrier(workers),)) as pool:
        given = [[each] * workers for each in (work, task, trials, parent)]
        took = list(pool.map(_make, *given))
    seconds, processor = zip(*took, strict=True)
    return {"workers": workers, "seconds": max(seconds), "processor": sum(processor)}


def _print(found: TaskTimings) -> None:
    print(f"\n{found.task}, {'to its goal' if found.reached else 'NOT to its goal'}: ", end="")
    print(f"{found.simulated:.1f} s simulated, {found.ticks} ticks", end="")
    print("" if found.is_reproduced else ", and NOT the same motions each time")
    rows: list[tuple[str, float]] = [
        ("the world built", found.build_s),
        ("raw: PyBullet alone", found.raw_physics_s),
        ("plant: the same actions", found.plant_s),
        ("run: with all that decides", found.run_s),
    ]
    for name, seconds in rows:
        print(f"  {name:38} {seconds:6.2f} s  {100 * seconds / found.raw_physics_s:4.0f} % of raw")
    print(f"  gate, monitor, audit, agent: {100 * found.overhead:.1f} % of raw")
    print(f"  distance of a person: {100 * found.distances:.1f} % of raw")
    print("  told apart, with what that takes by itself:")
    for part, seconds in found.parts.items():
        print(f"    {part:36} {seconds:6.2f} s")
    sys.stdout.flush()


def _print_spread(what: str, measured: dict[str, Any]) -> None:
    one, two = measured["one"], measured["two"]
    print(f"\n{what}: {one['seconds']:.1f} s on one process, ", end="")
    print(f"{two['seconds']:.1f} s on each of two: {100 * measured['efficiency']:.0f} % efficient", end="")
    print(f" (processors: {one['processor']:.1f} s and {two['processor']:.1f} s)", flush=True)


def main(argv: list[str]) -> None:
    """Measure, and print the results."""
    parser = build_parser(__doc__, "one short task, once")
    parser.add_argument("--tasks", nargs="+", choices=_TASKS, default=list(_TASKS))
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--trials",
        type=int,
        default=20,
        help="of the last task, on one process, and on each of two; may be 0",
    )
    parser.add_argument("--folder", type=Path, default=Path("/dev/shm"), help="where agent and log are kept")  # noqa: S108
    arguments = parser.parse_args(argv)
    tasks, rounds, trials = arguments.tasks, arguments.rounds, arguments.trials
    if arguments.quick:
        tasks, rounds, trials = ["fetch_object"], 1, min(trials, 1)
    common = prepare()
    is_text = arguments.format != "json"
    found = []
    for task in tasks:
        found.append(measure(common, task, arguments.seed, rounds, arguments.folder))
        if is_text:  # at once: all of it takes minutes, and may be cut off
            _print(found[-1])
    parallel: dict[str, Any] = {}
    works: dict[str, WorkFactory] = {"PyBullet alone": _steps}
    if not arguments.quick:  # which only shows that it runs
        works = {"trials": _trials, **works}
    for name, work in works.items() if trials else ():
        one, two = (parallel_times(work, tasks[-1], trials, workers, arguments.folder) for workers in (1, 2))
        parallel[name] = {"one": one, "two": two, "efficiency": one["seconds"] / two["seconds"]}
        if is_text:
            _print_spread(f"{tasks[-1]}, {trials} times, {name}", parallel[name])
    if not is_text:
        print_json({"tasks": [asdict(row) for row in found], "parallel": parallel})


if __name__ == "__main__":
    main(sys.argv[1:])
