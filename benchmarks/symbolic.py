"""Measure the time of task runs on the symbolic plant: `python -m benchmarks.symbolic`.

Each run is `make dumplings` from its beginning to its measured goal: agent with its memory, gate, monitor and
audit record as in `aeros run`, in one process; modules are proved and the gate is compiled once.  Skills run
in this process, as for modules that the site trusts.  Records are made durable many at a time
(`durability: batched`); agent and log are kept where --folder says, by default in memory.

Processor time is measured, as other work on the machine adds little to it, and for each part without the
parts that it calls.  Then as many runs again on each of --workers processes, by the clock, once all are
prepared: this alone needs a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import Final, NamedTuple

from aeros.agent.agent import open_temporary_agent
from aeros.agent.memory.store import Memory
from aeros.runtime.audit.log import AuditLog
from aeros.runtime.gate.configuration import Configuration
from aeros.runtime.gate.gate import CompiledGate
from aeros.runtime.monitor.monitor import RuntimeMonitor
from aeros.runtime.proving import prove_configuration
from aeros.runtime.records.encode_decisions import IncrementalDecisionEncoder
from aeros.runtime.skills.in_process_run import CachedRunFactory, InProcessRun
from aeros.session.assembly import build_executor
from aeros.sim.symbolic.plant import SymbolicPlant
from aeros.spec.expr.doubles import to_doubles
from aeros.spec.model.policy import Durability
from aeros.spec.text.discovery import reference_site_path
from benchmarks.profiler import Part, measure_shares

_TASK: Final = "make_dumplings"

_REST: Final = "agent, executor and the rest"

_PARTS: Final[tuple[Part, ...]] = (
    ("plant", SymbolicPlant, ("__init__", "observe", "plan", "begin", "advance", "skill_ended")),
    ("gate", CompiledGate, ("decide",)),
    ("monitor", RuntimeMonitor, ("__init__", "__call__", "add", "remove")),
    ("audit record", AuditLog, ("append",)),
    ("encoding decisions as records", IncrementalDecisionEncoder, ("encode", "encode_motion")),
    (
        "agent's memory",
        Memory,
        ("start_episode", "end_episode", "add_event", "set_fact", "mark_interrupted", "end_session"),
    ),
    ("skill code", InProcessRun, ("resume",)),
)


class RunTimings(NamedTuple):
    """Timings of several runs: goals reached, steps, records, seconds of processor and clock."""

    reached: int
    steps: int
    records: int
    processor: float
    wall: float


def run_tasks(
    configuration: Configuration, gate: CompiledGate, runs: int, folder: Path
) -> tuple[int, int, int]:
    """Run tasks with seeds 0, 1, and so on; return the runs that reached their goal, steps, and records."""
    initial = to_doubles(configuration.modules[_TASK].tasks[_TASK].initial)
    rested = SymbolicPlant(configuration.site, configuration.modules, 0, initial)
    open_run = CachedRunFactory()
    reached = steps = 0
    with AuditLog(folder / "audit.jsonl", durability=Durability.BATCHED) as audit:
        for seed in range(runs):
            with (
                build_executor(configuration, rested.reset(seed), audit, open_run, gate=gate) as executor,
                open_temporary_agent(configuration.site.id, executor) as agent,
            ):
                report = agent.run("make dumplings")
            reached += report.reached
            steps += len(report.steps)
        records = audit.append("benchmark-ended", {})
    return reached, steps, records


def measure(configuration: Configuration, gate: CompiledGate, runs: int, parent: Path) -> RunTimings:
    """Measure several runs."""
    with tempfile.TemporaryDirectory(dir=parent) as folder:
        began, began_cpu = time.perf_counter(), time.process_time()
        found = run_tasks(configuration, gate, runs, Path(folder))
        return RunTimings(*found, time.process_time() - began_cpu, time.perf_counter() - began)


def prepare(runs: int, parent: Path) -> tuple[Configuration, CompiledGate]:
    """Prove the modules, compile a gate, and do once all that is done at first use."""
    configuration, _ = prove_configuration(
        [Path(__file__).parents[1] / "ecms"], reference_site_path(), certified=True
    )
    gate = CompiledGate(configuration)
    measure(configuration, gate, min(runs, 5), parent)
    # What is there now is no garbage of any run.
    gc.freeze()
    return configuration, gate


_ready: Barrier | None = None


def _wait_for(ready: Barrier) -> None:
    global _ready
    _ready = ready


def _run_share(runs: int, parent: Path) -> float:
    """Measure the seconds by the clock of several runs in this process, from when all processes are ready."""
    if _ready is None:
        sys.exit("the process is not prepared")
    configuration, gate = prepare(runs, parent)
    _ready.wait()
    return measure(configuration, gate, runs, parent).wall


def parallel_times(runs: int, workers: int, parent: Path) -> float:
    """Measure seconds by the clock, of the slowest process, of as many runs on each worker."""
    context = get_context("spawn")
    with ProcessPoolExecutor(workers, context, _wait_for, (context.Barrier(workers),)) as pool:
        return max(pool.map(_run_share, [runs] * workers, [parent] * workers))


def main(argv: list[str]) -> None:
    """Measure, and print the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--folder", type=Path, default=Path("/dev/shm"), help="where agent and log are kept")  # noqa: S108
    arguments = parser.parse_args(argv)
    runs, workers, folder = arguments.runs, arguments.workers, arguments.folder
    configuration, gate = prepare(runs, folder)
    one = measure(configuration, gate, runs, folder)
    with measure_shares(_PARTS, _REST) as shares:
        apart = measure(configuration, gate, runs, folder).processor
    print(f"{runs} runs, {one.reached} to their goal; ", end="")
    print(f"{one.steps / runs:.2f} steps, {one.records / runs:.0f} records each")
    print(f"{1000 * one.processor / runs:.1f} ms of processor a run, ", end="")
    print(f"{1000 * one.wall / runs:.1f} ms by the clock")
    print(f"told apart, which takes {1000 * (apart - one.processor) / runs:.1f} ms by itself:")
    for part, seconds in sorted(shares.seconds.items(), key=lambda one: -one[1]):
        print(f"  {part:30} {1000 * seconds / runs:6.1f} ms  {100 * seconds / apart:3.0f} %")
    wall = parallel_times(runs, workers, folder)
    print(f"{runs} runs on each of {workers} processes: {wall:.1f} s by the clock; ", end="")
    print(f"10,000 at that rate: {10_000 * wall / (runs * workers):.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
